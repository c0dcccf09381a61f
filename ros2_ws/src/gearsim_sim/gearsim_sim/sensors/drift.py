"""Slow drift of the zero, as of charge amplifiers (leakage, cable, transients) and of strain-gauge bridges.

A fixed offset, and random wandering with a standard deviation and a time constant (see `slow.wander`). An
AC coupling behind it would take it away, so it is added behind the high-pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.draws import generator
from gearsim_sim.sensors.slow import wander

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row

Amplitude = TypeVar("Amplitude")


class Drift(Strict, Generic[Amplitude]):
    """Standard deviation and time constant of the wandering zero."""

    rms: Amplitude
    """Standard deviation of the wandering zero."""
    time: Annotated[float, Si("s", ge=0.05, le=1e6)] = 10.0
    """Time constant of the wandering (assumed: 10 s)."""


class ZeroDrift:
    """Offset and drift of every channel that has them, added in place."""

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float, seed: int) -> None:
        self._offsets = [(channel, row.offset) for channel, row in enumerate(rows) if row.offset != 0.0]
        self._courses = [
            (
                channel,
                wander(
                    row.drift.rms,
                    row.drift.time,
                    sample_rate_hz,
                    generator(seed, f"zero drift/{row.channel}"),
                ),
            )
            for channel, row in enumerate(rows)
            if row.drift is not None and row.drift.rms > 0.0
        ]

    @property
    def active(self) -> bool:
        """False if all zeros stay where they are."""
        return bool(self._offsets or self._courses)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Add the drift to `block` (channels, samples), which continues the block before."""
        for channel, offset in self._offsets:
            block[channel] += offset
        for channel, course in self._courses:
            block[channel] += course.read(first_sample, block.shape[1])
