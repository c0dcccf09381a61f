"""Prior knowledge of a parameter, and the coordinate in which it is fitted.

Every prior maps its parameter monotonously to a coordinate u that is standard normal before anything is
measured. A fit then works on numbers of one size, stays within the bounds by construction, and its evidence
has a closed form (see `evidence`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

from scipy.special import ndtr, ndtri

# Coordinates beyond this many standard deviations are not used: the bounds of a prior lie there.
FURTHEST = 4.0
_TAIL = float(ndtr(-FURTHEST))


class Prior(Protocol):
    """What is known of a parameter before the measurement."""

    @property
    def low(self) -> float:
        """Smallest value that makes sense."""

    @property
    def high(self) -> float:
        """Greatest value that makes sense."""

    def coordinate(self, value: float) -> float:
        """The standard normal coordinate of a value; values beyond the bounds count as the bound."""

    def value(self, coordinate: float) -> float:
        """The value at a coordinate, within the bounds."""


def _held(value: float, low: float, high: float) -> float:
    return min(max(value, low), high)


@dataclass(frozen=True, slots=True)
class Normal:
    """A value known as `mean` with the standard deviation `std`, within `low` and `high`."""

    mean: float
    std: float
    low: float = -math.inf
    high: float = math.inf

    def coordinate(self, value: float) -> float:
        """The standard normal coordinate of a value."""
        return _held((_held(value, self.low, self.high) - self.mean) / self.std, -FURTHEST, FURTHEST)

    def value(self, coordinate: float) -> float:
        """The value at a coordinate, within the bounds."""
        return _held(self.mean + self.std * coordinate, self.low, self.high)


@dataclass(frozen=True, slots=True)
class LogNormal:
    """A positive value known within a factor: its logarithm is normal.

    Two thirds of the values are within `median / factor` and `median * factor`.
    """

    median: float
    factor: float
    low: float = 0.0
    high: float = math.inf

    def coordinate(self, value: float) -> float:
        """The standard normal coordinate of a value."""
        least = max(self.low, self.median * self.factor**-FURTHEST)
        held = _held(value, least, self.high)
        return _held(math.log(held / self.median) / math.log(self.factor), -FURTHEST, FURTHEST)

    def value(self, coordinate: float) -> float:
        """The value at a coordinate, within the bounds."""
        return _held(self.median * self.factor**coordinate, self.low, self.high)


@dataclass(frozen=True, slots=True)
class Uniform:
    """Any value between `low` and `high` alike; angles that may turn on have the whole turn as bounds."""

    low: float
    high: float

    def coordinate(self, value: float) -> float:
        """The standard normal coordinate of a value."""
        share = _held((value - self.low) / (self.high - self.low), _TAIL, 1.0 - _TAIL)
        return float(ndtri(share))

    def value(self, coordinate: float) -> float:
        """The value at a coordinate, within the bounds."""
        return self.low + (self.high - self.low) * float(ndtr(coordinate))
