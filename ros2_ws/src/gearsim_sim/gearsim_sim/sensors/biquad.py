"""Filters of second order in a row, sample by sample with state: the analogue part of a measuring chain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Section = tuple[float, float, float, float, float]  # b0, b1, b2, a1, a2 with a0 = 1


class Sections:
    """Second-order sections on some rows of a block, in place; a row may pass several, in their order.

    Parameters
    ----------
    chosen : sequence of (row, section)
        A section with b2 = a2 = 0 is of first order.
    """

    def __init__(self, chosen: Sequence[tuple[int, Section]]) -> None:
        self._rows = np.array([row for row, _ in chosen], dtype=np.int64)
        self._coefficients = np.array([section for _, section in chosen], dtype=np.float64).reshape(-1, 5)
        self.state = np.zeros((len(chosen), 2))

    def __len__(self) -> int:
        return int(self._rows.size)

    def apply(self, block: Array) -> None:
        """Filter `block` (rows, samples), which continues the block before."""
        from gearsim_sim.sensors.loops import filter_rows

        filter_rows(block, self._rows, self._coefficients, self.state)
