"""Synthetic signals with known answers: a local bearing defect as jittered impulses, and what disturbs it.

The model is that of Antoni and Randall (J. Sound Vib. 308 (2007) 246-267): impacts at the fault's angle
with a random walk of the period (slip), amplitudes modulated by the load zone, each ringing a resonance,
in noise.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.signal import fftconvolve

from gearsim_io.nameplate import Bearing, Channel, Machine, Shaft


@dataclass(frozen=True)
class Signal:
    """Samples (1-D), rate, true angle in turns at every sample, moments of the impacts in turns."""

    x: NDArray[np.float64]
    rate_hz: float
    turns: NDArray[np.float64]
    impacts: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def tacho(self) -> NDArray[np.float64]:
        """Once-per-turn pulses as fractional samples."""
        whole = np.arange(np.ceil(self.turns[0]), np.floor(self.turns[-1]) + 1)
        return np.interp(whole, self.turns, np.arange(self.turns.size))


def machine(nominal_hz: float = 25.0, tacho: bool = False, bearings: int = 1) -> Machine:
    """MFPT's geometry; several bearings share it and have a channel each."""
    names = [f"bearing_{k + 1}" for k in range(bearings)]
    channels = [f"ch_{k + 1}" for k in range(bearings)]
    return Machine(
        name="bench",
        description="",
        reference_shaft="shaft",
        shafts=(Shaft("shaft", 1.0, nominal_hz),),
        bearings=tuple(
            Bearing(name, "shaft", 8, 0.235 * 0.0254, 1.245 * 0.0254, 0.0, False, (channel,))
            for name, channel in zip(names, channels, strict=True)
        ),
        channels=tuple(Channel(name) for name in channels),
        tacho_shafts=("shaft",) if tacho else (),
        speed_tolerance=0.02,
    )


def turns_of(speed_hz: float | NDArray[np.float64], seconds: float, rate_hz: float) -> NDArray[np.float64]:
    """Angle at every sample for a constant speed, or speeds spread evenly over the time."""
    n = round(seconds * rate_hz)
    speeds = np.atleast_1d(np.asarray(speed_hz, dtype=np.float64))
    if speeds.size == 1:
        return np.arange(n) / rate_hz * speeds[0]
    speed = np.interp(np.arange(n), np.linspace(0, n - 1, speeds.size), speeds)
    return np.concatenate(([0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1])) / rate_hz))


def defect(
    rng: np.random.Generator,
    turns: NDArray[np.float64],
    rate_hz: float,
    order: float,
    *,
    carrier_order: float = 0.0,
    slip: float = 0.01,
    resonance_hz: float = 3500.0,
    damping: float = 0.05,
) -> Signal:
    """Impulse responses at every 1 / order turns; the resonance's response has unit mean square per impact
    rate.
    """
    count = int((turns[-1] - turns[0]) * order)
    steps = (1 + slip * rng.standard_normal(count)) / order
    at = turns[0] + rng.uniform(0, 1 / order) + np.cumsum(steps)
    at = at[at < turns[-1]]
    amplitude = 1 + 0.1 * rng.standard_normal(at.size)
    if carrier_order > 0:
        amplitude *= np.maximum(0.0, np.cos(2 * np.pi * carrier_order * at)) ** 1.5 + 0.05
    train = np.zeros(turns.size)
    position = np.interp(at, turns, np.arange(turns.size))
    left = position.astype(int)
    share = position - left
    np.add.at(train, left, amplitude * (1 - share))
    np.add.at(train, np.minimum(left + 1, turns.size - 1), amplitude * share)
    t = np.arange(int(0.02 * rate_hz)) / rate_hz
    omega = 2 * np.pi * resonance_hz
    response = np.exp(-damping * omega * t) * np.sin(omega * t)
    x = fftconvolve(train, response)[: turns.size]
    x /= np.sqrt(np.mean(x**2))
    return Signal(x, rate_hz, turns, at)


def noise(rng: np.random.Generator, n: int, colour: float = 0.0) -> NDArray[np.float64]:
    """Gaussian noise of unit mean square, first-order autoregressive with the coefficient `colour`."""
    from scipy.signal import lfilter

    x = rng.standard_normal(n + 500)
    if colour:
        x = lfilter([1.0], [1.0, -colour], x)
    x = x[500:]
    return np.asarray(x / np.sqrt(np.mean(x**2)))


def rotating_lines(turns: NDArray[np.float64], orders: dict[float, float]) -> NDArray[np.float64]:
    """Sum of cosines amplitude * cos(2 pi order turns)."""
    return np.sum([a * np.cos(2 * np.pi * o * turns) for o, a in orders.items()], axis=0)
