"""The live graph for a minute: loss, delay, load of each process, growth of memory."""

from __future__ import annotations

import os
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice

SECONDS = 60.0
SETTLE_S = 15.0
BARE_SECONDS = 15.0
NODES = {"simulator": "sim", "envelope": "envelope", "kurtosis": "kurtosis", "recorder": "recorder"}
CPU_GOALS = {"simulator": 0.35, "envelope": 0.25, "kurtosis": 0.15, "recorder": 0.10}


@dataclass
class Probe:
    """Delays from publishing to receiving, and gaps, on one topic."""

    delays_ms: list[float] = field(default_factory=list)
    batches: int = 0
    lost: int = 0
    next_sample: int | None = None

    def __call__(self, data: bytes, info: dict[str, Any]) -> None:
        """Take one serialised SampleBatch."""
        from gearsim_io import cdr

        self.delays_ms.append((time.time_ns() - info["source_timestamp"]) * 1e-6)
        place = cdr.position(data, cdr.SAMPLE_BATCH)
        if place is None:
            return
        if self.next_sample is not None and place.first_sample > self.next_sample:
            self.lost += round((place.first_sample - self.next_sample) / place.sample_count)
        self.next_sample = place.first_sample + place.sample_count
        self.batches += 1

    @property
    def p99_ms(self) -> float:
        """99th percentile of the delays."""
        return float(np.percentile(self.delays_ms, 99)) if self.delays_ms else float("nan")


def measure(voice: Voice) -> Iterator[Figure]:
    """The rig with both monitors, recorder and a probe, beside a bare publisher of messages of that size."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(100 + os.getpid() % 100))
    bare = _bare_pair(voice)
    probe, watch, lost = _rig(voice)
    yield Figure("stream.lost_batches", float(lost), "batches", Goal("<=", 0))
    yield Figure("stream.p99_ms", probe.p99_ms, "ms", Goal("<=", 20), ("bare publisher", bare.p99_ms))
    for node, short in NODES.items():
        yield Figure(f"stream.cpu.{short}", watch.load(node), "cores", Goal("<=", CPU_GOALS[node]))
    for node, short in NODES.items():
        yield Figure(f"stream.growth_mb.{short}", watch.growth_mb(node), "MB", Goal("<=", 8))


class LoadWatch:
    """Processor time and memory of the graph's processes between settling and the end."""

    def __init__(self) -> None:
        self._points: dict[str, list[tuple[float, float, float]]] = {}

    def look(self, name: str, pid: int) -> None:
        """Note time, processor seconds and resident memory of a process."""
        try:
            process = psutil.Process(pid)
            times = process.cpu_times()
            point = (time.monotonic(), times.user + times.system, process.memory_info().rss / 1e6)
        except psutil.NoSuchProcess:
            return
        self._points.setdefault(name, []).append(point)

    def load(self, name: str) -> float:
        """Mean load in cores."""
        points = self._points.get(name, [])
        if len(points) < 2:
            return float("nan")
        (began, before, _), (ended, after, _) = points[0], points[-1]
        return (after - before) / (ended - began)

    def growth_mb(self, name: str) -> float:
        """Growth of resident memory."""
        points = self._points.get(name, [])
        return points[-1][2] - points[0][2] if len(points) > 1 else float("nan")


def _rig(voice: Voice) -> tuple[Probe, LoadWatch, int]:
    from gearsim_bringup.demo import deliveries
    from gearsim_bringup.live import MONITORS, LiveRun, simulator
    from gearsim_bringup.processes import Graph

    voice.say(f"  the live rig for {SECONDS:g} s")
    probe, watch = Probe(), LoadWatch()
    stop = threading.Event()
    source = simulator("healthy", end_after=SECONDS, rate=1.0, listeners=len(MONITORS) + 2)
    with tempfile.TemporaryDirectory(prefix="gearsim_bench_") as name:
        run = LiveRun(source, Path(name) / "log", Path(name) / "bag")

        def look(graph: Graph) -> None:
            stop.wait(SETTLE_S)
            while not stop.is_set():
                for process in graph.processes:
                    watch.look(process.spec.name, process.pid)
                stop.wait(1.0)

        listener = Listener(probe)
        looker: list[threading.Thread] = []

        def started(graph: Graph) -> None:
            looker.append(threading.Thread(target=look, args=(graph,), daemon=True))
            looker[0].start()

        try:
            run.run(on_start=started)
        finally:
            stop.set()
            listener.close()
        sent = round(SECONDS * 65536)
        delivery = deliveries(Path(name) / "bag")
        missing = max(0, sent - delivery.samples)
    return probe, watch, probe.lost + round(missing / 4096)


class Listener:
    """Subscribes the probe to accel in a thread and context of its own."""

    def __init__(self, probe: Probe) -> None:
        import rclpy
        from rclpy.context import Context
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.node import Node
        from rclpy.signals import SignalHandlerOptions

        from gearsim_io import qos

        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node("gearsim_probe", context=self._context, namespace=qos.NAMESPACE)
        qos.create_subscription(self._node, qos.ACCEL, probe, raw=True)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        while not self._stop.is_set():
            self._executor.spin_once(0.1)

    def close(self) -> None:
        """End the thread and the context."""
        import rclpy

        self._stop.set()
        self._thread.join(5.0)
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)


def _bare_pair(voice: Voice) -> Probe:
    """A process that does nothing but publish messages of the same size at the same pace."""
    from gearsim_bringup.processes import Graph, NodeSpec

    voice.say(f"  a bare publisher for {BARE_SECONDS:g} s")
    probe = Probe()
    with tempfile.TemporaryDirectory(prefix="gearsim_bench_") as name, Graph(Path(name)) as graph:
        listener = Listener(probe)
        graph.start(NodeSpec("bare", "gearsim_bringup.nodes.bare_publisher"))
        time.sleep(BARE_SECONDS)
        listener.close()
    return probe
