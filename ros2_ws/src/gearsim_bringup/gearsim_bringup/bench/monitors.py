"""All diagnostic nodes live, on four channels at the full rate: load of each, and growth of its memory.

Processor time is counted per second of the stream, so that a busy machine, on which the rig falls behind real
time, does not make the nodes look light.
"""

from __future__ import annotations

import contextlib
import math
import os
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.bench.stream import Listener, Probe
from gearsim_bringup.monitoring.choice import ALL_MONITORS, Choice
from gearsim_bringup.ui import Voice

SECONDS = 60.0
SETTLE_S = 30.0  # by then all windows are full, and what is learnt is learnt
LEARN_S = 20.0
RATE_HZ = 65536.0
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
    points = _run(voice)
    load = {name: _slope(rows, 1) for name, rows in points.items()}
    pair = sum(load.get(name, math.nan) for name in PAIR)
    yield Figure("stream.cpu.envelope_and_kurtosis_4ch", pair, "cores", Goal("<=", 0.40))
    for name in ALL_MONITORS:
        if name not in PAIR:
            yield Figure(f"stream.cpu.{name}_4ch", load.get(name, math.nan), "cores", Goal("<=", 0.10))
    for name in ALL_MONITORS:
        rows = points.get(name, [])
        growth = rows[-1][2] - rows[0][2] if len(rows) > 1 else math.nan
        yield Figure(f"stream.growth_mb.{name}_4ch", growth, "MB", Goal("<=", 8))


def _slope(rows: list[tuple[float, float, float]], column: int) -> float:
    """Change of a column per second of the stream, over all rows."""
    if len(rows) < 2 or rows[-1][0] <= rows[0][0]:
        return math.nan
    return (rows[-1][column] - rows[0][column]) / (rows[-1][0] - rows[0][0])


def _run(voice: Voice) -> dict[str, list[tuple[float, float, float]]]:
    """Of each process: seconds of the stream, processor seconds, resident MB, from `SETTLE_S` on."""
    from gearsim_bringup.live import LiveRun, simulator
    from gearsim_bringup.processes import Graph

    voice.say(f"  four channels and all diagnostic nodes for {SECONDS:g} s")
    points: dict[str, list[tuple[float, float, float]]] = {}
    probe, stop = Probe(), threading.Event()

    def look(graph: Graph) -> None:
        while not stop.wait(0.5):
            at_s = (probe.next_sample or 0) / RATE_HZ
            if at_s < SETTLE_S:
                continue
            for process in graph.processes:
                with contextlib.suppress(psutil.NoSuchProcess):
                    known = psutil.Process(process.pid)
                    times = known.cpu_times()
                    row = (at_s, times.user + times.system, known.memory_info().rss / 1e6)
                    points.setdefault(process.spec.name, []).append(row)

    with tempfile.TemporaryDirectory(prefix="gearsim_bench_") as name:
        folder = Path(name)
        scenario = folder / "four_channels.yaml"
        scenario.write_text(SCENARIO)
        choice = Choice(ALL_MONITORS, baselines=str(folder), learn_s=LEARN_S)
        source = simulator(str(scenario), end_after=SECONDS, rate=1.0, listeners=choice.listeners + 1)
        listener = Listener(probe)
        try:
            run = LiveRun(source, folder / "log", choice=choice)
            run.run(on_start=lambda graph: threading.Thread(target=look, args=(graph,), daemon=True).start())
        finally:
            stop.set()
            listener.close()
    return points
