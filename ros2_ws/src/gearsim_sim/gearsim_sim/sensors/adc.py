"""Range and word length of the analogue-to-digital converter.

A converter of B bits and range R has 2^B codes of width 2 R / 2^B, from -R to R less one code; a value
becomes the nearest code, and what lies outside becomes the outermost one (clipping).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row


class Converter:
    """Clipping and rounding of all channels, in place; a channel without range is left as it is."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._settings = [
            (channel, row.full_scale, row.adc_bits)
            for channel, row in enumerate(rows)
            if row.full_scale is not None
        ]

    @property
    def active(self) -> bool:
        """False if no channel has a range."""
        return bool(self._settings)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Convert `block` (channels, samples) to the values that the codes stand for."""
        for channel, full_scale, bits in self._settings:
            signal = block[channel]
            if bits is None:
                np.clip(signal, -full_scale, full_scale, out=signal)
                continue
            half = 2.0 ** (bits - 1)
            step = full_scale / half
            signal *= 1.0 / step
            np.rint(signal, out=signal)
            np.clip(signal, -half, half - 1.0, out=signal)
            signal *= step
