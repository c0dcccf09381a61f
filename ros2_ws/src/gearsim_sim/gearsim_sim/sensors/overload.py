"""Overload of a charge amplifier: beyond its range charge leaks away, and the zero is off for a while.

While the output is at its limit R, the excess drives a leakage (protection diodes, a saturated stage):
with x the input, d the shift of the zero and e = (x - d) - clip(x - d, R) the excess,
d' = e / leak - d / recovery, and the output is clip(x - d, R). After an overload in one direction the zero
lies off in the other and comes back exponentially.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

_SHORTEST = 4.0  # samples of the leakage's time constant


class Overload(Strict):
    """Time constants of the leakage during an overload, and of the recovery after it."""

    leak: Annotated[float, Si("s", gt=0, le=10)] = 2e-3
    """Time constant with which charge leaks away during an overload (assumed: 2 ms)."""
    recovery: Annotated[float, Si("s", gt=0, le=100)] = 50e-3
    """Time constant with which the zero comes back after it (assumed: 50 ms)."""


class OverloadRecovery:
    """Clipping and recovery of every channel that has them.

    Raises
    ------
    InputError
        Overload without a range, or a time constant that the rate cannot follow.
    """

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float) -> None:
        chosen = []
        for channel, row in enumerate(rows):
            if row.overload is None:
                continue
            where = f"sensor {row.channel}"
            if row.full_scale is None:
                raise InputError(where, "overload", "overload without a range", "a range, or overload: off")
            for name in ("leak", "recovery"):
                value = getattr(row.overload, name)
                if value * sample_rate_hz < _SHORTEST:
                    expected = f"at least {_SHORTEST:g} samples, {_SHORTEST / sample_rate_hz:.3g} s"
                    raise InputError(where, f"overload.{name}", value, expected)
            leak = 1.0 / (row.overload.leak * sample_rate_hz)
            keep = math.exp(-1.0 / (row.overload.recovery * sample_rate_hz))
            chosen.append((channel, row.full_scale, leak, keep))
        self._rows = np.array([c[0] for c in chosen], dtype=np.int64)
        self._numbers = np.array([c[1:] for c in chosen], dtype=np.float64).reshape(-1, 3)
        self._shift = np.zeros(len(chosen))

    @property
    def active(self) -> bool:
        """False if no channel remembers an overload."""
        return self._rows.size > 0

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Limit `block` (channels, samples), which continues the block before."""
        from gearsim_sim.sensors.loops import limit_rows

        limit_rows(block, self._rows, self._numbers, self._shift)
