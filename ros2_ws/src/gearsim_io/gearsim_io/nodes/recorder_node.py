"""Records topics into a bag: serialised bytes as they come, on the disk within a fraction of a second."""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, ReliabilityPolicy

from gearsim_io import cdr, definitions, qos
from gearsim_io.bags import BagError, BagWriter, TopicInfo
from gearsim_io.bags.layout import parse_custom_data
from gearsim_io.errors import InputError
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters, parameter

DISCOVERY_S = 0.25
QUIET_S, DRAIN_S = 0.15, 1.0
SPARE_S = 60.0
MEGABYTE = 1e6


@dataclass(frozen=True)
class RecorderParameters:
    """What a user may set."""

    bag: str = parameter("", "folder of the new bag")
    topics: tuple[str, ...] = parameter(("",), "full names of the topics; empty: all of gearsim's")
    all_topics: bool = parameter(False, "record every topic that there is")
    custom_data: str = parameter("{}", "JSON object of texts kept in the bag, such as scenario and seed")
    sync_period_s: float = parameter(0.2, "how often everything goes onto the disk [s]", 0.02, 0.45)


class Recorder(Node):
    """Subscribes to everything wanted as soon as it appears and writes what comes."""

    def __init__(self) -> None:
        super().__init__("recorder", namespace=qos.NAMESPACE)
        given = declare_parameters(self, RecorderParameters)
        if not given.bag:
            raise InputError("parameter of node recorder", "bag", "nothing", "the folder of a new bag")
        self.exit_status: int | None = None
        self._wanted = tuple(self.resolve_topic_name(name) for name in given.topics if name)
        self._all = given.all_topics
        self._gaps = cdr.GapCounter()
        self._topics: dict[str, TopicInfo | None] = {}  # None: cannot be recorded
        self._mixed: set[str] = set()
        self._bytes = self._bytes_before = 0
        # Never simulated time: it stands at 0 until the first /clock, and messages would lie years apart.
        self._wall = Clock(clock_type=ClockType.SYSTEM_TIME)
        self._last_message_s = 0.0
        self._writer = BagWriter(
            given.bag, parse_custom_data("parameter of node recorder", given.custom_data), sync_period_s=None
        )
        self._health = HealthPublisher(self)
        if not self._wanted:
            for topic in qos.TOPICS:
                name = self.resolve_topic_name(topic.name)
                self._subscribe(name, topic.type, topic.qos)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._recording_timers = [
            self.create_timer(given.sync_period_s, partial(self._safely, self._writer.sync), clock=steady),
            self.create_timer(DISCOVERY_S, partial(self._safely, self._discover), clock=steady),
            self.create_timer(1.0, self._report, clock=steady),
        ]
        self._safely(self._discover)
        self._report()
        self.get_logger().info(f"recording to {given.bag}")

    def _discover(self) -> None:
        """Subscribe to what has appeared since the last time."""
        for name, types in self.get_topic_names_and_types():
            if name in self._topics:
                self._check_types(name, types)
            if name in self._topics or not self._is_wanted(name, types):
                continue
            offered = [info.qos_profile for info in self.get_publishers_info_by_topic(name)]
            if offered:
                profile = qos.Qos(
                    depth=qos.WAVEFORM.depth,
                    reliable=all(p.reliability == ReliabilityPolicy.RELIABLE for p in offered),
                    latched=all(p.durability == DurabilityPolicy.TRANSIENT_LOCAL for p in offered),
                )
                self._subscribe(name, types[0], profile)

    def _check_types(self, name: str, types: list[str]) -> None:
        topic = self._topics[name]
        others = [] if topic is None else [other for other in types if other != topic.type]
        if others and name not in self._mixed:
            self._mixed.add(name)
            listed = ", ".join(others)
            self.get_logger().warning(f"{name}: type {listed} is there too, expected {topic.type} alone")

    def _is_wanted(self, name: str, types: list[str]) -> bool:
        if self._wanted:
            return name in self._wanted
        return self._all or types[0].startswith(f"{definitions.PACKAGE}/")

    def _subscribe(self, name: str, type_name: str, profile: qos.Qos) -> None:
        try:
            self._topics[name] = TopicInfo.of(name, type_name, (profile,))
            topic = qos.Topic(name, type_name, profile)
            qos.create_subscription(self, topic, partial(self._on_message, name), raw=True)
        except (InputError, ImportError, AttributeError) as error:
            self._topics[name] = None
            self.get_logger().warning(f"not recorded: {name} of type {type_name}: {error}")

    def _on_message(self, name: str, data: bytes, info: dict[str, Any]) -> None:
        self._last_message_s = time.monotonic()
        self._safely(partial(self._write, name, data, info["source_timestamp"]))

    def _write(self, name: str, data: bytes, published_ns: int) -> None:
        topic = self._topics[name]
        assert topic is not None
        self._writer.add_info(topic)
        self._writer.write(name, self._wall.now().nanoseconds, data, published_ns)
        self._bytes += len(data)
        if topic.type in cdr.BATCHES:
            missing = self._gaps.add(name, data, topic.type)
            if missing:
                self.get_logger().warning(f"{name}: {missing} samples are missing")

    def _safely(self, action: Any) -> None:
        """The disk may refuse at any time: then say so once, and end with what is on it."""
        if self.exit_status is not None:
            return
        try:
            action()
        except BagError as error:
            self._fail(str(error))

    def _fail(self, text: str) -> None:
        print(f"recorder: {text}", file=sys.stderr, flush=True)
        self._health.report("recording", Level.ERROR, text)
        self.exit_status = 1

    def _report(self) -> None:
        if self.exit_status is not None:
            return
        rate, self._bytes_before = self._bytes - self._bytes_before, self._bytes
        free = os.statvfs(self._writer.path)
        left = free.f_bavail * free.f_frsize
        values = {
            "bag": self._writer.path,
            "messages": self._writer.totals.messages,
            "topics": len(self._writer.totals.counts),
            "megabytes": self._bytes / MEGABYTE,
            "megabytes_per_second": rate / MEGABYTE,
            "gaps": self._gaps.gaps,
            "lost_samples": self._gaps.lost_samples,
            "free_megabytes": left / MEGABYTE,
        }
        level, text = Level.OK, "recording"
        if self._gaps.gaps:
            level, text = Level.WARN, f"{self._gaps.lost_samples} samples were lost in {self._gaps.gaps} gaps"
        elif left < SPARE_S * rate:
            level, text = Level.WARN, f"the disk is full in {left / rate:.0f} s"
        self._health.report("recording", level, text, values)

    def finish(self) -> None:
        """Take what is still under way, then close the bag."""
        if self.exit_status is None:
            self._drain()
            self._safely(self._writer.close)
        if self.exit_status is None:
            totals, counter = self._writer.totals, self._gaps
            self.get_logger().info(
                f"{self._writer.path}: {totals.messages} messages on {len(totals.counts)} topics, "
                f"{self._bytes / MEGABYTE:.1f} MB; {counter.lost_samples} samples lost in {counter.gaps} gaps"
            )

    def _drain(self) -> None:
        """Messages wait in the middleware's queue; go on until none has come for a moment."""
        executor = SingleThreadedExecutor()
        executor.add_node(self)
        now_s = time.monotonic()
        end_s, self._last_message_s = now_s + DRAIN_S, now_s
        while now_s < min(end_s, self._last_message_s + QUIET_S):
            executor.spin_once(timeout_sec=0.05)
            now_s = time.monotonic()
        executor.shutdown()


make_node = Recorder
