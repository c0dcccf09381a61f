"""The slow course of an indicator over any length of time, in memory that does not grow.

Values are averaged over blocks; when the blocks are full, neighbours are merged and a block lasts twice as
long, so `CAPACITY` blocks cover an hour as well as a year. The slope is the median of the slopes between all
pairs of blocks (Theil 1950; Sen, J. Am. Stat. Assoc. 63 (1968) 1379-1389), which a few knocks do not move,
with Sen's confidence interval; a trend is told when the interval of 99.9 % leaves out zero.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import theilslopes

__all__ = ["Slope", "TrendHistory"]

_CONFIDENCE = 0.999
_LEAST_BLOCKS = 10
_HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class Slope:
    """Change per hour, with the ends of its 99.9 % interval; NaN where there are too few blocks."""

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan

    @property
    def direction(self) -> str:
        """ "rising", "falling", "steady" or "unknown"."""
        if math.isnan(self.value):
            return "unknown"
        if self.low > 0:
            return "rising"
        return "falling" if self.high < 0 else "steady"


class TrendHistory:
    """Block means of one indicator.

    Parameters
    ----------
    block_s : float
        Length of a first block; longer than the windows that the values are taken of, lest neighbours share
        samples and a trend is seen in their common noise.
    """

    CAPACITY = 96

    def __init__(self, block_s: float) -> None:
        self.block_s = block_s
        self._times: NDArray[np.float64] = np.empty(self.CAPACITY)
        self._means: NDArray[np.float64] = np.empty(self.CAPACITY)
        self._blocks = 0
        self._began_s = 0.0
        self._sum_t = self._sum = 0.0
        self._count = 0

    @property
    def nbytes(self) -> int:
        """Memory of the blocks."""
        return int(self._times.nbytes + self._means.nbytes)

    def add(self, t_s: float, value: float) -> None:
        """Take a value; times ascend. What is not finite is left out."""
        if not math.isfinite(value):
            return
        if self._count and t_s >= self._began_s + self.block_s:
            self._close()
        if not self._count:
            self._began_s = t_s
        self._sum_t += t_s
        self._sum += value
        self._count += 1

    def blocks(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Mean times in seconds and mean values of the blocks that are complete, shape (blocks,) each."""
        return self._times[: self._blocks].copy(), self._means[: self._blocks].copy()

    @property
    def latest(self) -> float:
        """Mean of the block that is filling, or of the last complete one; NaN before any value."""
        if self._count:
            return self._sum / self._count
        return float(self._means[self._blocks - 1]) if self._blocks else math.nan

    @property
    def span_s(self) -> float:
        """Time from the first to the last complete block."""
        return float(self._times[self._blocks - 1] - self._times[0]) if self._blocks > 1 else 0.0

    def slope(self) -> Slope:
        """Median slope per hour over all blocks; NaN with fewer than ten."""
        if self._blocks < _LEAST_BLOCKS:
            return Slope()
        times = (self._times[: self._blocks] - self._times[0]) / _HOUR_S
        found = theilslopes(self._means[: self._blocks], times, alpha=_CONFIDENCE)
        return Slope(float(found.slope), float(found.low_slope), float(found.high_slope))

    def _close(self) -> None:
        if self._blocks == self.CAPACITY:
            half = self.CAPACITY // 2
            self._times[:half] = 0.5 * (self._times[0::2] + self._times[1::2])
            self._means[:half] = 0.5 * (self._means[0::2] + self._means[1::2])
            self._blocks = half
            self.block_s *= 2
            return  # what is filling goes on to the new length
        self._times[self._blocks] = self._sum_t / self._count
        self._means[self._blocks] = self._sum / self._count
        self._blocks += 1
        self._sum_t = self._sum = 0.0
        self._count = 0
