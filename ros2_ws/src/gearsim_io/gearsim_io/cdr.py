"""The first fields of the batch messages, read from their serialised bytes without decoding the samples.

SampleBatch, TachoBatch and EncoderBatch begin alike: header, sample_rate, first_sample, number of samples;
the latter two go on with the shaft. That is enough to count gaps at the cost of a few microseconds.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

SAMPLE_BATCH = "gearsim_msgs/msg/SampleBatch"
ANGLE_BATCHES = ("gearsim_msgs/msg/TachoBatch", "gearsim_msgs/msg/EncoderBatch")
BATCHES = (SAMPLE_BATCH, *ANGLE_BATCHES)
_ENCAPSULATION = 4


class Position(NamedTuple):
    """Where a batch stands in its stream; `shaft` is empty for samples."""

    sample_rate_hz: float
    first_sample: int
    sample_count: int
    shaft: str


def position(data: bytes, type_name: str) -> Position | None:
    """The place of a serialised batch (one of `BATCHES`) in its stream; None if it is no such message."""
    try:
        order = "<" if data[1] & 1 else ">"
        (length,) = struct.unpack_from(f"{order}I", data, _ENCAPSULATION + 8)
        at = _ENCAPSULATION + 12 + length
        at += -(at - _ENCAPSULATION) % 8
        rate_hz, first, count = struct.unpack_from(f"{order}dQI", data, at)
        shaft = ""
        if type_name in ANGLE_BATCHES:
            (length,) = struct.unpack_from(f"{order}I", data, at + 20)
            shaft = bytes(data[at + 24 : at + 24 + length - 1]).decode()
    except (struct.error, IndexError, UnicodeDecodeError):
        return None
    return Position(rate_hz, first, count, shaft)


class GapCounter:
    """Counts what is missing in streams of serialised batches, told by `first_sample` alone.

    An index that jumps back is a restart of the source (or of a replay in a loop), not a gap.
    """

    def __init__(self) -> None:
        self.gaps = 0
        self.lost_samples = 0
        self.restarts = 0
        self._next: dict[tuple[str, str], int] = {}

    def add(self, topic: str, data: bytes, type_name: str) -> int:
        """Look at the next message of a topic; the number of samples missing before it."""
        place = position(data, type_name)
        if place is None:
            return 0
        key = (topic, place.shaft)
        expected = self._next.get(key)
        self._next[key] = place.first_sample + place.sample_count
        if expected is None or place.first_sample == expected:
            return 0
        if place.first_sample < expected:
            self.restarts += 1
            return 0
        missing = place.first_sample - expected
        self.gaps += 1
        self.lost_samples += missing
        return missing
