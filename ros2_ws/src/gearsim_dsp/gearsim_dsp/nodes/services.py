"""The services of a diagnostic node: people acknowledge and reset alarms, and have baselines learnt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearsim_msgs.srv import AcknowledgeAlarm, LearnBaseline, ResetAlarm
from rclpy.node import Node

from gearsim_dsp.results import Alarm
from gearsim_dsp.streams.report import AlarmedMonitor
from gearsim_io.nodes.answers import answer

Change = Callable[[Callable[[AlarmedMonitor], list[Alarm]]], list[Alarm]]


class AlarmServices:
    """`~/acknowledge_alarm` and `~/reset_alarm` of a node.

    `change(act)` has `act(monitor)` done while nothing is being judged, and publishes the alarms it returns.
    """

    def __init__(self, node: Node, change: Change) -> None:
        self._change = change
        self._logger = node.get_logger()
        self._services = [
            node.create_service(AcknowledgeAlarm, "~/acknowledge_alarm", self._acknowledge),
            node.create_service(ResetAlarm, "~/reset_alarm", self._reset),
        ]

    def _acknowledge(self, request: Any, response: Any) -> Any:
        return self._answer(response, "acknowledged", lambda m: m.acknowledge(request.alarm_id, request.by))

    def _reset(self, request: Any, response: Any) -> Any:
        return self._answer(response, "reset", lambda m: m.clear(request.alarm_id, request.by))

    def _answer(self, response: Any, done: str, change: Callable[[AlarmedMonitor], list[Alarm]]) -> Any:
        def act() -> str:
            response.alarm_ids = [alarm.alarm_id for alarm in self._change(change)]
            return f"{done}: {', '.join(response.alarm_ids) or 'nothing, no alarm waits for it'}"

        return answer(response, self._logger, act)


class BaselineService:
    """`~/learn_baseline` of a node; `learn(seconds, extend)` returns what is done now, in words."""

    def __init__(self, node: Node, learn: Callable[[float, bool], str]) -> None:
        self._learn = learn
        self._logger = node.get_logger()
        self._service = node.create_service(LearnBaseline, "~/learn_baseline", self._answer)

    def _answer(self, request: Any, response: Any) -> Any:
        return answer(
            response, self._logger, lambda: self._learn(float(request.seconds), bool(request.extend))
        )
