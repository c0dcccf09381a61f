"""Effects of the measuring chain, with formulas and filters of this generator's own."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt
from scipy.special import jv

from blind.build import Build
from blind.draws import coloured

Array = NDArray[np.float64]


def clipping(build: Build, size: float) -> None:
    """A range that `size` dB of the record's peaks do not fit into, the same in all records."""
    share = 10 ** (-size / 20)

    def clip(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:  # noqa: ARG001
        top = share * np.quantile(np.abs(data), 0.9999, axis=1)
        limits = build.truths[place]["limits"]
        for row, (values, limit) in enumerate(zip(data, top.tolist(), strict=True)):
            limits.setdefault(row, limit)
            np.clip(values, -limits[row], limits[row], out=values)
        return data

    build.hide("clipping")
    place = len(build.truths) - 1
    build.truths[place]["limits"] = {}
    build.digital.append(clip)


def dropouts(build: Build, size: float) -> None:
    """A cable that breaks `size` times a second, some milliseconds each time, on one channel or on all."""
    seconds = build.log_uniform(2e-3, 12e-3)
    everywhere = build.rng.random() < 0.5
    one = int(build.rng.integers(len(build.rig.channels)))

    def lose(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        for row in range(data.shape[0]):
            if not everywhere and row != one:
                continue
            at = rng.exponential(1 / size)
            while at < data.shape[1] / rate_hz:
                length = rng.exponential(seconds)
                data[row, round(at * rate_hz) : round((at + length) * rate_hz)] = 0.0
                at += length + rng.exponential(1 / size)
        return data

    build.digital.append(lose)
    build.hide("dropouts", rate_hz=size, duration_s=seconds)


def mains(build: Build, size: float) -> None:
    """Hum: `size` [m/s^2] at 50 or 60 Hz, with odd harmonics."""
    base = float(build.pick(("50", "60"))) * (1 + 2e-4 * build.rng.standard_normal())
    parts = {1: 1.0, 2: 0.1, 3: build.rng.uniform(0.2, 0.6), 5: build.rng.uniform(0.1, 0.3), 7: 0.1}
    shares = build.rng.uniform(0.5, 1.0, len(build.rig.channels))
    shares /= shares.max()

    def hum(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        t = np.arange(data.shape[1]) / rate_hz
        start = rng.uniform(0, 2 * math.pi, 8)
        wave = sum(part * np.cos(2 * math.pi * k * base * t + start[k]) for k, part in parts.items())
        return np.asarray(data + size * shares[:, None] * wave)

    build.analogue.append(hum)
    build.hide("mains_interference", (base,), amplitude_m_s2=size, frequency_hz=base)


def inverter(build: Build, size: float) -> None:
    """Lines of a frequency converter: `size` [m/s^2] at the carrier, side bands by Bessel functions."""
    carrier = build.log_uniform(2000.0, 0.3 * build.rig.rate_hz)
    output, depth = build.rng.uniform(20.0, 60.0), build.rng.uniform(0.4, 0.95)
    shares = build.rng.uniform(0.5, 1.0, len(build.rig.channels))
    shares /= shares.max()

    def switch(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        t = np.arange(data.shape[1]) / rate_hz
        begin = rng.uniform(0, 2 * math.pi, 2)
        wave = np.zeros(t.size)
        for m in range(1, 5):
            for n in range(-8, 9):
                f = m * carrier + n * output
                if (m + n) % 2 == 0 or not 0 < f < 0.49 * rate_hz:
                    continue
                # Naturally sampled leg: (2 / m pi) J_n(m pi M / 2) sin((m + n) pi / 2); a stray
                # capacitance passes the derivative, m times as much of the m-th group.
                height = jv(n, 0.5 * math.pi * depth * m) * math.sin(0.5 * math.pi * (m + n))
                wave += height * np.cos(2 * math.pi * f * t + m * begin[0] + n * begin[1])
        wave /= abs(float(jv(0, 0.5 * math.pi * depth)))
        return np.asarray(data + size * shares[:, None] * wave)

    build.analogue.append(switch)
    build.hide("inverter_lines", (carrier,), amplitude_m_s2=size, carrier_hz=carrier, modulation=depth)


def rolloff(build: Build, size: float) -> None:
    """A conditioner that ends within the band: a filter of second order at `size` times the rate."""
    corner = size * build.rig.rate_hz
    filter_ = butter(2, corner / (0.5 * build.rig.rate_hz), output="sos")

    def low_pass(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:  # noqa: ARG001
        return np.asarray(sosfilt(filter_, data, axis=1))

    build.analogue.append(low_pass)
    build.hide("antialias_rolloff", corner_hz=corner)


def floor(build: Build, size: float) -> None:
    """A floor about as high as the sensors' ordinary one, rising as 1/f below a corner at `size` Hz.

    The judge is not told how quiet the sensors are: what it can see of a floor is its colour.
    """
    share = build.log_uniform(0.4, 1.0)
    own = share**2 / (1 + share**2)  # of all noise above the corner

    def noise(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        for row, density in zip(data, build.rig.noise, strict=True):
            row += share * build.noise * density * coloured(row.size, 1.0, size, rate_hz, rng)
        return data

    build.analogue.append(noise)
    build.hide("coloured_floor", corner_hz=own * size)


def gain(build: Build, size: float) -> None:
    """All channels, or one of several, off by `size` dB up or down; by 9.80665 at the largest size."""
    factor = 9.80665 if size >= 19.0 else 10 ** (size / 20)
    factor = 1 / factor if build.rng.random() < 0.5 else factor
    count = len(build.rig.channels)
    one = int(build.rng.integers(count)) if count > 1 and size < 19.0 and build.rng.random() < 0.5 else -1

    def scale(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:  # noqa: ARG001
        rows = slice(None) if one < 0 else slice(one, one + 1)
        data[rows] *= factor
        return data

    build.digital.append(scale)
    build.hide("unit_or_gain_error", factor=factor)


def sensor_resonance(build: Build, size: float) -> None:
    """A sensor loosely mounted: amplified `size`-fold at a resonance within the band."""
    # A bearing rig shakes up to some kHz only: a probe held by hand. Gearboxes: a sensor on a magnet.
    band = (1000.0, 2600.0) if build.rig.name == "bearing" else (2000.0, 5900.0)
    at = build.log_uniform(*band)

    def mounted(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:  # noqa: ARG001
        spectrum = np.fft.rfft(data, axis=1)
        ratio = np.fft.rfftfreq(data.shape[1], 1 / rate_hz) / at
        spectrum /= 1 - ratio**2 + 1j * ratio / size
        return np.asarray(np.fft.irfft(spectrum, data.shape[1], axis=1))

    build.analogue.append(mounted)
    build.hide("sensor_resonance", resonance_hz=at, q=size)
