"""Effects that no cause of the judge has: it must say that it does not know, and at what frequency."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from blind.build import Build
from blind.draws import low_noise

Array = NDArray[np.float64]
_WHIRLING = {"parallel": ("x_s3", "y_s3"), "bearing": ("x_s", "y_s"), "planetary": ("x_s", "y_s")}


def _shafts_lines(build: Build) -> Array:
    """Orders of teeth and shafts, which a strange line must keep away from."""
    orders = {"parallel": 32.0, "bearing": 3.25, "planetary": 80.0}[build.rig.name]
    return np.outer(np.arange(1, 60), [1.0, orders]).ravel() * build.speed_hz


def neighbour(build: Build, size: float) -> None:
    """Tones of another machine: a family of eight multiples, each slowly swelling; `size` [m/s^2]."""
    lines = _shafts_lines(build)
    for _ in range(200):
        base = float(build.rng.uniform(63.0, 240.0))
        if np.min(np.abs(lines - base)) > 0.25 * min(build.speed_hz, 6.0) and base % 50 > 2 and base % 60 > 2:
            break
    heights = size * build.rng.uniform(0.3, 1.0, 8) / np.arange(1, 9) ** 0.5
    heights[0] = size
    shares = build.rng.uniform(0.5, 1.0, (len(build.rig.channels), 1))

    def tones(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        t = np.arange(data.shape[1]) / rate_hz
        wave = np.zeros(t.size)
        for k, height in enumerate(heights, 1):
            swell = 1 + 0.05 * low_noise(t.size, rate_hz, 0.5, rng)
            wave += height * swell * np.cos(2 * math.pi * k * base * t + rng.uniform(0, 2 * math.pi))
        return np.asarray(data + shares * wave)

    build.analogue.append(tones)
    build.hide("unknown", (base,))
    build.truths[-1]["what"] = "neighbour_tones"


def oil_whirl(build: Build, size: float) -> None:
    """A force of `size` newtons that goes round with 0.43 times the shaft."""
    order = 0.43 + 0.01 * float(build.rng.standard_normal())
    start = build.rng.uniform(0, 1)
    x, y = _WHIRLING[build.rig.name]
    for name, lead in ((x, 0.0), (y, 0.25)):

        def force(seconds: Array, turns: Array, rng: np.random.Generator, lead: float = lead) -> Array:  # noqa: ARG001
            return np.asarray(size * np.cos(2 * math.pi * (order * turns + start - lead)))

        build.forces.append(({name: 1.0}, force))
    build.hide("unknown", (order * build.speed_hz,))
    build.truths[-1]["what"] = "oil_whirl"


def drifting_resonance(build: Build, size: float) -> None:
    """A resonance of the mounting whose frequency falls by a sixth in each record, `size` of the signal."""
    at, q = build.log_uniform(0.1, 0.3) * build.rig.rate_hz, 25.0

    def ring(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        blocks = 64
        t = np.arange(data.shape[1])
        out = np.array(data)
        noise = data.std(axis=1, keepdims=True) * rng.standard_normal(data.shape)
        spectrum, f = np.fft.rfft(noise, axis=1), np.fft.rfftfreq(data.shape[1], 1 / rate_hz)
        width = data.shape[1] / blocks
        for k in range(blocks):
            ratio = f / (at * (1 + 0.08 - 0.16 * (k + 0.5) / blocks))
            rung = np.fft.irfft(spectrum / (1 - ratio**2 + 1j * ratio / q), data.shape[1], axis=1)
            window = np.clip(1.0 - np.abs(t / width - k - 0.5), 0.0, 1.0)
            out += size * (rung - noise) * window
        return out

    build.analogue.append(ring)
    build.hide("unknown", (at,))
    build.truths[-1]["what"] = "drifting_resonance"


def rub(build: Build, size: float) -> None:
    """A seal that rubs once a turn, in some stretches of time only: impacts of `size` newtons."""
    name = _WHIRLING[build.rig.name][1]
    width_s, angle = 2.5e-4, build.rng.uniform(0, 1)

    def knocks(seconds: Array, turns: Array, rng: np.random.Generator) -> Array:  # noqa: ARG001
        since = (turns - angle - np.floor(turns - angle)) / build.speed_hz
        pulse = np.where(since < width_s, np.sin(math.pi * since / width_s), 0.0)
        # On for some third of the time, in stretches of one to three turns.
        stretch = np.floor((turns - angle) / 2.0).astype(np.int64)
        on = (stretch * 2654435761 % 4294967296) / 4294967296 < 0.35
        return np.asarray(size * pulse * on)

    build.forces.append(({name: 1.0}, knocks))
    build.hide("unknown", (build.speed_hz,))
    build.truths[-1]["what"] = "intermittent_rub"


def no_filter(build: Build, size: float) -> None:
    """No anti-alias filter: what lies beyond half the rate is folded; a tone of `size` [m/s^2] among it."""
    build.filtered = False
    rate = build.rig.rate_hz
    true = float(build.rng.uniform(0.62, 0.9)) * rate
    image = rate - true

    def tone(data: Array, rate_hz: float, rng: np.random.Generator) -> Array:
        t = np.arange(data.shape[1]) / rate_hz
        return np.asarray(data + size * np.cos(2 * math.pi * true * t + rng.uniform(0, 2 * math.pi)))

    build.analogue.append(tone)
    build.hide("unknown", (image, true))
    build.truths[-1]["what"] = "missing_antialias"
