"""The MQTT node: features, trends and alarms for a broker."""

from __future__ import annotations

import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from paho.mqtt.client import Client, MQTTErrorCode
from paho.mqtt.enums import CallbackAPIVersion
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from gearsim_bringup.monitoring.mqtt_messages import MqttMessage, messages_of, segment, status_topic
from gearsim_bringup.monitoring.nodes.listener import ALL_SOURCES, listen
from gearsim_dsp.results import Alarm, AlarmState, Features, Trends
from gearsim_io import qos
from gearsim_io.errors import InputError
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters, parameter

_MOST_QUEUED = 1000  # messages that wait for the broker; the client drops what comes beyond
_KEEP_ALIVE_S = 15
_MOST_WAIT_S = 30


@dataclass(frozen=True)
class MqttParameters:
    """Parameters of the MQTT node."""

    host: str = parameter("127.0.0.1", "the broker")
    port: int = parameter(1883, "its port", 1, 65535)
    prefix: str = parameter("gearsim", "first part of all topics")
    client_id: str = parameter("", "name at the broker; empty: any")
    username: str = parameter("", "user at the broker; empty: none")
    password_file: str = parameter("", "file whose first line is the password")
    tls: bool = parameter(False, "encrypt, and check the broker's certificate")
    ca_file: str = parameter("", "certificates to check it with; empty: the system's")
    features: bool = parameter(True, "send indicators too, not alarms alone")
    sources: str = parameter(ALL_SOURCES, "judging nodes whose alarm states are sent")

    def check(self) -> None:
        """Raise InputError for a prefix that is no topic."""
        levels = self.prefix.split("/")
        if not all(level and segment(level) == level for level in levels):
            expected = "levels with '/' between, without wildcards"
            raise InputError("parameter of node mqtt", "prefix", self.prefix, expected)

    def password(self) -> str | None:
        """What the password file holds."""
        if not self.password_file:
            return None
        try:
            return Path(self.password_file).read_text().splitlines()[0]
        except (OSError, IndexError) as error:
            expected = f"a readable file with a password ({error})"
            raise InputError(
                "parameter of node mqtt", "password_file", self.password_file, expected
            ) from None


class MqttNode(Node):
    """Passes results on; connects, and connects again, in the background."""

    def __init__(self) -> None:
        super().__init__("mqtt", namespace=qos.NAMESPACE)
        self._given = given = declare_parameters(self, MqttParameters)
        given.check()
        self._where = f"{given.host}:{given.port}"
        self._trouble = "not connected yet"
        self._sent = self._dropped = 0
        self._client = self._make_client(given)
        self._health = HealthPublisher(self)
        listen(self, self, given.sources, self.get_logger().warning)
        self._client.connect_async(given.host, given.port, _KEEP_ALIVE_S)
        self._client.loop_start()
        self._news = self.create_guard_condition(self._report)
        self._timer = self.create_timer(1.0, self._report, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def features(self, features: Features) -> None:
        """Pass indicators on, where they are wanted."""
        if self._given.features:
            self._send(features)

    def trends(self, trends: Trends) -> None:
        """Pass trends on, where indicators are wanted."""
        if self._given.features:
            self._send(trends)

    def alarm(self, alarm: Alarm) -> None:
        """Pass a change of an alarm on."""
        self._send(alarm)

    def alarm_state(self, state: AlarmState) -> None:
        """Pass the state of a node on."""
        self._send(state)

    def finish(self) -> None:
        """Say goodbye to the broker."""
        if self._client.is_connected():
            told = self._client.publish(status_topic(self._given.prefix), "offline", 1, True)
            told.wait_for_publish(2.0)
        self._client.disconnect()
        self._client.loop_stop()

    def _make_client(self, given: MqttParameters) -> Client:
        client = Client(CallbackAPIVersion.VERSION2, client_id=given.client_id)
        client.max_queued_messages_set(_MOST_QUEUED)
        client.reconnect_delay_set(1, _MOST_WAIT_S)
        client.will_set(status_topic(given.prefix), "offline", 1, True)
        if given.username:
            client.username_pw_set(given.username, given.password())
        if given.tls:
            try:
                client.tls_set_context(ssl.create_default_context(cafile=given.ca_file or None))
            except OSError as error:
                expected = f"a file with certificates ({error})"
                raise InputError("parameter of node mqtt", "ca_file", given.ca_file, expected) from None
        client.on_connect = self._on_connect
        client.on_disconnect = self._on_disconnect
        client.on_connect_fail = self._on_connect_fail
        return client

    def _on_connect(self, client: Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        self._tell(f"refused by the broker: {reason}" if reason.is_failure else "")
        if not reason.is_failure:
            client.publish(status_topic(self._given.prefix), "online", 1, True)

    def _on_disconnect(self, _client: Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        self._tell(f"disconnected: {reason}")

    def _on_connect_fail(self, _client: Client, _data: Any) -> None:
        self._tell("no connection: nobody answers there")

    def _tell(self, trouble: str) -> None:
        """Called in the client's thread; said once per change."""
        if trouble != self._trouble:
            self._trouble = trouble
            words = f"broker {self._where}: {trouble or 'connected'}"
            if trouble:  # rclpy wants a line of code of its own for each severity
                self.get_logger().warning(words)
            else:
                self.get_logger().info(words)
            self._news.trigger()

    def _send(self, result: Features | Trends | Alarm | AlarmState) -> None:
        message: MqttMessage = messages_of(self._given.prefix, result)
        told = self._client.publish(message.topic, message.payload, message.qos, message.retain)
        if told.rc in (MQTTErrorCode.MQTT_ERR_SUCCESS, MQTTErrorCode.MQTT_ERR_NO_CONN) and (
            message.qos or not told.rc
        ):
            self._sent += 1  # what must not be lost is queued by the client until the broker is there
        else:
            self._dropped += 1

    def _report(self) -> None:
        level = Level.WARN if self._trouble else Level.OK
        values = {"messages sent or waiting": self._sent, "messages dropped": self._dropped}
        self._health.report("broker", level, f"{self._where}: {self._trouble or 'connected'}", values)


def make_node() -> MqttNode:
    """The node, once rclpy is ready."""
    return MqttNode()
