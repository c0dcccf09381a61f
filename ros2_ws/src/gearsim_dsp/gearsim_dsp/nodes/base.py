"""What all diagnostic nodes share: subscriptions, one thread that analyses, publishers, health.

The executor's thread only receives and queues batches, so that the DDS queue (6 s at the usual batch size)
is emptied while a window is analysed. One worker thread takes them in order, analyses and publishes.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

from gearsim_dsp.alarms import format_alarm
from gearsim_dsp.nodes.parameters import AlarmParameters
from gearsim_dsp.nodes.services import AlarmServices
from gearsim_dsp.results import Alarm, AlarmState, Features
from gearsim_dsp.streams.feed import BatchQueue, StateKeeper, StreamStatus, StreamWatch
from gearsim_dsp.streams.report import AlarmedMonitor, Outcome
from gearsim_io import qos
from gearsim_io.errors import InputError
from gearsim_io.messages import from_msg, ros_types, to_msg
from gearsim_io.nameplate import Machine
from gearsim_io.nodes.health import HealthPublisher, Level
from gearsim_io.nodes.parameters import declare_parameters

TICK_S = 0.5
DRAIN_S = 3.0


class MonitorNode(Node):
    """A monitor on the topics of a source.

    `make_monitor(machine, parameters=...)` makes the monitor; `source` names the node and what it publishes,
    `inputs` are the topics whose messages the monitor takes.
    """

    def __init__(
        self,
        source: str,
        parameters: type[AlarmParameters],
        make_monitor: Callable[[Machine, Any], AlarmedMonitor],
        inputs: tuple[qos.Topic, ...] = (qos.ACCEL, qos.TACHO),
    ) -> None:
        super().__init__(source, namespace=qos.NAMESPACE)
        given = declare_parameters(self, parameters)
        given.check()
        self._given: Any = given
        self._make_monitor = partial(make_monitor, parameters=given)
        self._patience_s = given.patience_s
        self._queue = BatchQueue(given.queue_s)
        what = "samples" if qos.ACCEL in inputs else "indicators"
        self._watch = StreamWatch(time.monotonic, given.stale_after_s, self.get_logger().warning, what=what)
        self._health = HealthPublisher(self)
        self._keeper = StateKeeper(source)
        self._types = ros_types()
        self._machine: Machine | None = None
        self._machine_error = ""
        self._next_monitor: AlarmedMonitor | None = None
        self._monitor: AlarmedMonitor | None = None
        self._judging = threading.Lock()
        self._failure: BaseException | None = None
        self._latency_ms = self._worst_ms = 0.0
        self._failed_sends = 0
        self._started_s = time.monotonic()
        self._finish_by_s = float("inf")
        topics = (qos.FEATURES, qos.SPECTRUM, qos.ALARM, qos.ALARM_STATE.of(source))
        made = [qos.create_publisher(self, topic) for topic in topics]
        self._features, self._spectrum, self._alarm, self._alarm_state = made
        self._inputs = [qos.MACHINE_INFO]
        qos.create_subscription(self, qos.MACHINE_INFO, self._on_machine)
        self._inputs_to_come = inputs
        self._listen_when_heard()
        self._alarm_services = AlarmServices(self, self._change)
        self._news = self.create_guard_condition(self._report_alarms)
        self._worker = threading.Thread(target=self._work, name=f"{source} analysis", daemon=True)
        self._timer = self.create_timer(TICK_S, self._tick, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def finish(self) -> None:
        """Analyse what is queued, for a few seconds at most, and stop."""
        self._finish_by_s = time.monotonic() + DRAIN_S
        self._queue.close()
        if self._worker.is_alive():
            self._worker.join(DRAIN_S + 2.0)

    def _listen_when_heard(self) -> None:
        """Take inputs once as many as were asked for would hear an alarm.

        A source that waits for this node's subscription then waits for those as well, and no first alarm is
        lost to a connection that the middleware has not made yet.
        """
        if self._alarm.get_subscription_count() >= self._given.alarm_listeners:
            topics, self._inputs_to_come = self._inputs_to_come, ()
            for topic in topics:
                self._listen(topic)

    def _listen(self, topic: qos.Topic) -> None:
        self._inputs.append(topic)
        qos.create_subscription(self, topic, partial(self._on_batch, topic))

    def _on_machine(self, msg: Any) -> None:
        try:
            machine = from_msg(msg)
            if repr(machine) == repr(self._machine):  # == would find every NaN in it to be another
                return
            monitor = self._make_monitor(machine)
        except (InputError, KeyError) as error:
            self._machine_error = f"nameplate refused: {error}"
            self._watch.refused(qos.MACHINE_INFO.name, str(error))
            return
        self._machine, self._machine_error = machine, ""
        self._health.health.hardware_id = machine.name
        inputs = (*self._inputs, *self._inputs_to_come)
        angle = qos.TACHO in inputs and qos.ENCODER not in inputs
        if angle and not machine.tacho_shafts and machine.encoder_shafts:
            self._listen(qos.ENCODER)
        self._next_monitor = monitor
        if not self._worker.is_alive() and self._failure is None:
            self._worker.start()

    def _on_batch(self, topic: qos.Topic, msg: Any) -> None:
        try:
            batch = from_msg(msg, Features) if topic == qos.FEATURES else from_msg(msg)
        except (InputError, ValueError) as error:
            self._watch.refused(topic.name, str(error))
            return
        self._watch.received(batch)
        self._queue.put(time.monotonic(), batch)

    def _work(self) -> None:
        try:
            while time.monotonic() < self._finish_by_s:
                entry = self._queue.get(TICK_S)
                if entry is not None:
                    self._analyse(*entry)
                    self._queue.finished()
                elif self._finish_by_s < float("inf"):
                    return
        except BaseException as error:
            self._failure = error  # the executor's thread ends the node with it

    def _analyse(self, arrival_s: float, batch: Any) -> None:
        monitor, self._next_monitor = self._next_monitor, None
        if monitor is not None:
            if self._monitor is not None:
                self._tell(self._monitor.withdraw("another nameplate came"))
                self._keeper.judged(self._monitor.present)
                self._send(self._alarm_state, self._keeper.state)
                self._news.trigger()
            self._monitor = monitor
        assert self._monitor is not None
        with self._judging:
            outcomes = self._monitor.push(batch)
            for outcome in outcomes:
                self._publish(outcome)
        if outcomes:
            self._latency_ms = 1e3 * (time.monotonic() - arrival_s)
            self._worst_ms = max(self._worst_ms, self._latency_ms)

    def _change(self, act: Callable[[AlarmedMonitor], list[Alarm]]) -> list[Alarm]:
        """Somebody acknowledges or resets alarms; what comes of it is told before this returns."""
        with self._judging:
            if self._monitor is None:
                return []
            alarms = act(self._monitor)
            self._tell(alarms)
            if alarms:
                self._send(self._alarm_state, self._keeper.changed(self._monitor.present))
                self._news.trigger()
        return alarms

    def _publish(self, outcome: Outcome) -> None:
        self._tell(outcome.alarms)
        self._keeper.judged(outcome.present)
        if outcome.alarms:
            self._news.trigger()  # the executor's thread tells /diagnostics at once
        if outcome.state_due:
            self._send(self._alarm_state, outcome.present)
        for features in outcome.report.features:
            self._send(self._features, features)
        for spectrum in outcome.report.spectra:
            self._send(self._spectrum, spectrum)

    def _tell(self, alarms: Iterable[Alarm]) -> None:
        for alarm in alarms:
            self._send(self._alarm, alarm)
            self.get_logger().info(format_alarm(alarm))

    def _send(self, publisher: Any, result: Any) -> None:
        try:
            publisher.publish(to_msg(result, self._types))
        except _rclpy.RCLError:  # DDS may refuse under pressure; the next window brings news anyway
            self._failed_sends += 1

    def _tick(self) -> None:
        if self._failure is not None:
            raise RuntimeError("the analysis stopped") from self._failure
        if self._inputs_to_come:
            self._listen_when_heard()
        self._check_types()
        monitor = self._monitor
        status = StreamStatus.of(monitor.assembler, self._queue) if monitor else StreamStatus()
        stream = self._watch.verdict(status)
        self._health.report("stream", stream.level, stream.message, stream.values)
        level, words = self._machine_verdict()
        self._health.report("machine", level, words)
        trouble = ("machine", words) if level != Level.OK else ("", "")
        changed = self._keeper.troubled(*(("stale", stream.message) if self._watch.stale else trouble))
        if changed is not None:
            self._send(self._alarm_state, changed)
        self._report_alarms()

    def _machine_verdict(self) -> tuple[Level, str]:
        if self._machine_error:
            return Level.ERROR, self._machine_error
        if self._machine is not None:
            return Level.OK, self._machine.name
        if time.monotonic() - self._started_s <= self._patience_s:
            return Level.OK, "waiting for the nameplate"
        return Level.WARN, f"no nameplate on {qos.MACHINE_INFO.name} yet: nothing can be judged"

    def _report_alarms(self) -> None:
        state = self._keeper.state
        values: dict[str, object] = {alarm.alarm_id: _in_short(alarm) for alarm in state.active}
        values |= {
            "latency of the last window [ms]": self._latency_ms,
            "longest latency [ms]": self._worst_ms,
            "messages not sent": self._failed_sends,
        }
        level, words = _in_words(state)
        self._health.report("alarms", level, words, values)

    def _check_types(self) -> None:
        for topic in self._inputs:
            for info in self.get_publishers_info_by_topic(self.resolve_topic_name(topic.name)):
                if info.topic_type != topic.type:
                    who = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
                    if "_UNKNOWN_" in who:  # a name may come after the type, or never
                        who = "a node without a name yet"
                    words = f"{topic.name}: {who} sends {info.topic_type}, expected {topic.type}"
                    self._watch.lasting(f"type {topic.name} {who}", words)


def _in_short(alarm: Alarm) -> str:
    marks = [alarm.level.name]
    marks += ["acknowledged"] if alarm.acknowledged else []
    marks += [] if alarm.present else ["gone, latched"]
    return ", ".join(marks)


def _in_words(state: AlarmState) -> tuple[Level, str]:
    """Level and message for /diagnostics: STALE where nothing can be judged at present."""
    told = "; ".join(alarm.reason for alarm in state.active)
    if state.stale:
        return Level.STALE, "; ".join(part for part in (state.note, told) if part)
    return state.level, told or "no alarm"
