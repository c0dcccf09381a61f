"""The latest stretch of a multi-channel signal in one preallocated block of memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["SignalBuffer"]


class SignalBuffer:
    """Samples [first_sample, end_sample) of all channels, float32, appended at the end, dropped at the front.

    The block is twice as long as what is kept, so the kept part moves to the front only once in a while:
    each sample is copied at most twice on the average, whatever the sizes of the batches.

    Parameters
    ----------
    channels : int
    capacity : int
        Samples per channel expected to be kept at once; grows (doubling) if more must be kept.
    first_sample : int
        Index of the first sample to come.
    """

    def __init__(self, channels: int, capacity: int, first_sample: int) -> None:
        self._block: NDArray[np.float32] = np.zeros((channels, 2 * max(capacity, 1)), dtype=np.float32)
        self._start = 0
        self._stop = 0
        self.first_sample = first_sample

    @property
    def end_sample(self) -> int:
        """Index after the last sample kept."""
        return self.first_sample + self._stop - self._start

    @property
    def nbytes(self) -> int:
        """Memory of the block."""
        return int(self._block.nbytes)

    def append(self, data: NDArray[np.float32]) -> None:
        """Add samples, shape (channels, n), that follow the last one."""
        count = data.shape[1]
        if self._stop + count > self._block.shape[1]:
            self._make_room(count)
        self._block[:, self._stop : self._stop + count] = data
        self._stop += count

    def drop_before(self, sample: int) -> None:
        """Forget samples before index `sample`."""
        step = min(max(sample - self.first_sample, 0), self._stop - self._start)
        self._start += step
        self.first_sample += step

    def copy(self, first_sample: int, end_sample: int) -> NDArray[np.float32]:
        """Samples [first_sample, end_sample), a read-only copy of shape (channels, n)."""
        if not self.first_sample <= first_sample <= end_sample <= self.end_sample:
            raise IndexError(
                f"[{first_sample}, {end_sample}) is not within [{self.first_sample}, {self.end_sample})"
            )
        lo = self._start + first_sample - self.first_sample
        out = self._block[:, lo : lo + end_sample - first_sample].copy()
        out.flags.writeable = False
        return out

    def _make_room(self, count: int) -> None:
        kept = self._stop - self._start
        length = self._block.shape[1]
        if 2 * (kept + count) > length:
            length = 2 * (kept + count)
            block = np.zeros((self._block.shape[0], length), dtype=np.float32)
            block[:, :kept] = self._block[:, self._start : self._stop]
            self._block = block
        else:
            self._block[:, :kept] = self._block[:, self._start : self._stop].copy()
        self._start, self._stop = 0, kept
