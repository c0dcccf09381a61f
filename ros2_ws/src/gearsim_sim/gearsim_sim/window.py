"""The stretch of model output that one batch is made of, with the neighbours that its sensors look at."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.engine import EngineOutput


class Window:
    """Collects model output until a batch is complete, then moves on by one batch.

    Parameters
    ----------
    first : EngineOutput
        The model's first sample.
    batch : int
        Samples per batch.
    past, ahead : int
        Samples before and after a batch that are kept beside it. Before sample 0 the motion is zero.
    """

    def __init__(self, first: EngineOutput, batch: int, past: int, ahead: int) -> None:
        self.batch = batch
        self.ahead = ahead
        self._past = past
        self._shafts = first.shaft_names
        size = past + batch + ahead
        self._accel = np.zeros((len(first.site_names), size))
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
        """Take the next samples, at most `room`."""
        if output.first_sample != self.head:
            raise RuntimeError(f"the model gave sample {output.first_sample} in place of {self.head}")
        part = slice(self._filled, self._filled + output.sample_count)
        self._accel[:, part] = output.accel
        self._turns[:, part] = output.turns
        self._fraction[:, part] = output.fraction
        self._speed_hz[:, part] = output.speed_hz
        self._filled = part.stop

    def accel(self, count: int) -> NDArray[np.float64]:
        """Acceleration of the next `count` samples, `past` before and `ahead` after, in m/s^2."""
        return self._accel[:, : self._past + count + self.ahead]

    def angle(
        self, shaft: str, count: int, rate_hz: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
        """Whole turns, fraction and turns per sample of `count` + 1 samples, as `EdgeFinder` takes them."""
        if shaft not in self._shafts:
            raise InputError("sensors", "shaft", shaft, "one of " + ", ".join(self._shafts))
        row = self._shafts.index(shaft)
        part = slice(self._past, self._past + count + 1)
        return self._turns[row, part], self._fraction[row, part], self._speed_hz[row, part] / rate_hz

    def drop(self, count: int) -> None:
        """Move on by `count` samples."""
        for array in (self._accel, self._turns, self._fraction, self._speed_hz):
            kept = array[:, count : self._filled].copy()
            array[:, : kept.shape[1]] = kept
        self._filled -= count
        self._start += count
