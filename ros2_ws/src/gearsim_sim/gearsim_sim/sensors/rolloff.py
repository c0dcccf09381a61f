"""Roll-off of an accelerometer and its conditioner: a second-order low-pass with state.

The magnitude is that of a Butterworth filter of order 2 (no resonance, -3 dB at the bandwidth), made
digital by the bilinear transform with the corner held in place. A bandwidth above 0.49 of the sample rate
cannot be told from no roll-off at all and is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gearsim_sim.sensors.rows import Accelerometer

_HIGHEST = 0.49


def lowpass(bandwidth_hz: float, sample_rate_hz: float) -> tuple[float, float, float, float, float]:
    """Coefficients (b0, b1, b2, a1, a2) of the low-pass, a0 = 1."""
    k = math.tan(math.pi * bandwidth_hz / sample_rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    b0 = k * k * norm
    return b0, 2 * b0, b0, 2 * (k * k - 1) * norm, (1 - math.sqrt(2.0) * k + k * k) * norm


class Rolloff:
    """The low-pass of every channel that has one; works in place, sample by sample."""

    def __init__(self, rows: Sequence[Accelerometer], sample_rate_hz: float) -> None:
        chosen = [
            (channel, lowpass(row.bandwidth_hz, sample_rate_hz))
            for channel, row in enumerate(rows)
            if row.bandwidth_hz is not None and row.bandwidth_hz < _HIGHEST * sample_rate_hz
        ]
        self._channels = np.array([channel for channel, _ in chosen], dtype=np.int64)
        self._coefficients = np.array([c for _, c in chosen], dtype=np.float64).reshape(-1, 5)
        self._state = np.zeros((len(chosen), 2))

    @property
    def active(self) -> bool:
        """False if no channel has a roll-off."""
        return self._channels.size > 0

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Filter `block` (channels, samples), which continues the block before."""
        _filter(block, self._channels, self._coefficients, self._state)


@njit(cache=True, nogil=True)
def _filter(block, channels, coefficients, state):  # type: ignore[no-untyped-def]
    for i in range(channels.size):
        row = block[channels[i]]
        b0, b1, b2, a1, a2 = coefficients[i]
        s0 = state[i, 0]
        s1 = state[i, 1]
        for k in range(row.size):
            x = row[k]
            y = b0 * x + s0
            s0 = b1 * x - a1 * y + s1
            s1 = b2 * x - a2 * y
            row[k] = y
        state[i, 0] = s0
        state[i, 1] = s1
