"""How fast bags are written and recovered."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gearsim_bringup.bench.clock import alternate, cpu_seconds
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice
from gearsim_io import definitions, qos
from gearsim_io.bags import BagWriter, recover
from gearsim_io.batches import SampleBatch
from gearsim_io.messages import pure_types, to_msg

RATE_HZ = 65536.0
CHANNELS = 8
BATCH = 4096
SECONDS = 20.0


def measure(_voice: Voice) -> Iterator[Figure]:
    """Writing against rosbags' own writer, recovering against plainly reading the file."""
    messages = _messages()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ours, theirs = alternate(_fresh(folder, _ours, messages), _fresh(folder, _theirs, messages), 3)
        factor = SECONDS / ours
        yield Figure(
            "bag.record_x_realtime", factor, "x", Goal(">=", 100), ("rosbags writer", SECONDS / theirs)
        )
        bag = folder / "whole"
        _ours(bag, messages)
        file = next(bag.glob("*.mcap"))
        data = file.read_bytes()
        (bag / "metadata.yaml").unlink()
        file.write_bytes(data[: len(data) * 9 // 10])
        count = iter(range(1000))
        salvage = cpu_seconds(lambda: recover(bag, folder / f"r{next(count)}"), 3)
        copy = cpu_seconds(lambda: (folder / f"c{next(count)}").write_bytes(file.read_bytes()), 3)
        megabytes = file.stat().st_size / 1e6
        yield Figure(
            "bag.recover_mb_s", megabytes / salvage, "MB/s", Goal(">=", 50), ("plain copy", megabytes / copy)
        )


def _messages() -> list[tuple[int, bytes]]:
    generator = np.random.default_rng(1)
    store, types = definitions.typestore(), pure_types()
    names = tuple(f"c{index}" for index in range(CHANNELS))
    made = []
    for first in range(0, round(SECONDS * RATE_HZ), BATCH):
        data = generator.standard_normal((CHANNELS, BATCH)).astype(np.float32)
        t_ns = round(first * 1e9 / RATE_HZ)
        batch = SampleBatch(t_ns, RATE_HZ, first, names, "m/s^2", data, "bench")
        message = to_msg(batch, types, t_ns)
        made.append((t_ns, bytes(store.serialize_cdr(message, qos.ACCEL.type))))
    return made


def _fresh(folder: Path, write, messages):  # type: ignore[no-untyped-def]
    count = iter(range(1000))
    return lambda: write(folder / f"{write.__name__}{next(count)}", messages)


def _ours(path: Path, messages: list[tuple[int, bytes]]) -> None:
    with BagWriter(path) as writer:
        writer.add(qos.ACCEL)
        for t_ns, data in messages:
            writer.write(qos.ACCEL.full_name, t_ns, data)


def _theirs(path: Path, messages: list[tuple[int, bytes]]) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connection = writer.add_connection(
            qos.ACCEL.full_name, qos.ACCEL.type, typestore=definitions.typestore()
        )
        for t_ns, data in messages:
            writer.write(connection, t_ns, data)
