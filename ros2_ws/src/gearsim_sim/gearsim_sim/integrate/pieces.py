"""Small compiled pieces that the loops of several models share: angles, ramps, table look-up."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import inlined

Array = NDArray[np.float64]
_CIRCLE_POINTS = 256
DEGREE = 7  # of polynomials; lower ones are filled up with zeros


def circle_table() -> Array:
    """Cosines and sines at 256 points of a circle, for `cosine_sine`."""
    angle = 2 * np.pi * np.arange(_CIRCLE_POINTS) / _CIRCLE_POINTS
    return np.concatenate([np.cos(angle), np.sin(angle)])


@inlined
def cosine_sine(turns: float, circle: Array) -> tuple[float, float]:
    """Cosine and sine of an angle in turns, to rounding, from the nearest point of the circle's table."""
    scaled = turns * 256.0
    nearest = math.floor(scaled + 0.5)
    x = (scaled - nearest) * (2.0 * math.pi / 256.0)
    i = int(nearest) & 255
    square = x * x
    small_cos = 1.0 - square * (0.5 - square * (1.0 / 24.0 - square * (1.0 / 720.0)))
    small_sin = x * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0 - square * (1.0 / 5040.0))))
    c, s = circle[i], circle[256 + i]
    return c * small_cos - s * small_sin, s * small_cos + c * small_sin


@inlined
def table_value(turns: float, tables: Array, offset: int, points: int) -> tuple[float, float]:
    """Value and slope per turn of a tabled periodic function, turns >= 0.

    The table, as `PeriodicSeries.table` makes it for `points` intervals, begins at `offset` of `tables`.
    """
    scaled = (turns - np.floor(turns)) * points
    i = min(int(scaled), points - 1)
    t = scaled - i
    at = offset + 2 * i
    v0, d0, v1, d1 = tables[at], tables[at + 1], tables[at + 2], tables[at + 3]
    rise = v1 - v0
    a = d0 - rise
    b = rise - d1
    u = 1.0 - t
    value = u * v0 + t * v1 + t * u * (a * u + b * t)
    slope = rise + (1.0 - 2.0 * t) * (a * u + b * t) + t * u * (b - a)
    return value, slope * points


def plain_polynomial(u: float, coefficients: Array) -> tuple[float, float, float]:
    """Value and first two derivatives of sum(coefficients[i] u^i), which has DEGREE + 1 coefficients."""
    value = 0.0
    first = 0.0
    second = 0.0
    for k in range(DEGREE + 1):
        second = second * u + first
        first = first * u + value
        value = value * u + coefficients[DEGREE - k]
    return value, first, 2.0 * second


def plain_ramp(step: float, steps: float) -> tuple[float, float, float]:
    """A smooth rise from 0 to 1 over `steps`: its value, its slope and its integral, in steps.

    The polynomial 10 u^3 - 15 u^4 + 6 u^5 has no jump of slope or curvature at either end.
    """
    if steps <= 0.0 or step >= steps:
        return 1.0, 0.0, step - 0.5 * steps
    u = max(step, 0.0) / steps
    value = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
    slope = 30.0 * u * u * (1.0 - u) * (1.0 - u) / steps
    integral = u * u * u * u * (2.5 - u * (3.0 - u)) * steps
    return value, slope, integral


ramp = inlined(plain_ramp)
polynomial = inlined(plain_polynomial)
