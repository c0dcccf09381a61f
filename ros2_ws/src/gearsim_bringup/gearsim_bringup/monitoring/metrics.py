"""Features, trends, alarms and diagnostics of the rig as metrics for Prometheus.

Keeps the latest of everything and hands it out when scraped. What was not heard of for a while is dropped, so
that a node that has died does not go on telling its last value; alarms stay, they are states. Bounded: at
most `MOST_SERIES` indicators, trends and so on each; what is left out is counted.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from gearsim_dsp.results import Alarm, AlarmState, Features, Trends

__all__ = ["RigMetrics"]

_FEATURE = ("machine", "source", "channel", "component", "name", "unit")
_ALARM = ("machine", "source", "component", "fault", "channel", "alarm")
_TRENDS = {
    "expected": "What the healthy machine has at this speed, in the indicator's unit",
    "limit": "Value of the indicator that would raise WARN",
    "deviation": "Standard deviations from what was learnt of the healthy machine",
    "slope": "Median slope of the indicator per hour",
    "hours_to_limit": "Hours until the limit at that slope, +Inf if it is not on the way there",
}


@dataclass(slots=True)
class _Entry:
    """A value with the moment at which it was last heard."""

    value: float
    heard_s: float


class _Table:
    """The latest values of one kind by their labels, bounded in number and age."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._entries: dict[tuple[str, ...], _Entry] = {}
        self.left_out = 0

    def put(self, labels: tuple[str, ...], value: float, now_s: float) -> None:
        if labels not in self._entries and len(self._entries) >= self._most:
            self.left_out += 1
            return
        self._entries[labels] = _Entry(float(value), now_s)

    def drop(self, unwanted: Callable[[tuple[str, ...]], bool]) -> None:
        for labels in [labels for labels in self._entries if unwanted(labels)]:
            del self._entries[labels]

    def forget(self, before_s: float) -> None:
        for labels in [labels for labels, entry in self._entries.items() if entry.heard_s < before_s]:
            del self._entries[labels]

    def items(self) -> list[tuple[tuple[str, ...], float]]:
        return [(labels, entry.value) for labels, entry in sorted(self._entries.items())]


class RigMetrics(Collector):
    """Takes what the rig publishes and is scraped by Prometheus.

    Parameters
    ----------
    clock_s : callable
        Seconds that never run backwards.
    forget_s : float
        Age at which indicators, trends and diagnostics are dropped.
    """

    MOST_SERIES = 5000

    def __init__(self, clock_s: Callable[[], float], forget_s: float = 60.0) -> None:
        self._clock_s = clock_s
        self._forget_s = forget_s
        self._lock = threading.Lock()
        self._features = _Table(self.MOST_SERIES)
        self._speeds = _Table(self.MOST_SERIES)
        self._trends = {name: _Table(self.MOST_SERIES) for name in _TRENDS}
        self._alarms: dict[tuple[str, ...], Alarm] = {}
        self._alarms_left_out = 0
        self._states = _Table(self.MOST_SERIES)
        self._stale = _Table(self.MOST_SERIES)
        self._diagnostics = _Table(self.MOST_SERIES)
        self._messages: dict[str, int] = {}
        self._changes: dict[tuple[str, str], int] = {}

    def features(self, features: Features) -> None:
        """Indicators of one channel over one window."""
        now_s = self._clock_s()
        with self._lock:
            self._count("features")
            stem = (features.frame_id, features.source, features.channel)
            for value in features.values:
                self._features.put((*stem, value.component, value.name, value.unit), value.value, now_s)
            self._speeds.put((features.frame_id, features.source), features.speed_hz, now_s)

    def trends(self, trends: Trends) -> None:
        """Where indicators stand and where they go."""
        now_s = self._clock_s()
        with self._lock:
            self._count("trends")
            for row in trends.values:
                labels = (trends.frame_id, row.source, row.channel, row.component, row.name, row.unit)
                for name, table in self._trends.items():
                    table.put(labels, getattr(row, name), now_s)

    def alarm(self, alarm: Alarm) -> None:
        """One change of an alarm."""
        with self._lock:
            self._count("alarm")
            key = (alarm.source, alarm.level.name)
            self._changes[key] = self._changes.get(key, 0) + 1
            self._keep(alarm)

    def alarm_state(self, state: AlarmState) -> None:
        """All alarms of one source; those it does not list are over."""
        now_s = self._clock_s()
        with self._lock:
            self._count("alarm_state")
            labels = (state.frame_id, state.source)
            for table, value in ((self._states, float(state.level)), (self._stale, float(state.stale))):
                # What a node said before it knew its machine, or of another one, is over.
                table.drop(lambda old: old[1] == state.source and old != labels)
                table.put(labels, value, now_s)
            for alarm in state.active:
                self._keep(alarm)
            active = {alarm.alarm_id for alarm in state.active}
            for key in [k for k, a in self._alarms.items() if a.source == state.source]:
                if self._alarms[key].alarm_id not in active and self._alarms[key].level > 0:
                    del self._alarms[key]

    def diagnostics(self, levels: Mapping[tuple[str, str], int]) -> None:
        """Levels of tasks on /diagnostics by (name, hardware_id)."""
        now_s = self._clock_s()
        with self._lock:
            self._count("diagnostics")
            latest = dict(levels)
            self._diagnostics.drop(lambda old: any(old[0] == new[0] and old != new for new in latest))
            for labels, level in latest.items():
                self._diagnostics.put(labels, float(level), now_s)

    def collect(self) -> Iterator[Metric]:
        """All metrics as they are now."""
        with self._lock:
            before_s = self._clock_s() - self._forget_s
            for table in (self._features, self._speeds, self._diagnostics, *self._trends.values()):
                table.forget(before_s)
            found = [*self._indicators(), *self._alarm_metrics(), *self._health()]
        yield from found

    def _indicators(self) -> Iterator[Metric]:
        yield _gauge("gearsim_feature", "Condition indicator of the latest window", _FEATURE, self._features)
        speed = "Speed of the reference shaft over the latest window"
        yield _gauge("gearsim_speed_hertz", speed, ("machine", "source"), self._speeds)
        for name, table in self._trends.items():
            unit = "_per_hour" if name == "slope" else ""
            yield _gauge(f"gearsim_trend_{name}{unit}", _TRENDS[name], _FEATURE, table)

    def _alarm_metrics(self) -> Iterator[Metric]:
        level = GaugeMetricFamily("gearsim_alarm_level", "0 OK, 1 WARN, 2 ERROR", labels=_ALARM)
        present = GaugeMetricFamily("gearsim_alarm_present", "1 while its cause shows", labels=_ALARM)
        noted = GaugeMetricFamily("gearsim_alarm_acknowledged", "1 once acknowledged", labels=_ALARM)
        reason = GaugeMetricFamily(
            "gearsim_alarm_reason", "Why, in plain words; always 1", labels=("alarm", "reason")
        )
        for labels, alarm in sorted(self._alarms.items()):
            level.add_metric(labels, float(alarm.level))
            present.add_metric(labels, float(alarm.present))
            noted.add_metric(labels, float(alarm.acknowledged))
            reason.add_metric((alarm.alarm_id, alarm.reason), 1.0)
        yield from (level, present, noted, reason)
        stem = ("machine", "source")
        yield _gauge("gearsim_alarm_state_level", "Worst level of a node's alarms", stem, self._states)
        yield _gauge("gearsim_alarm_state_stale", "1 while a node cannot judge", stem, self._stale)
        changes = CounterMetricFamily(
            "gearsim_alarm_changes", "Changes of alarms by the level they led to", labels=("source", "level")
        )
        for key, count in sorted(self._changes.items()):
            changes.add_metric(key, float(count))
        yield changes

    def _health(self) -> Iterator[Metric]:
        words = "Level of a task on /diagnostics: 0 OK, 1 WARN, 2 ERROR, 3 STALE"
        yield _gauge("gearsim_diagnostic_level", words, ("name", "hardware_id"), self._diagnostics)
        messages = CounterMetricFamily("gearsim_messages", "Messages received", labels=("topic",))
        for topic, count in sorted(self._messages.items()):
            messages.add_metric((topic,), float(count))
        yield messages
        left_out = CounterMetricFamily("gearsim_series_left_out", "Values that found no room in the exporter")
        tables = (self._features, self._speeds, self._states, self._diagnostics, *self._trends.values())
        left_out.add_metric((), float(self._alarms_left_out + sum(table.left_out for table in tables)))
        yield left_out

    def _keep(self, alarm: Alarm) -> None:
        # By its name alone: an alarm's channel may change, and two series of one alarm would contradict.
        stem = (alarm.frame_id, alarm.source, alarm.component, alarm.fault)
        labels = (*stem, alarm.channel, alarm.alarm_id)
        for old in [key for key in self._alarms if key[-1] == alarm.alarm_id and key != labels]:
            del self._alarms[old]
        if labels not in self._alarms and len(self._alarms) >= self.MOST_SERIES:
            self._alarms_left_out += 1
            return
        self._alarms[labels] = alarm

    def _count(self, topic: str) -> None:
        self._messages[topic] = self._messages.get(topic, 0) + 1


def _gauge(name: str, words: str, labels: tuple[str, ...], table: _Table) -> GaugeMetricFamily:
    family = GaugeMetricFamily(name, words, labels=labels)
    for row, value in table.items():
        family.add_metric(row, value)
    return family
