"""Plays a bag: the recorded bytes on the recorded topics at the recorded pace, with /clock."""

from __future__ import annotations

import sys
import threading
import time
from dataclasses import dataclass
from functools import partial
from typing import Any

from rcl_interfaces.msg import SetParametersResult
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

from gearsim_io import qos
from gearsim_io.bags import BagMessage, TopicInfo, read_bag, topics_of
from gearsim_io.errors import InputError
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters, parameter
from gearsim_io.playback import Playback, Timeline

SIGNALS = tuple(t.type for t in (qos.ACCEL, qos.TACHO, qos.ENCODER, qos.MACHINE_INFO, qos.GROUND_TRUTH))
SETTLE_S = 0.3
STEP_S = 0.1
PATIENCE_S = 5.0


@dataclass(frozen=True)
class PlayerParameters:
    """What a user may set; `rate` and `paused` also while it plays."""

    bag: str = parameter("", "folder of the bag, or one .mcap file")
    rate: float = parameter(1.0, "bag seconds per second", 0.01, 100.0, live=True)
    paused: bool = parameter(False, "stand still", live=True)
    loop: bool = parameter(False, "begin again at the end; sample indices then start again too")
    clock_hz: float = parameter(50.0, "how often /clock is sent; 0: not at all", 0.0, 1000.0)
    signals_only: bool = parameter(False, "leave out recorded features, spectra, alarms and diagnostics")
    topics: tuple[str, ...] = parameter(("",), "full names of the topics to play; empty: all")
    wait_for: tuple[str, ...] = parameter(("",), "topics that must have subscribers first; * means all")
    min_subscribers: int = parameter(1, "how many each of them must have", 1, 100)
    wait_timeout_s: float = parameter(10.0, "begin after this time all the same [s]", 0.0, 3600.0)


class Player(Node):
    """Publishes from a thread of its own, so that parameters can change while it plays."""

    def __init__(self) -> None:
        super().__init__("player", namespace=qos.NAMESPACE)
        self._given = declare_parameters(self, PlayerParameters)
        self._timeline = Timeline(time.monotonic, self._given.rate, self._given.paused)
        if not self._given.bag:
            raise InputError("parameter of node player", "bag", "nothing", "the folder of a bag")
        self.exit_status: int | None = None
        self._sent = self._refused = 0
        self._failure: BaseException | None = None
        chosen = self._choose(topics_of(self._given.bag))
        self._players = {name: self._make_publisher(topic) for name, topic in chosen.items()}
        self._playback = Playback(
            self._timeline,
            partial(read_bag, self._given.bag, tuple(self._players)),
            self._send,
            self._given.loop,
        )
        self.add_on_set_parameters_callback(self._on_parameters)
        self._health = HealthPublisher(self)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._look = self.create_timer(STEP_S, self._look_after, clock=steady)
        if self._given.clock_hz > 0:
            self._clock_publisher = qos.create_publisher(self, qos.CLOCK)
            self._ticking = self.create_timer(1.0 / self._given.clock_hz, self._send_clock, clock=steady)
        self._worker = threading.Thread(target=self._work, name="player", daemon=True)
        self._worker.start()

    def _on_parameters(self, changed: list[Parameter]) -> SetParametersResult:
        for item in changed:
            if item.name == "rate":
                self._timeline.set_rate(item.value)
            elif item.name == "paused":
                self._timeline.set_paused(item.value)
        self._playback.wake()
        return SetParametersResult(successful=True)

    def _choose(self, topics: dict[str, TopicInfo]) -> dict[str, TopicInfo]:
        wanted = [name for name in self._given.topics if name]
        for name in wanted:
            if name not in topics:
                raise InputError(self._given.bag, "topics", name, "one of " + ", ".join(topics))
        chosen = {}
        for name, topic in topics.items():
            unwanted = (wanted and name not in wanted) or topic.type == qos.CLOCK.type
            if not unwanted and (not self._given.signals_only or topic.type in SIGNALS):
                chosen[name] = topic
        if not chosen:
            raise InputError(self._given.bag, "topics", "none to play", "at least one")
        return chosen

    def _make_publisher(self, topic: TopicInfo) -> Any:
        profile = topic.qos[0] if topic.qos else qos.RESULT
        try:
            return qos.create_publisher(self, qos.Topic(topic.name, topic.type, profile))
        except (ImportError, AttributeError):
            expected = "an installed message type; choose other topics to leave it out"
            raise InputError(self._given.bag, topic.name, topic.type, expected) from None

    def _work(self) -> None:
        try:
            self._wait_for_subscribers()
            self.get_logger().info(f"playing {self._given.bag} at rate {self._timeline.rate:g}")
            self._playback.run()
            self._wait_for_acknowledgement()
        except BaseException as error:
            self._failure = error  # the executor's thread ends the node with it

    def _wait_for_subscribers(self) -> None:
        names = [self.resolve_topic_name(name) for name in self._given.wait_for if name and name != "*"]
        if "*" in self._given.wait_for:
            names = list(self._players)
        end_s = time.monotonic() + self._given.wait_timeout_s
        lonely = names
        while lonely and not self._playback.stopped and time.monotonic() < end_s:
            lonely = [name for name in names if self._subscribers(name) < self._given.min_subscribers]
            time.sleep(STEP_S / 2)
        if lonely:
            self.get_logger().warning("too few subscribers for " + ", ".join(lonely))
        elif names:
            time.sleep(SETTLE_S)  # they are known here; they must also learn of this publisher

    def _subscribers(self, name: str) -> int:
        player = self._players.get(name)
        return self.count_subscribers(name) if player is None else player.get_subscription_count()

    def _send(self, message: BagMessage) -> None:
        publisher = self._players[message.topic]
        end_s = time.monotonic() + PATIENCE_S
        while True:
            try:
                publisher.publish(message.data)
                break
            except _rclpy.RCLError:  # under pressure the middleware refuses for a moment
                if time.monotonic() > end_s or self._playback.stopped:
                    self._refused += 1
                    return
                time.sleep(0.005)
        self._sent += 1

    def _wait_for_acknowledgement(self) -> None:
        """Let everything arrive before the publishers go; subscribers answer within 3 s (Fast DDS)."""
        for publisher in self._players.values():
            publisher.wait_for_all_acked(Duration(seconds=PATIENCE_S))

    def _send_clock(self) -> None:
        t_ns = self._timeline.now_ns()
        if t_ns:
            message = qos.message_class(qos.CLOCK.type)()
            message.clock.sec, message.clock.nanosec = divmod(t_ns, 1_000_000_000)
            self._clock_publisher.publish(message)

    def _look_after(self) -> None:
        """End the node when all is played; else say how it goes."""
        if isinstance(self._failure, InputError):
            print(f"player: {self._failure}", file=sys.stderr, flush=True)
            self.exit_status = 2
        elif self._failure is not None:
            raise self._failure
        elif not self._worker.is_alive():
            self.get_logger().info(f"played {self._sent} messages, {self._refused} refused")
            self.exit_status = 1 if self._refused else 0
        values = {
            "sent": self._sent,
            "refused": self._refused,
            "rate": self._timeline.rate,
            "loops": self._playback.loops,
        }
        level = Level.WARN if self._refused else Level.OK
        self._health.report("playing", level, "paused" if self._timeline.paused else "playing", values)

    def finish(self) -> None:
        """Stop where it is."""
        self._playback.stop()
        self._worker.join(PATIENCE_S)


make_node = Player
