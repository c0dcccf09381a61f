"""Publishes a node's `Health` on /diagnostics (REP-107)."""

from __future__ import annotations

import time
from collections.abc import Mapping

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy

from gearsim_io.health import Health, Level, Status

__all__ = ["HealthPublisher", "Level"]

TOPIC = "/diagnostics"


class HealthPublisher:
    """A node's window on /diagnostics: `report()` whenever something is known, the rest happens by itself.

    All tasks go out once a second by a steady timer of the node (also under simulated time), and a task
    at once when its level changes. Header stamps are the node's clock, so they follow /clock if it does.

    Parameters
    ----------
    node : rclpy.node.Node
        Its name becomes the first half of "node: task".
    hardware_id : str
        What is looked after; `health.hardware_id` may be set later, when the machine is known.
    """

    def __init__(self, node: Node, hardware_id: str = "gearsim") -> None:
        self._node = node
        qos = QoSProfile(depth=10, reliability=ReliabilityPolicy.RELIABLE)
        self._publisher = node.create_publisher(DiagnosticArray, TOPIC, qos)
        self.health = Health(node.get_name(), hardware_id, time.monotonic, self._send)
        self.failed_sends = 0
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._timer = node.create_timer(1.0, self.health.tick, clock=steady)

    def report(
        self, task: str, level: Level, message: str, values: Mapping[str, object] | None = None
    ) -> None:
        """Set the status of one task (see `Health.report`)."""
        self.health.report(task, level, message, values)

    def _send(self, statuses: tuple[Status, ...]) -> None:
        message = DiagnosticArray()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.status = [_to_msg(status) for status in statuses]
        try:
            self._publisher.publish(message)
        except _rclpy.RCLError:
            self.failed_sends += 1  # under pressure DDS may refuse; the next second brings it again


def _to_msg(status: Status) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=bytes([status.level]),
        name=status.name,
        message=status.message,
        hardware_id=status.hardware_id,
        values=[KeyValue(key=key, value=value) for key, value in status.values],
    )
