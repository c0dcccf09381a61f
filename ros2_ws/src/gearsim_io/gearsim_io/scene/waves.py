"""Waveforms for the eye: lowest and highest value of each short block, and full detail where it matters."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Times = NDArray[np.float64]
Values = NDArray[np.float32]


class Outliner:
    """Reduces a stream of several channels to the extremes of blocks; nothing of a peak is lost.

    Parameters
    ----------
    block : int
        Samples that become two values; 1 keeps every sample.
    """

    def __init__(self, block: int) -> None:
        self.block = max(1, block)
        self._rest: Values | None = None
        self._rest_first = 0

    def push(self, first_sample: int, data: Values) -> tuple[NDArray[np.int64], Values]:
        """Take the next block of shape (channels, samples); return sample places and values (channels, n).

        What does not fill a block waits for the next call; after a gap it is dropped.
        """
        if self.block == 1:
            return np.arange(first_sample, first_sample + data.shape[1]), data
        if self._rest is not None and self._rest_first + self._rest.shape[1] == first_sample:
            data = np.concatenate([self._rest, data], axis=1)
            first_sample = self._rest_first
        count = data.shape[1] // self.block
        used = count * self.block
        self._rest, self._rest_first = data[:, used:].copy(), first_sample + used
        blocks = data[:, :used].reshape(data.shape[0], count, self.block)
        values = np.stack([blocks.min(axis=2), blocks.max(axis=2)], axis=2).reshape(data.shape[0], 2 * count)
        starts = first_sample + self.block * np.arange(count)
        places = np.stack([starts, starts + self.block // 2], axis=1).reshape(-1)
        return places, values


def cut(
    first_sample: int, data: Values, rate_hz: float, zero_sample: float, span_s: tuple[float, float]
) -> tuple[Times, Values]:
    """The part of a block between two times (seconds from `zero_sample`), all samples of it."""
    begin = max(0, int(np.ceil(zero_sample + span_s[0] * rate_hz)) - first_sample)
    end = min(data.shape[1], int(np.floor(zero_sample + span_s[1] * rate_hz)) + 1 - first_sample)
    if end <= begin:
        return np.empty(0), data[:, :0]
    places = first_sample + np.arange(begin, end)
    return (places - zero_sample) / rate_hz, data[:, begin:end]
