"""Roll-off of a sensor and its conditioner: a second-order low-pass with state.

The magnitude is that of a Butterworth filter of order 2 (no resonance, -3 dB at the bandwidth), made
digital by the bilinear transform with the corner held in place. A bandwidth above 0.49 of the sample rate
cannot be told from no roll-off at all and is left out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.sensors.biquad import Section, Sections

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

_HIGHEST = 0.49


def lowpass(bandwidth_hz: float, sample_rate_hz: float) -> Section:
    """Coefficients (b0, b1, b2, a1, a2) of the low-pass, a0 = 1."""
    k = math.tan(math.pi * bandwidth_hz / sample_rate_hz)
    norm = 1.0 / (1.0 + math.sqrt(2.0) * k + k * k)
    b0 = k * k * norm
    return b0, 2 * b0, b0, 2 * (k * k - 1) * norm, (1 - math.sqrt(2.0) * k + k * k) * norm


class Rolloff:
    """The low-pass of every channel that has one; works in place, sample by sample."""

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float) -> None:
        self._sections = Sections(
            [
                (channel, lowpass(row.bandwidth_hz, sample_rate_hz))
                for channel, row in enumerate(rows)
                if row.bandwidth_hz is not None and row.bandwidth_hz < _HIGHEST * sample_rate_hz
            ]
        )

    @property
    def active(self) -> bool:
        """False if no channel has a roll-off."""
        return len(self._sections) > 0

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Filter `block` (channels, samples), which continues the block before."""
        self._sections.apply(block)
