"""Small compiled pieces that the loops of several models share: angles, ramps, table look-up."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import inlined

Array = NDArray[np.float64]
_CIRCLE_POINTS = 256


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
def table_value(turns: float, table: Array) -> tuple[float, float]:
    """Value and slope per turn of a tabled periodic function (`PeriodicSeries.table`), turns >= 0."""
    points = table.size // 2 - 1
    scaled = (turns - math.floor(turns)) * points
    i = min(int(scaled), points - 1)
    t = scaled - i
    v0, d0, v1, d1 = table[2 * i], table[2 * i + 1], table[2 * i + 2], table[2 * i + 3]
    rise = v1 - v0
    a = d0 - rise
    b = rise - d1
    u = 1.0 - t
    value = u * v0 + t * v1 + t * u * (a * u + b * t)
    slope = rise + (1.0 - 2.0 * t) * (a * u + b * t) + t * u * (b - a)
    return value, slope * points


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


def plain_fading_slope(step: float, steps: float) -> tuple[float, float, float]:
    """What a slope of 1 per step at the start adds to a `ramp`: value, slope and integral, in steps.

    u - 6 u^3 + 8 u^4 - 3 u^5 has this slope at 0, and neither value, slope nor curvature at 1: a ramp
    that begins during another one goes on with the acceleration that it finds.
    """
    if steps <= 0.0:
        return 0.0, 0.0, 0.0
    u = min(max(step / steps, 0.0), 1.0)
    value = u * (1.0 - u) * (1.0 - u) * (1.0 - u) * (1.0 + 3.0 * u) * steps
    slope = (1.0 - u) * (1.0 - u) * (1.0 + 2.0 * u - 15.0 * u * u)
    integral = u * u * (0.5 - u * u * (1.5 - u * (1.6 - 0.5 * u))) * steps * steps
    return value, slope, integral


ramp = inlined(plain_ramp)
fading_slope = inlined(plain_fading_slope)
