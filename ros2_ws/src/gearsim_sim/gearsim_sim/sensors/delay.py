"""Delay of a measuring chain, also by a fraction of a sample.

The fraction is made by a 32-point sinc under a Kaiser window. Up to 0.4 of the sample rate it errs by less
than 2e-4 of the signal; above, the signal should hold little anyway (roll-off, decimation filter).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

_HALF = 16
_BETA = 8.0


def taps(fraction: float) -> NDArray[np.float64]:
    """Weights of the samples n-15 .. n+16 that give the signal at n + 1 - fraction, 0 < fraction < 1."""
    position = np.arange(-_HALF + 1, _HALF + 1) - (1.0 - fraction)
    window = np.i0(_BETA * np.sqrt(np.maximum(0.0, 1.0 - (position / _HALF) ** 2))) / np.i0(_BETA)
    weights = np.sinc(position) * window
    return np.asarray(weights / weights.sum())


class Delay:
    """Reads each channel later by its delay out of a window that reaches `past` back and `ahead` forward."""

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float) -> None:
        self._plans = [_plan(row.delay_s * sample_rate_hz) for row in rows]
        self.past = max((whole + _HALF for whole, _ in self._plans), default=0) if self._delayed else 0
        self.ahead = _HALF if any(weights is not None for _, weights in self._plans) else 0

    @property
    def _delayed(self) -> bool:
        return any(whole or weights is not None for whole, weights in self._plans)

    def read(self, window: NDArray[np.float64], count: int) -> NDArray[np.float64]:
        """The `count` delayed samples; `window` is (channels, past + count + ahead)."""
        block = np.empty((len(self._plans), count))
        for channel, (whole, weights) in enumerate(self._plans):
            signal = window[channel]
            start = self.past - whole
            if weights is None:
                block[channel] = signal[start : start + count]
                continue
            block[channel] = 0.0
            # Sample n is the signal at n - whole - fraction, between n - whole - 1 and n - whole.
            for tap, weight in enumerate(weights):
                at = start - _HALF + tap
                block[channel] += weight * signal[at : at + count]
        return block


def _plan(delay_samples: float) -> tuple[int, NDArray[np.float64] | None]:
    whole = math.floor(delay_samples)
    fraction = delay_samples - whole
    if fraction < 1e-6 or fraction > 1 - 1e-6:
        return round(delay_samples), None
    return whole, taps(fraction)
