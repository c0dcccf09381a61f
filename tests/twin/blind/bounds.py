"""Bounds for small samples: what a judge that just reaches its target passes 999 times in 1000."""

from __future__ import annotations

from scipy.stats import binom

_PASSED = 0.999


def least_right(count: int, target: float) -> int:
    """The most cases that may be asked to be right, of so many, each right with the probability `target`."""
    return next(k for k in range(count, -1, -1) if binom.sf(k - 1, count, target) >= _PASSED)


def most_wrong(count: int, target: float) -> int:
    """The fewest cases that must be allowed to be wrong, each wrong with the probability `target`."""
    return next(k for k in range(count + 1) if binom.cdf(k, count, target) >= _PASSED)
