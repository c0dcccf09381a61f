"""Slow courses in time: bounded random wandering and warming up, on knots joined by straight lines.

Drifts last seconds to hours, so one number per sample would be a waste. The knots lie at fixed places of
the stream, a power of two apart and at least 32 to a time constant; so the chunk size changes no bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.random import Philox
from numpy.typing import NDArray

from gearsim_sim.sensors.draws import normal

Array = NDArray[np.float64]
_KNOTS_PER_TIME = 32
_WIDEST = 1 << 16


def knot_spacing(time_s: float, sample_rate_hz: float) -> int:
    """Samples between knots for a course with that time constant."""
    most = time_s * sample_rate_hz / _KNOTS_PER_TIME
    return int(min(_WIDEST, 2 ** max(0, math.floor(math.log2(max(1.0, most))))))


class Course:
    """A function of time that is read forward.

    Parameters
    ----------
    spacing : int
        Samples between knots.
    following : callable
        `following(first, count)`: values at the knots first, first + 1, ...; asked for in order, once.
    """

    def __init__(self, spacing: int, following: Callable[[int, int], Array]) -> None:
        self._spacing = spacing
        self._following = following
        self._first = 0
        self._values = following(0, 1)

    def read(self, first_sample: int, count: int) -> Array:
        """Values at so many samples; the stretches of consecutive calls must follow each other."""
        spacing = self._spacing
        begin, end = first_sample // spacing, (first_sample + count - 1) // spacing + 1
        have = self._first + self._values.size
        if end >= have:
            more = self._following(have, end + 1 - have)
            self._values = np.concatenate([self._values, more])
        if begin > self._first:
            self._values = self._values[begin - self._first :]
            self._first = begin
        place = np.arange(first_sample - begin * spacing, first_sample - begin * spacing + count)
        knot = place // spacing
        part = (place - knot * spacing) / spacing
        left = self._values[knot]
        return np.asarray(left + (self._values[knot + 1] - left) * part)


def wander(rms: float, time_s: float, sample_rate_hz: float, source: Philox) -> Course:
    """Stationary random wandering (Ornstein-Uhlenbeck) of zero mean.

    Its one-sided power spectral density is 4 rms^2 T / (1 + (2 pi f T)^2) below the rate of the knots
    (Uhlenbeck and Ornstein 1930), its correlation over a time t is exp(-t / T).
    """
    spacing = knot_spacing(time_s, sample_rate_hz)
    keep = math.exp(-spacing / (time_s * sample_rate_hz))
    fresh = rms * math.sqrt(1.0 - keep * keep)
    last = 0.0

    def following(first: int, count: int) -> Array:
        nonlocal last
        values = normal(source, count)
        for k in range(count):
            last = rms * values[k] if first + k == 0 else keep * last + fresh * values[k]
            values[k] = last
        return values

    return Course(spacing, following)


def warming(rise: float, time_s: float, sample_rate_hz: float) -> Course:
    """From 0 towards `rise` as 1 - exp(-t / T)."""
    spacing = knot_spacing(time_s, sample_rate_hz)

    def following(first: int, count: int) -> Array:
        times = np.arange(first, first + count) * (spacing / (time_s * sample_rate_hz))
        return np.asarray(rise * -np.expm1(-times))

    return Course(spacing, following)
