"""Alarms: when a sign of a fault becomes a level that people are told, and when it is taken back.

All in stream time: an alarm's stamp is that of the last sample that led to it, and equal windows give equal
alarms. Thresholds follow from the false alarms one is ready to bear (`Thresholds.derive`); docs/alarms.md
has the arithmetic.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from datetime import UTC, datetime

from gearsim_dsp.results import Alarm, AlarmState, Level
from gearsim_io.errors import InputError

__all__ = ["AlarmBook", "AlarmSettings", "Indication", "Judgement", "Thresholds", "format_alarm"]

UNIT = "-log10 of the false-alarm probability"
_TEN_MINUTES_S = 600.0
_TEN_YEARS_S = 10 * 365.25 * 86400.0
_SECONDS_OF_A_CALENDAR = 1e9


@dataclass(frozen=True, slots=True)
class AlarmSettings:
    """How rarely a healthy machine may raise an alarm, and how long a level must show before it counts.

    Parameters
    ----------
    warn_probability : float
        Of at least one false WARN in ten minutes of a healthy machine.
    error_probability : float
        Of at least one false ERROR in ten years of a healthy machine.
    clear_probability : float
        A window is clean when a healthy machine would look worse with at least this probability.
    raise_windows, of_windows : int
        A level is reached when `raise_windows` of the last `of_windows` windows reach its threshold.
    clear_windows : int
        A level is left when so many windows in a row are clean (ERROR: below the WARN threshold).
    """

    warn_probability: float = 1e-3
    error_probability: float = 1e-3
    clear_probability: float = 0.05
    raise_windows: int = 2
    of_windows: int = 3
    clear_windows: int = 8

    def __post_init__(self) -> None:
        for name in ("warn_probability", "error_probability", "clear_probability"):
            if not 0 < getattr(self, name) < 1:
                raise InputError("alarm settings", name, getattr(self, name), "between 0 and 1")
        if not 1 <= self.raise_windows <= self.of_windows <= 100:
            got = f"{self.raise_windows} of {self.of_windows}"
            raise InputError("alarm settings", "raise_windows, of_windows", got, "1 <= raise <= of <= 100")
        if not 1 <= self.clear_windows <= 10_000:
            raise InputError("alarm settings", "clear_windows", self.clear_windows, "1 to 10000")


@dataclass(frozen=True, slots=True)
class Thresholds:
    """Limits of the significance s = -log10 P of one test (one family on one channel in one window)."""

    warn: float
    error: float
    clear: float

    @classmethod
    def derive(cls, settings: AlarmSettings, tests_per_window: int, hop_s: float) -> Thresholds:
        """Limits such that all tests together keep the probabilities of the settings.

        By the union bound, which holds whatever the dependence of overlapping windows and of channels: with
        `tests_per_window` tests every `hop_s`, each at probability p, some test of a span T exceeds its limit
        with a probability of at most p * tests_per_window * T / hop_s.
        """
        if tests_per_window < 1 or not hop_s > 0:
            got = f"{tests_per_window} tests, hop {hop_s} s"
            raise InputError("thresholds", "tests_per_window, hop_s", got, "both above 0")
        per_s = tests_per_window / hop_s
        return cls(
            warn=math.log10(per_s * _TEN_MINUTES_S / settings.warn_probability),
            error=math.log10(per_s * _TEN_YEARS_S / settings.error_probability),
            clear=math.log10(tests_per_window / settings.clear_probability),
        )


@dataclass(frozen=True, slots=True)
class Indication:
    """What one window says about one fault of one component, on the channel that sees it best.

    Parameters
    ----------
    group : str
        Faults that cannot be told apart by their order (equal bearings on equal shafts) share a group and
        with it one alarm; `component` is the member that fits best.
    significance : float
        -log10 of the probability that a healthy machine shows as much in this test.
    confidence : float
        That the statement is right, 0 to 1.
    words : str
        For people: "outer race of bearing_3: 48.9 Hz and 5 harmonics, 21 dB over the floor".
    may_raise : bool
        False for a sign that is too weak in size to raise a level but keeps one that was raised before.
    """

    component: str
    fault: str
    group: str
    channel: str
    significance: float
    expected_order: float = float("nan")
    found_order: float = float("nan")
    found_frequency_hz: float = float("nan")
    confidence: float = 0.0
    words: str = ""
    may_raise: bool = True


@dataclass(frozen=True, slots=True)
class Judgement:
    """One window judged: `indications` hold at most one entry per group; what is absent showed nothing."""

    t_ns: int
    sample: int
    indications: tuple[Indication, ...]


@dataclass(slots=True)
class _Slot:
    """One alarm's memory: the last windows (None: nothing shown), its level and the alarm last sent."""

    recent: deque[Indication | None]
    level: Level = Level.OK
    component: str = ""
    alarm: Alarm | None = None
    strongest: Indication | None = field(default=None)


class AlarmBook:
    """The alarms of one source, one per (component, fault).

    Parameters
    ----------
    source : str
        Node or method that judges, first part of the alarms' names.
    frame_id : str
        Name of the machine.
    settings : AlarmSettings
    thresholds : Thresholds
    """

    STATE_PERIOD_NS = 10_000_000_000

    def __init__(self, source: str, frame_id: str, settings: AlarmSettings, thresholds: Thresholds) -> None:
        self.source = source
        self.frame_id = frame_id
        self.settings = settings
        self.thresholds = thresholds
        self._slots: dict[str, _Slot] = {}
        self._t_ns = 0
        self._sample = 0
        self._state_sent_ns: int | None = None

    def judge(self, judgement: Judgement) -> list[Alarm]:
        """Take one window's judgement; return the changes of level it leads to."""
        self._t_ns, self._sample = judgement.t_ns, judgement.sample
        shown = {indication.group: indication for indication in judgement.indications}
        if len(shown) != len(judgement.indications):
            raise ValueError("more than one indication of a group in one window")
        for group in shown:
            if group not in self._slots:
                length = max(self.settings.of_windows, self.settings.clear_windows)
                self._slots[group] = _Slot(deque(maxlen=length))
        changes: list[Alarm] = []
        for group, slot in sorted(self._slots.items()):
            slot.recent.append(shown.get(group))
            changes += self._reattribute(slot) if slot.level > Level.OK else []
            level = self._next_level(slot)
            if level != slot.level:
                changes.append(self._change(slot, level))
        self._forget()
        return changes

    def reset(self, t_ns: int, sample: int, why: str) -> list[Alarm]:
        """Take back all alarms, for instance because the stream began again."""
        self._t_ns, self._sample = t_ns, sample
        active = [slot for _, slot in sorted(self._slots.items()) if slot.level > Level.OK]
        changes = [self._change(slot, Level.OK, why) for slot in active]
        self._slots.clear()
        self._state_sent_ns = None
        return changes

    def state(self, note: str = "", stale: bool = False) -> AlarmState:
        """All alarms that are not OK, as of the last window judged."""
        active = tuple(s.alarm for _, s in sorted(self._slots.items()) if s.level > Level.OK and s.alarm)
        level = max((alarm.level for alarm in active), default=Level.OK)
        return AlarmState(self._t_ns, self.frame_id, self.source, level, stale, note, self._sample, active)

    def state_due(self) -> bool:
        """True if 10 s of stream time passed since it was last true, or it never was."""
        due = self._state_sent_ns is None or self._t_ns - self._state_sent_ns >= self.STATE_PERIOD_NS
        if due:
            self._state_sent_ns = self._t_ns
        return due

    def _next_level(self, slot: _Slot) -> Level:
        limits, settings = self.thresholds, self.settings
        last = list(slot.recent)
        recent = [_significance(i) for i in last[-settings.of_windows :] if i is None or i.may_raise]

        def reached(limit: float) -> bool:
            return sum(s >= limit for s in recent) >= settings.raise_windows

        calm = [_significance(i) for i in last[-settings.clear_windows :]]

        def left(limit: float) -> bool:
            return len(calm) == settings.clear_windows and all(s < limit for s in calm)

        if reached(limits.error):
            return Level.ERROR
        if reached(limits.warn):
            return max(slot.level, Level.WARN)
        if slot.level > Level.OK and left(limits.clear):
            return Level.OK
        if slot.level == Level.ERROR and left(limits.warn):
            return Level.WARN
        return slot.level

    def _reattribute(self, slot: _Slot) -> list[Alarm]:
        """Move an alarm to another member of its group when all recent windows agree on that one."""
        signs = [i for i in slot.recent if i is not None and i.may_raise]
        named = [i.component for i in signs if i.significance >= self.thresholds.warn]
        if len(named) < self.settings.clear_windows or set(named) & {slot.component}:
            return []
        if len(set(named)) != 1:
            return []
        level = slot.level
        taken_back = self._change(slot, Level.OK, f"the signs now point to {named[0]}")
        slot.level = Level.OK
        return [taken_back, self._change(slot, level)]

    def _change(self, slot: _Slot, level: Level, why: str = "") -> Alarm:
        limits = self.thresholds
        deciding = self._deciding(slot)
        if slot.level == Level.OK:
            slot.component = _best_component(slot)
        base = deciding if deciding is not None else slot.strongest
        assert base is not None
        if level >= slot.level and deciding is not None:
            slot.strongest = deciding
            limit = limits.error if level == Level.ERROR else limits.warn
            reason = deciding.words
        else:
            limit = limits.clear if level == Level.OK else limits.warn
            reason = why or self._calm_words(base, slot.component, level)
        latest = slot.recent[-1] if slot.recent else None
        value = base.significance if level >= slot.level else _significance(latest)
        alarm = Alarm(
            t_ns=self._t_ns,
            frame_id=self.frame_id,
            alarm_id=f"{self.source}/{slot.component or 'machine'}/{base.fault}",
            source=self.source,
            component=slot.component,
            fault=base.fault,
            channel=base.channel,
            level=level,
            previous_level=slot.level,
            expected_order=base.expected_order,
            found_order=base.found_order,
            found_frequency_hz=base.found_frequency_hz,
            value=value,
            threshold=limit,
            unit=UNIT,
            confidence=base.confidence,
            sample=self._sample,
            reason=reason,
        )
        slot.level = level
        slot.alarm = alarm
        return alarm

    def _deciding(self, slot: _Slot) -> Indication | None:
        """The strongest of the windows that count for raising, of the component that is named."""
        recent = [i for i in list(slot.recent)[-self.settings.of_windows :] if i is not None and i.may_raise]
        named = [i for i in recent if i.component == (slot.component or _best_component(slot))] or recent
        return max(named, key=lambda i: i.significance, default=None)

    def _calm_words(self, base: Indication, component: str, level: Level) -> str:
        what = f"{base.fault.replace('_', ' ')} of {component}" if component else base.fault
        windows = self.settings.clear_windows
        if level == Level.OK:
            return f"{what}: not seen in the last {windows} windows"
        return f"{what}: weaker in the last {windows} windows"

    def _forget(self) -> None:
        """Drop memories of groups that are OK and showed nothing lately, so that the book stays small."""
        idle = [g for g, s in self._slots.items() if s.level == Level.OK and not any(s.recent)]
        for group in idle:
            del self._slots[group]


def format_alarm(alarm: Alarm) -> str:
    """One line for people: time of the stream, level, reason, who saw it where.

    Stamps that are a time of day (the source counts from 1970) are shown as such, in UTC.
    """
    seconds = alarm.t_ns / 1e9
    when = f"{seconds:10.2f} s"
    if seconds > _SECONDS_OF_A_CALENDAR:
        when = datetime.fromtimestamp(seconds, UTC).strftime("%H:%M:%S.%f")[:-4] + " UTC"
    return f"{when}  {alarm.level.name:<5}  {alarm.reason}  [{alarm.source}, {alarm.channel}]"


def _significance(indication: Indication | None) -> float:
    return 0.0 if indication is None else indication.significance


def _best_component(slot: _Slot) -> str:
    """The member of the group with the most votes of the recent windows, each worth what it is sure of."""
    votes: dict[str, float] = {}
    for indication in slot.recent:
        if indication is not None and indication.may_raise:
            weight = indication.significance * indication.confidence
            votes[indication.component] = votes.get(indication.component, 0.0) + weight
    return max(sorted(votes), key=lambda name: votes[name], default="")
