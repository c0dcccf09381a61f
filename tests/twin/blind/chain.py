"""The measuring chain of the generator: anti-alias filter, noise, gain, converter, tacho."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import firwin, upfirdn

from blind.build import Build
from blind.draws import coloured

Array = NDArray[np.float64]
_TAPS = 96  # of the filter per sample of the output
_BITS = 24
_HEADROOM = 4.0


def sampled(accel: Array, factor: int, filtered: bool) -> Array:
    """Every `factor`-th value, behind a linear-phase filter (or none) that is shut at half the new rate."""
    if not filtered:
        return np.ascontiguousarray(accel[:, ::factor])
    half = _TAPS * factor // 2
    taps = firwin(2 * half + 1, 0.97 / factor, window=("kaiser", 9.0))
    rows = [upfirdn(taps, row)[half : half + row.size : factor] for row in accel]
    return np.array(rows)


def measured(
    build: Build, accel: Array, rng: np.random.Generator, noise: np.random.Generator, gains: Array
) -> NDArray[np.float32]:
    """What the converter gives, (channels, samples); `noise` are the sensors' own random numbers."""
    rig = build.rig
    data = sampled(accel, rig.steps, build.filtered) * gains[:, None]
    for effect in build.analogue:
        data = effect(data, rig.rate_hz, rng)
    for row, density in zip(data, rig.noise, strict=True):
        slope, corner = noise.uniform(0.6, 1.4), noise.uniform(5.0, 30.0)
        row += build.noise * density * coloured(row.size, slope, corner, rig.rate_hz, noise)
    step = _HEADROOM * np.max(np.abs(data), axis=1, keepdims=True) / 2 ** (_BITS - 1)
    data = np.round(data / step) * step
    for effect in build.digital:
        data = effect(data, rig.rate_hz, rng)
    return data.astype(np.float32)


def pulses(turns: Array, per_turn: float, jitter: float, rng: np.random.Generator) -> Array:
    """Sample indices at which a tacho of an unknown place fires; `turns` at each sample."""
    angle = turns * per_turn + rng.uniform(0.0, 1.0)
    whole = np.arange(np.ceil(angle[0]), np.floor(angle[-1]) + 1)
    place = np.interp(whole, angle, np.arange(angle.size))
    place += jitter * rng.standard_normal(place.size)
    return np.sort(place[(place >= 0) & (place <= angle.size - 1)])
