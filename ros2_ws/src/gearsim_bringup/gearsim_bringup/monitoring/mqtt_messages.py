"""What goes to an MQTT broker: topics and JSON payloads of features, trends, alarms and states.

    <prefix>/<machine>/features/<source>/<channel>     indicators of each window
    <prefix>/<machine>/trends/<source>                 all trends, as they are published
    <prefix>/<machine>/alarm/<alarm id>                retained: the latest of each alarm
    <prefix>/<machine>/state/<source>                  retained: all alarms of a node
    <prefix>/status                                    retained: "online", or "offline" by the broker itself

Numbers that are none (NaN, infinite) become null, as JSON has no word for them. Times are `t_ns`, nanoseconds
on the stream's own time axis.
"""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from gearsim_dsp.results import Alarm, AlarmState, Features, Trends

__all__ = ["MqttMessage", "messages_of", "segment", "status_topic"]

_LIMIT = 200


@dataclass(frozen=True, slots=True)
class MqttMessage:
    """A message for the broker; `qos` 0: may be lost, 1: delivered at least once."""

    topic: str
    payload: str
    qos: int
    retain: bool


def messages_of(prefix: str, result: Features | Trends | Alarm | AlarmState) -> MqttMessage:
    """The message that tells of a result."""
    stem = f"{prefix}/{segment(result.frame_id)}"
    source = segment(result.source)
    if isinstance(result, Features):
        topic = f"{stem}/features/{source}/{segment(result.channel)}"
        return MqttMessage(topic, _json(result), 0, False)
    if isinstance(result, Trends):
        return MqttMessage(f"{stem}/trends/{source}", _json(result), 0, False)
    if isinstance(result, AlarmState):
        return MqttMessage(f"{stem}/state/{source}", _json(result), 1, True)
    place = "/".join(segment(part) for part in result.alarm_id.split("/"))
    return MqttMessage(f"{stem}/alarm/{place}", _json(result), 1, True)


def status_topic(prefix: str) -> str:
    """Where it is told whether we are there."""
    return f"{prefix}/status"


def segment(name: str) -> str:
    """A name as one level of a topic: without separators, wildcards and what else brokers refuse."""
    safe = "".join("_" if c in "/+#" or not c.isprintable() else c for c in name)[:_LIMIT]
    return safe.removeprefix("$") or "_"


def _json(result: Any) -> str:
    return json.dumps(_plain(result), separators=(",", ":"), allow_nan=False)


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: _plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, IntEnum):
        return value.name
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    return value
