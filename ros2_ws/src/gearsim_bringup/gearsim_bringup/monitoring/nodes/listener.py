"""A node that hears features, trends, alarms and diagnostics, and hands them on as plain objects."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

from rclpy.node import Node

from gearsim_dsp.results import Alarm, AlarmState, Features, Trends
from gearsim_io import qos
from gearsim_io.errors import InputError
from gearsim_io.messages import from_msg


class Ears(Protocol):
    """Who takes what was heard."""

    def features(self, features: Features) -> None:
        """Indicators of one channel over one window."""
        ...

    def trends(self, trends: Trends) -> None:
        """Where indicators stand and where they go."""
        ...

    def alarm(self, alarm: Alarm) -> None:
        """One change of an alarm."""
        ...

    def alarm_state(self, state: AlarmState) -> None:
        """All alarms of one source."""
        ...


def listen(node: Node, ears: Ears, sources: str, on_bad: Callable[[str], None]) -> None:
    """Subscribe to all results of the rig; `sources` are the judging nodes, with commas between.

    A message that cannot be read is told through `on_bad` and left out.
    """

    def hear(topic: qos.Topic, cls: type[Any], take: Callable[[Any], None]) -> None:
        def callback(msg: Any) -> None:
            try:
                take(from_msg(msg, cls))
            except (InputError, ValueError) as error:
                on_bad(f"message on {topic.name} refused: {error}")

        qos.create_subscription(node, topic, callback)

    hear(qos.FEATURES, Features, ears.features)
    hear(qos.TRENDS, Trends, ears.trends)
    hear(qos.ALARM, Alarm, ears.alarm)
    for source in (name.strip() for name in sources.split(",") if name.strip()):
        hear(qos.ALARM_STATE.of(source), AlarmState, ears.alarm_state)


ALL_SOURCES = "envelope,kurtosis,gear,trend"
