"""Dropouts: a loose cable, a worn slip ring, a telemetry link that loses its carrier.

Bursts come at random (Poisson: the time from the end of one to the start of the next is exponential with the
mean 1 / rate) and last exponentially distributed times with the given mean. Meanwhile the channel gives
zero, holds its last value, or lies at the end of its range.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, Strict
from gearsim_sim.sensors.draws import generator, uniform

if TYPE_CHECKING:
    from gearsim_sim.sensors.rows import Row


class Dropouts(Strict):
    """How often the signal is lost, for how long on average, and what the channel shows then."""

    rate: Annotated[float, Si("Hz", gt=0, le=1000)]
    """Bursts per second: one over the mean time from the end of one to the start of the next."""
    duration: Annotated[float, Si("s", gt=0, le=100)] = 5e-3
    """Mean length of a burst (assumed: 5 ms)."""
    shows: Literal["zero", "hold", "rail"] = "zero"
    """What the channel gives meanwhile: zero, its last value, or the end of its range."""


class _Line:
    """The bursts of one channel, in samples."""

    def __init__(self, row: Row, settings: Dropouts, rate_hz: float, seed: int) -> None:
        self._gap = rate_hz / settings.rate
        self._length = settings.duration * rate_hz
        self._source = generator(seed, f"dropouts/{row.channel}")
        self._end = 0.0
        self._next()
        self._shows = settings.shows
        self._level = 0.0 if row.full_scale is None else row.full_scale
        self._last = 0.0

    def _next(self) -> None:
        gap, length = -np.log(uniform(self._source, 2))
        self._start = self._end + float(gap) * self._gap
        self._end = self._start + float(length) * self._length

    def apply(self, signal: NDArray[np.float64], first_sample: int) -> None:
        stop = first_sample + signal.size
        while True:
            begin, end = math.ceil(self._start), math.ceil(self._end)
            if begin >= stop:
                break
            part = signal[max(0, begin - first_sample) : min(end, stop) - first_sample]
            if self._shows == "hold" and part.size:
                if begin > first_sample:
                    self._last = float(signal[begin - first_sample - 1])
                part[:] = self._last
            else:
                part[:] = self._level if self._shows == "rail" else 0.0
            if end > stop:
                break
            self._next()
        self._last = float(signal[-1])


class LostSignal:
    """The dropouts of every channel that has them.

    Raises
    ------
    InputError
        `shows: rail` on a channel without a range.
    """

    def __init__(self, rows: Sequence[Row], sample_rate_hz: float, seed: int) -> None:
        self._lines = []
        for channel, row in enumerate(rows):
            if row.dropouts is None:
                continue
            if row.dropouts.shows == "rail" and row.full_scale is None:
                where = f"sensor {row.channel}"
                raise InputError(
                    where, "dropouts.shows", "rail, without a range", "a range, or zero, or hold"
                )
            self._lines.append((channel, _Line(row, row.dropouts, sample_rate_hz, seed)))

    @property
    def active(self) -> bool:
        """False if all cables are sound."""
        return bool(self._lines)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Replace what is lost in `block` (channels, samples), which continues the block before."""
        for channel, line in self._lines:
            line.apply(block[channel], first_sample)
