"""Recordings made for tests: small, of known content, and the bags that hold them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from gearsim_io.bags import BagWriter, StreamWriter
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.machines import load_machine
from gearsim_io.record import EdgeTrain, PulseTrain, Record


def make_record(
    seconds: float = 2.0,
    rate_hz: float = 4096.0,
    channels: tuple[str, ...] = ("b3_x", "b3_y"),
    seed: int = 1,
    shaft_hz: float = 10.0,
    t0_ns: int = 1_700_000_000_000_000_000,
) -> Record:
    """Noise on every channel, tacho and encoder of a shaft at constant speed."""
    count = round(seconds * rate_hz)
    data = np.random.default_rng(seed).standard_normal((len(channels), count)).astype(np.float32)
    pulses = np.arange(0.25, count, rate_hz / shaft_hz)
    edges = np.arange(0.5, count, rate_hz / shaft_hz / 36)
    return Record(
        sample_rate_hz=rate_hz,
        channels=channels,
        unit="m/s^2",
        data=data,
        tachos=(PulseTrain("input", 1.0, pulses),),
        encoders=(EdgeTrain("input", 36, 7, edges),),
        t0_ns=t0_ns,
        machine="unsw_parallel",
    )


def objects_of(
    record: Record, size: int = 512
) -> list[SampleBatch | TachoBatch | EncoderBatch | TorqueBatch]:
    """The record as batches."""
    return list(record.batches(size))


def write_bag(path: Path, record: Record, size: int = 512, sync_period_s: float | None = 0.2) -> Path:
    """A bag of a nameplate and a record."""
    with BagWriter(path, {"scenario": "test", "seed": "1"}, sync_period_s) as writer:
        stream = StreamWriter(writer)
        stream.write(load_machine("unsw_parallel"), record.t0_ns)
        for batch in record.batches(size):
            stream.write(batch)
    return path


def flip_byte(path: Path, place: int, mask: int = 0xFF) -> None:
    """Damage one byte of a file."""
    with open(path, "r+b") as stream:
        stream.seek(place)
        byte = stream.read(1)[0]
        stream.seek(place)
        stream.write(bytes([byte ^ mask]))
