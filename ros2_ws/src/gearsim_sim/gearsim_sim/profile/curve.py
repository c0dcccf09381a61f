"""Smooth functions of the step index as polynomials, stretch by stretch.

A curve answers for any step with the stretch that covers it. What it answers depends on the step alone,
never on what was asked before, so a run is the same bit for bit however it is split.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.polynomial import polynomial
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Curves without end are answered in stretches of this length, at fixed places.
GRID_STEPS = 1 << 16


@dataclass(frozen=True, slots=True)
class Stretch:
    """sum of c_k u^k with u = (step - start) / length, for start <= step < start + length.

    `start` and `length` are in steps and need not be whole: the knots of a measured trace lie anywhere.
    """

    start: float
    length: float
    coefficients: tuple[float, ...]

    @property
    def end(self) -> float:
        """Where the next stretch begins."""
        return self.start + self.length

    def value(self, step: float) -> float:
        """The polynomial at a step."""
        u = (step - self.start) / self.length
        result = 0.0
        for c in reversed(self.coefficients):
            result = result * u + c
        return result

    def slope(self, step: float) -> float:
        """Its change per step."""
        u = (step - self.start) / self.length
        result = 0.0
        for k in range(len(self.coefficients) - 1, 0, -1):
            result = result * u + k * self.coefficients[k]
        return result / self.length

    def cut(self, start: float, length: float, size: int) -> Array:
        """The same polynomial in u = (step - start) / length, as `size` coefficients."""
        result = np.zeros(size)
        at, scale = (start - self.start) / self.length, length / self.length
        for j in range(len(self.coefficients)):
            total = 0.0
            for k in range(len(self.coefficients) - 1, j - 1, -1):
                total = total * at + math.comb(k, j) * self.coefficients[k]
            result[j] = total * scale**j
        return result

    def extremes(self) -> tuple[float, float]:
        """Least and greatest value within the stretch."""
        slope = polynomial.polyder(np.array(self.coefficients))
        slope = np.trim_zeros(slope, "b")
        roots = polynomial.polyroots(slope) if slope.size > 1 else np.zeros(0)
        inside = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0) & (roots.real < 1)]
        values = polynomial.polyval(np.concatenate([[0.0, 1.0], inside]), self.coefficients)
        return float(values.min()), float(values.max())


class Curve(Protocol):
    """A function of the step."""

    def stretch(self, step: int) -> Stretch:
        """The stretch with start <= step < end."""
        ...

    def final_value(self) -> float:
        """What it comes to in the end, as far as it is known beforehand."""
        ...


def grid_cell(step: int) -> tuple[float, float]:
    """Start and length of the stretch of the fixed grid that covers a step."""
    return float(step // GRID_STEPS * GRID_STEPS), float(GRID_STEPS)


@dataclass(frozen=True, slots=True)
class Constant:
    """The same value always."""

    level: float

    def stretch(self, step: int) -> Stretch:
        """The stretch that covers `step`."""
        start, length = grid_cell(step)
        return Stretch(start, length, (self.level,))

    def final_value(self) -> float:
        """The value."""
        return self.level


class Laid:
    """Stretches one behind the other, a constant before the first and after the last."""

    def __init__(self, stretches: Sequence[Stretch], before: float, after: float) -> None:
        """`stretches` ascending and without gaps; `before` and `after` are the constants at the ends."""
        self.stretches = tuple(stretches)
        self._starts = [one.start for one in self.stretches]
        self._before, self._after = Constant(before), Constant(after)

    def stretch(self, step: int) -> Stretch:
        """The stretch that covers `step`."""
        i = bisect_right(self._starts, step) - 1
        if i < 0:
            return _clipped(self._before.stretch(step), -math.inf, self._starts[0])
        last = self.stretches[i]
        if step >= last.end:
            return _clipped(self._after.stretch(step), last.end, math.inf)
        return last

    def final_value(self) -> float:
        """The value after the last stretch."""
        return self._after.level


def _clipped(constant: Stretch, low: float, high: float) -> Stretch:
    start = max(constant.start, low)
    return Stretch(start, min(constant.end, high) - start, constant.coefficients)


def ramp_stretch(
    start: float, length: float, from_value: float, to_value: float, slope_per_step: float = 0.0
) -> Stretch:
    """From one value to another, with slope `slope_per_step` at the start and none at the end.

    10 u^3 - 15 u^4 + 6 u^5 has no slope and no curvature at either end; u - 6 u^3 + 8 u^4 - 3 u^5 has the
    slope 1 at the start and is else zero there and at the end in value, slope and curvature.
    """
    rise, fade = to_value - from_value, slope_per_step * length
    return Stretch(
        start,
        length,
        (from_value, fade, 0.0, 10 * rise - 6 * fade, -15 * rise + 8 * fade, 6 * rise - 3 * fade),
    )


def ramp_from(curve: Curve, step: int, to_value: float, ramp_steps: float) -> Laid:
    """A ramp that takes over from `curve` at a step with the value and the slope that it finds there."""
    now = curve.stretch(step)
    value, slope = now.value(float(step)), now.slope(float(step))
    return Laid([ramp_stretch(float(step), ramp_steps, value, to_value, slope)], value, to_value)


def hermite_stretch(start: float, length: float, first: Sequence[float], last: Sequence[float]) -> Stretch:
    """Of degree 5 through value, slope and curvature (per step) at both ends."""
    value, slope, half = first[0], first[1] * length, 0.5 * first[2] * length**2
    rise = last[0] - value - slope - half
    bend = last[1] * length - slope - 2 * half
    turn = 0.5 * last[2] * length**2 - half
    return Stretch(
        start,
        length,
        (
            value,
            slope,
            half,
            10 * rise - 4 * bend + turn,
            -15 * rise + 7 * bend - 2 * turn,
            6 * rise - 3 * bend + turn,
        ),
    )


# Points of Chebyshev's second kind: a polynomial through them comes near the best one.
_CHEBYSHEV = 0.5 - 0.5 * np.cos(np.pi * np.arange(6) / 5)


@lru_cache(maxsize=1)
def _from_chebyshev() -> Array:
    return np.asarray(np.linalg.inv(np.vander(_CHEBYSHEV, increasing=True)))


def fitted_stretch(start: float, length: float, values: Array) -> Stretch:
    """Of degree 5 through the values at `chebyshev_steps(start, length)`; both ends are met."""
    coefficients = _from_chebyshev() @ values
    return Stretch(start, length, tuple(coefficients.tolist()))


def chebyshev_steps(start: float, length: float) -> Array:
    """The six steps that `fitted_stretch` takes values at, both ends among them."""
    return start + length * _CHEBYSHEV


def stretches_between(curve: Curve, first: int, last: int) -> Iterator[Stretch]:
    """All stretches of a curve from a step to another."""
    step = first
    while step < last:
        one = curve.stretch(step)
        yield one
        step = max(step + 1, math.ceil(one.end))
