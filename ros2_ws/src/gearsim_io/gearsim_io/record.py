"""A finite recording: channels, tacho pulses and encoder edges on one sample clock, as batches or whole."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearsim_io.batches import TORQUE_UNIT, EncoderBatch, SampleBatch, TachoBatch, TorqueBatch


@dataclass(frozen=True, slots=True, eq=False)
class PulseTrain:
    """Tacho pulses of a whole record: float64 sample indices from the record's start, ascending."""

    shaft: str
    pulses_per_revolution: float
    samples: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class EdgeTrain:
    """Encoder edges of a whole record: float64 sample indices from the record's start, ascending."""

    shaft: str
    lines_per_revolution: int
    first_edge: int
    samples: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Torques:
    """Torque in shafts over a whole record; `data_nm` is float32 of shape (channels, samples)."""

    channels: tuple[str, ...]
    data_nm: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """A recording in memory.

    Parameters
    ----------
    sample_rate_hz : float
    channels : tuple of str
    unit : str
        "m/s^2", or "1" where the source states none.
    data : ndarray of float32, shape (channels, samples)
    tachos, encoders : the angle signals, empty where there are none
    torques : Torques or None
    t0_ns : int
        Time of sample 0.
    first_sample : int
        Stream index of sample 0.
    source : str
        File, bag or scenario it came from.
    notes : dict
        What an importer learnt on the way (nameplate speed, load, mean removed ...), for people and reports.
    """

    sample_rate_hz: float
    channels: tuple[str, ...]
    unit: str
    data: NDArray[np.float32]
    tachos: tuple[PulseTrain, ...] = ()
    encoders: tuple[EdgeTrain, ...] = ()
    t0_ns: int = 0
    first_sample: int = 0
    machine: str = ""
    source: str = ""
    notes: dict[str, str] = field(default_factory=dict)
    torques: Torques | None = None

    @property
    def sample_count(self) -> int:
        """Samples per channel."""
        return int(self.data.shape[1])

    @property
    def seconds(self) -> float:
        """Duration."""
        return self.sample_count / self.sample_rate_hz

    def batches(self, size: int = 4096) -> Iterator[SampleBatch | TachoBatch | EncoderBatch | TorqueBatch]:
        """The record as the live stream would bring it, in blocks of `size` samples."""
        for start in range(0, self.sample_count, size):
            stop = min(start + size, self.sample_count)
            t0 = self.t0_ns + round(start * 1e9 / self.sample_rate_hz)
            first = self.first_sample + start
            block = np.ascontiguousarray(self.data[:, start:stop])
            yield SampleBatch(t0, self.sample_rate_hz, first, self.channels, self.unit, block, self.machine)
            for tacho in self.tachos:
                lo, hi = np.searchsorted(tacho.samples, (start, stop))
                yield TachoBatch(
                    t0,
                    self.sample_rate_hz,
                    first,
                    stop - start,
                    tacho.shaft,
                    tacho.pulses_per_revolution,
                    int(lo),
                    tacho.samples[lo:hi] - start,
                    self.machine,
                )
            for encoder in self.encoders:
                lo, hi = np.searchsorted(encoder.samples, (start, stop))
                yield EncoderBatch(
                    t0,
                    self.sample_rate_hz,
                    first,
                    stop - start,
                    encoder.shaft,
                    encoder.lines_per_revolution,
                    encoder.first_edge + int(lo),
                    encoder.samples[lo:hi] - start,
                    self.machine,
                )
            if self.torques is not None:
                torque = np.ascontiguousarray(self.torques.data_nm[:, start:stop])
                yield TorqueBatch(
                    t0, self.sample_rate_hz, first, self.torques.channels, TORQUE_UNIT, torque, self.machine
                )
