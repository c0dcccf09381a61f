"""All diagnostic nodes live, on four channels at the full rate: load of each, and growth of its memory."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.bench.stream import SETTLE_S, LoadWatch
from gearsim_bringup.monitoring.choice import ALL_MONITORS, Choice
from gearsim_bringup.ui import Voice

SECONDS = 60.0
PAIR = ("envelope", "kurtosis")
SCENARIO = """
description: The healthy rig with one channel on each pedestal.
machine: unsw_parallel
model: lpm34
seed: 1
sample_rate: 65536 Hz
oversampling: 4
batch_samples: 4096
operating_point: {speed: 10 Hz, load: 50 N*m}
sensors:
  accelerometers:
    channels: [b1_y, b2_y, b3_y, b4_y]
"""


def measure(voice: Voice) -> Iterator[Figure]:
    """Envelope and kurtosis node together, gear and trend node each, and the growth of all."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    watch = _run(voice)
    pair = sum(watch.load(name) for name in PAIR)
    yield Figure("stream.cpu.envelope_and_kurtosis_4ch", pair, "cores", Goal("<=", 0.40))
    for name in ALL_MONITORS:
        if name not in PAIR:
            yield Figure(f"stream.cpu.{name}_4ch", watch.load(name), "cores", Goal("<=", 0.10))
    for name in ALL_MONITORS:
        yield Figure(f"stream.growth_mb.{name}_4ch", watch.growth_mb(name), "MB", Goal("<=", 8))


def _run(voice: Voice) -> LoadWatch:
    from gearsim_bringup.live import LiveRun, simulator
    from gearsim_bringup.processes import Graph

    voice.say(f"  four channels and all diagnostic nodes for {SECONDS:g} s")
    watch, stop = LoadWatch(), threading.Event()
    with tempfile.TemporaryDirectory(prefix="gearsim_bench_") as name:
        folder = Path(name)
        scenario = folder / "four_channels.yaml"
        scenario.write_text(SCENARIO)
        choice = Choice(ALL_MONITORS, baselines=str(folder), learn_s=20.0)
        source = simulator(str(scenario), end_after=SECONDS, rate=1.0, listeners=choice.listeners)

        def look(graph: Graph) -> None:
            stop.wait(SETTLE_S)
            while not stop.is_set():
                for process in graph.processes:
                    watch.look(process.spec.name, process.pid)
                stop.wait(1.0)

        def started(graph: Graph) -> None:
            threading.Thread(target=look, args=(graph,), daemon=True).start()

        try:
            LiveRun(source, folder / "log", choice=choice).run(on_start=started)
        finally:
            stop.set()
    return watch
