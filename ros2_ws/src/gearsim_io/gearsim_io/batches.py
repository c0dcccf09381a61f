"""What flows through the rig: blocks of samples, tacho pulses and encoder edges on one sample clock.

The classes mirror `gearsim_msgs` field by field and know no ROS (a TorqueBatch travels as a SampleBatch
on a topic of its own). Arrays are read-only.
Times are integer nanoseconds; sample indices are integers that run from the start of the stream,
and `t0_ns` belongs to `first_sample`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError


@dataclass(frozen=True, slots=True, eq=False)
class _Samples:
    """Uniformly sampled channels; `data` is float32 of shape (channels, samples)."""

    t0_ns: int
    sample_rate_hz: float
    first_sample: int
    channels: tuple[str, ...]
    unit: str
    data: NDArray[np.float32]
    frame_id: str = ""

    def __post_init__(self) -> None:
        where = type(self).__name__
        _check_rate(where, self.sample_rate_hz)
        _check_index(where, "first_sample", self.first_sample)
        if self.data.ndim != 2 or self.data.dtype != np.float32:
            got = f"{self.data.dtype} with {self.data.ndim} dimensions"
            raise InputError(where, "data", got, "float32 of shape (channels, samples)")
        if self.data.shape[0] != len(self.channels):
            raise InputError(where, "data", f"{self.data.shape[0]} rows", f"{len(self.channels)} channels")
        if len(set(self.channels)) != len(self.channels) or not self.channels:
            raise InputError(where, "channels", self.channels, "unique names, at least one")
        if self.data.shape[1] == 0:
            raise InputError(where, "data", "no samples", "at least one sample")
        self.data.flags.writeable = False

    @property
    def sample_count(self) -> int:
        """Samples per channel."""
        return int(self.data.shape[1])

    @property
    def end_sample(self) -> int:
        """Index after the last sample."""
        return self.first_sample + self.sample_count


@dataclass(frozen=True, slots=True, eq=False)
class SampleBatch(_Samples):
    """Uniformly sampled accelerometers (or what a record holds); float32 of shape (channels, samples)."""


TORQUE_UNIT = "N*m"


@dataclass(frozen=True, slots=True, eq=False)
class TorqueBatch(_Samples):
    """Torque in shafts on the sample clock of the accelerometers, in `TORQUE_UNIT`."""

    @staticmethod
    def of(batch: SampleBatch) -> TorqueBatch:
        """A batch that came as samples on the topic of the torques."""
        return TorqueBatch(*(getattr(batch, name) for name in _Samples.__slots__))


@dataclass(frozen=True, slots=True, eq=False)
class TachoBatch:
    """Pulses of one tacho in [first_sample, first_sample + sample_count).

    `pulse_offsets` are float64 sample indices relative to `first_sample`, ascending.
    """

    t0_ns: int
    sample_rate_hz: float
    first_sample: int
    sample_count: int
    shaft: str
    pulses_per_revolution: float
    first_pulse: int
    pulse_offsets: NDArray[np.float64]
    frame_id: str = ""

    def __post_init__(self) -> None:
        where = f"TachoBatch of shaft {self.shaft!r}"
        _check_rate(where, self.sample_rate_hz)
        _check_index(where, "first_sample", self.first_sample)
        if not self.pulses_per_revolution > 0:
            raise InputError(where, "pulses_per_revolution", self.pulses_per_revolution, "> 0")
        _check_offsets(where, "pulse_offsets", self.pulse_offsets, self.sample_count)
        self.pulse_offsets.flags.writeable = False

    @property
    def end_sample(self) -> int:
        """Index up to which the list of pulses is complete."""
        return self.first_sample + self.sample_count


@dataclass(frozen=True, slots=True, eq=False)
class EncoderBatch:
    """Line edges of one encoder in [first_sample, first_sample + sample_count).

    Edge number k (counted from `first_edge`) is where the shaft's angle is 2 pi k / lines_per_revolution.
    """

    t0_ns: int
    sample_rate_hz: float
    first_sample: int
    sample_count: int
    shaft: str
    lines_per_revolution: int
    first_edge: int
    edge_offsets: NDArray[np.float64]
    frame_id: str = ""

    def __post_init__(self) -> None:
        where = f"EncoderBatch of shaft {self.shaft!r}"
        _check_rate(where, self.sample_rate_hz)
        _check_index(where, "first_sample", self.first_sample)
        if self.lines_per_revolution <= 0:
            raise InputError(where, "lines_per_revolution", self.lines_per_revolution, "> 0")
        _check_offsets(where, "edge_offsets", self.edge_offsets, self.sample_count)
        self.edge_offsets.flags.writeable = False

    @property
    def end_sample(self) -> int:
        """Index up to which the list of edges is complete."""
        return self.first_sample + self.sample_count


def _check_rate(where: str, rate_hz: float) -> None:
    if not (np.isfinite(rate_hz) and rate_hz > 0):
        raise InputError(where, "sample_rate", rate_hz, "a finite rate above 0 Hz")


def _check_index(where: str, field: str, index: int) -> None:
    if index < 0:
        raise InputError(where, field, index, "an index >= 0")


def _check_offsets(where: str, field: str, offsets: NDArray[np.float64], count: int) -> None:
    if offsets.ndim != 1 or offsets.dtype != np.float64:
        raise InputError(where, field, f"{offsets.dtype}, {offsets.ndim}-D", "float64, 1-D")
    if count <= 0:
        raise InputError(where, "sample_count", count, "at least one sample")
    if offsets.size == 0:
        return
    if not np.all(np.isfinite(offsets)) or offsets[0] < 0 or offsets[-1] >= count:
        raise InputError(where, field, f"{offsets[0]}..{offsets[-1]}", f"within [0, {count})")
    if np.any(np.diff(offsets) <= 0):
        raise InputError(where, field, "values out of order", "ascending sample indices")
