"""The stretch of model output that one batch is made of, with the neighbours that its sensors look at."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

if TYPE_CHECKING:
    from gearsim_sim.engine import EngineOutput


class Window:
    """Collects model output until a batch is complete, then moves on by one batch.

    Parameters
    ----------
    first : EngineOutput
        The model's first samples, `factor` of them.
    batch : int
        Samples per batch.
    past, ahead : int
        Samples before and after a batch that are kept beside it. Before sample 0 the motion is zero.
    factor : int
        Samples that the model gives per sample. Accelerations are all kept, of angles and signals the first
        of each `factor`.
    signals : sequence of str
        Names of the model's further outputs to be kept.
    """

    def __init__(
        self,
        first: EngineOutput,
        batch: int,
        past: int,
        ahead: int,
        factor: int = 1,
        signals: Sequence[str] = (),
    ) -> None:
        self.batch = batch
        self.ahead = ahead
        self.factor = factor
        self._past = past
        self._shafts = first.shaft_names
        self._names = tuple(signals)
        size = past + batch + ahead
        self._accel = np.zeros((len(first.site_names), size * factor))
        self._signals = np.zeros((len(self._names), size))
        self._turns = np.zeros((len(first.shaft_names), size), dtype=np.int64)
        self._fraction = np.zeros((len(first.shaft_names), size))
        self._speed_hz = np.zeros((len(first.shaft_names), size))
        self._filled = past
        self._start = 0  # sample that a batch begins with
        self.put(first)

    @property
    def head(self) -> int:
        """Samples that the model has given so far."""
        return self._start + self._filled - self._past

    @property
    def room(self) -> int:
        """Samples missing until a batch and what is ahead of it are complete."""
        return self._past + self.batch + self.ahead - self._filled

    def put(self, output: EngineOutput) -> None:
        """Take the next samples, at most `room`, each with `factor` of the model's."""
        factor = self.factor
        if output.first_sample != self.head * factor:
            raise RuntimeError(
                f"the model gave sample {output.first_sample} in place of {self.head * factor}"
            )
        part = slice(self._filled, self._filled + output.sample_count // factor)
        self._accel[:, part.start * factor : part.stop * factor] = output.accel
        self._turns[:, part] = output.turns[:, ::factor]
        self._fraction[:, part] = output.fraction[:, ::factor]
        self._speed_hz[:, part] = output.speed_hz[:, ::factor]
        for row, name in enumerate(self._names):
            self._signals[row, part] = output.signals[name][::factor]
        self._filled = part.stop

    def accel(self, count: int, past: int, ahead: int) -> NDArray[np.float64]:
        """Acceleration of the next `count` samples, `past` before and `ahead` after, in m/s^2."""
        begin, end = self._past - past, self._past + count + ahead
        return self._accel[:, begin * self.factor : end * self.factor]

    def signals(self, count: int, past: int, ahead: int) -> NDArray[np.float64]:
        """The model's further outputs at the next `count` samples, `past` before and `ahead` after."""
        return self._signals[:, self._past - past : self._past + count + ahead]

    def angle(
        self, shaft: str, begin: int, end: int, rate_hz: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Whole turns, fraction and turns per sample from sample `begin` of the batch to `end`, inclusive."""
        if shaft not in self._shafts:
            raise InputError("sensors", "shaft", shaft, "one of " + ", ".join(self._shafts))
        row = self._shafts.index(shaft)
        part = slice(self._past + begin, self._past + end + 1)
        return self._turns[row, part], self._fraction[row, part], self._speed_hz[row, part] / rate_hz

    def drop(self, count: int) -> None:
        """Move on by `count` samples."""
        factor = self.factor
        kept = self._accel[:, count * factor : self._filled * factor].copy()
        self._accel[:, : kept.shape[1]] = kept
        for array in (self._signals, self._turns, self._fraction, self._speed_hz):
            moved = array[:, count : self._filled].copy()
            array[:, : moved.shape[1]] = moved
        self._filled -= count
        self._start += count
