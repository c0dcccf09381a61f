"""Watches a running graph from the command line: alarms, ground truth and /diagnostics."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from gearsim_io import qos


@dataclass
class Seen:
    """What a watcher has seen so far; times are wall-clock nanoseconds at receipt."""

    alarms: list[tuple[int, Any]] = field(default_factory=list)
    truths: list[tuple[int, Any]] = field(default_factory=list)
    values: dict[str, dict[str, str]] = field(default_factory=dict)  # "node: task" -> its key-value pairs
    levels: dict[str, tuple[int, str]] = field(default_factory=dict)  # "node: task" -> (level, message)


class Watcher:
    """A context with its own rclpy context, so that a command can watch several graphs one after another.

    Parameters
    ----------
    on_alarm, on_truth : callable, optional
        Called with each Alarm and each GroundTruth message as it arrives.
    on_status : callable, optional
        Called with name and key-values of each status on /diagnostics.
    """

    def __init__(
        self,
        on_alarm: Callable[[Any], None] | None = None,
        on_truth: Callable[[Any], None] | None = None,
        on_status: Callable[[str, Mapping[str, str]], None] | None = None,
    ) -> None:
        self.seen = Seen()
        self._on_status = on_status
        self._on_alarm = on_alarm
        self._on_truth = on_truth

    def __enter__(self) -> Watcher:
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        name = f"gearsim_cli_{os.getpid()}"
        namespace = qos.NAMESPACE
        self.node = Node(name, context=self._context, namespace=namespace, enable_rosout=False)
        qos.create_subscription(self.node, qos.ALARM, self._alarm)
        qos.create_subscription(self.node, qos.GROUND_TRUTH, self._truth)
        qos.create_subscription(self.node, qos.DIAGNOSTICS, self._diagnostics)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        return self

    def __exit__(self, *_error: object) -> None:
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def spin(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Handle what arrives for that long, or until something holds; True if it does."""
        end = time.monotonic() + seconds
        while not until():
            left = end - time.monotonic()
            if left <= 0:
                return False
            try:
                self._executor.spin_once(min(left, 0.1))
            except ExternalShutdownException:
                return until()
        return True

    def publishers_of(self, topic: qos.Topic) -> int:
        """How many publishers of a topic are known now."""
        return int(self.node.count_publishers(topic.full_name))

    def _alarm(self, message: Any) -> None:
        self.seen.alarms.append((time.time_ns(), message))
        if self._on_alarm is not None:
            self._on_alarm(message)

    def _truth(self, message: Any) -> None:
        self.seen.truths.append((time.time_ns(), message))
        if self._on_truth is not None:
            self._on_truth(message)

    def _diagnostics(self, message: Any) -> None:
        for status in message.status:
            self.seen.values[status.name] = {pair.key: pair.value for pair in status.values}
            self.seen.levels[status.name] = (int.from_bytes(status.level, "little"), status.message)
            if self._on_status is not None:
                self._on_status(status.name, self.seen.values[status.name])
