"""The first fields of the batch messages, read from their serialised bytes without decoding the samples.

SampleBatch, TachoBatch and EncoderBatch begin alike: header, sample_rate, first_sample, number of samples;
the latter two go on with the shaft. That is enough to count gaps at the cost of a few microseconds.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

SAMPLE_BATCH = "gearsim_msgs/msg/SampleBatch"
TACHO_BATCH = "gearsim_msgs/msg/TachoBatch"
ANGLE_BATCHES = (TACHO_BATCH, "gearsim_msgs/msg/EncoderBatch")
BATCHES = (SAMPLE_BATCH, *ANGLE_BATCHES)
_ENCAPSULATION = 4
_TO_SHAFT = 20  # behind sample_rate, first_sample and the number of samples


class Position(NamedTuple):
    """Where a batch stands in its stream; `shaft` is empty for samples."""

    sample_rate_hz: float
    first_sample: int
    sample_count: int
    shaft: str


def position(data: bytes, type_name: str) -> Position | None:
    """The place of a serialised batch (one of `BATCHES`) in its stream; None if it is no such message."""
    try:
        order, at = _behind_header(data)
        rate_hz, first, count = struct.unpack_from(f"{order}dQI", data, at)
        shaft = ""
        if type_name in ANGLE_BATCHES:
            (length,) = struct.unpack_from(f"{order}I", data, at + _TO_SHAFT)
            shaft = bytes(data[at + _TO_SHAFT + 4 : at + _TO_SHAFT + 4 + length - 1]).decode()
    except (struct.error, IndexError, UnicodeDecodeError):
        return None
    return Position(rate_hz, first, count, shaft)


def without_padding(data: bytes, type_name: str) -> bytes:
    """An angle batch without what `rclpy.serialization` appends to an empty list of doubles.

    It is four bytes of memory that mean nothing (messages taken from DDS have none), and the `rosbags`
    library (0.11) refuses a message that goes on behind its end. All other messages are given back as
    they are.
    """
    if type_name not in ANGLE_BATCHES:
        return data
    try:
        order, at = _behind_header(data)
        (length,) = struct.unpack_from(f"{order}I", data, at + _TO_SHAFT)
        at += _TO_SHAFT + 4 + length
        # pulses_per_revolution and first_pulse, or (after a 4-byte number of lines) first_edge
        at = _aligned(at, 8) + 16 if type_name == TACHO_BATCH else _aligned(_aligned(at, 4) + 4, 8) + 8
        (offsets,) = struct.unpack_from(f"{order}I", data, at)
    except (struct.error, IndexError):
        return data
    return data if offsets else data[: at + 4]


def _behind_header(data: bytes) -> tuple[str, int]:
    """Byte order, and the place of the field behind the header, which is a double."""
    order = "<" if data[1] & 1 else ">"
    (length,) = struct.unpack_from(f"{order}I", data, _ENCAPSULATION + 8)
    return order, _aligned(_ENCAPSULATION + 12 + length, 8)


def _aligned(at: int, size: int) -> int:
    return at + -(at - _ENCAPSULATION) % size


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
