"""The alarms of one source: levels with hysteresis, latched until acknowledged where that is wanted.

The life of an alarm is that of ISA-18.2 (IEC 62682): raised, acknowledged or not; its cause gone while nobody
took note (latched), or gone after somebody did. An acknowledgement belongs to a level: one that rises further
wants another.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from gearsim_dsp.alarms import UNIT, AlarmSettings, Indication, Judgement, Thresholds
from gearsim_dsp.results import Alarm, AlarmState, Level
from gearsim_io.errors import InputError

__all__ = ["AlarmBook"]


@dataclass(slots=True)
class _Slot:
    """One alarm's memory.

    `recent` holds the last windows (None: nothing shown), `shows` the level that they support, `level` the
    one that is told: higher than `shows` while it is latched.
    """

    recent: deque[Indication | None]
    shows: Level = Level.OK
    level: Level = Level.OK
    component: str = ""
    acknowledged: bool = False
    operator: str = ""
    detail: str = ""
    alarm: Alarm | None = None
    strongest: Indication | None = None


class AlarmBook:
    """The alarms of one source, one per group of indications.

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
        """Take one window's judgement; return the changes it leads to."""
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
            if not group.startswith(judgement.scope):
                continue
            slot.recent.append(shown.get(group))
            changes += self._reattribute(slot) if slot.shows > Level.OK else []
            changes += self._follow(slot, self._supported(slot))
        self._forget()
        return changes

    def acknowledge(self, alarm_id: str = "", operator: str = "") -> list[Alarm]:
        """Somebody took note of an alarm (all of them, where no name is given); return the changes.

        Raises
        ------
        InputError
            When there is no such alarm.
        """
        changes: list[Alarm] = []
        for slot in self._chosen("acknowledge_alarm", alarm_id):
            if slot.acknowledged:
                continue
            by = f" by {operator}" if operator else ""
            slot.acknowledged, slot.operator = True, operator
            assert slot.alarm is not None
            words = f"{slot.alarm.reason} (acknowledged{by})"
            if slot.shows < slot.level:
                words = f"{_plain(slot.alarm)}: acknowledged{by}, {_gone(slot.shows)}"
            changes.append(self._change(slot, slot.shows, words))
        return changes

    def clear(self, alarm_id: str = "", operator: str = "") -> list[Alarm]:
        """Take an alarm (all of them, where no name is given) back and forget its windows.

        Raises
        ------
        InputError
            When there is no such alarm.
        """
        by = f" by {operator}" if operator else ""
        changes: list[Alarm] = []
        for slot in self._chosen("reset_alarm", alarm_id):
            assert slot.alarm is not None
            changes.append(self._change(slot, Level.OK, f"{_plain(slot.alarm)}: reset{by}"))
            slot.recent.clear()
            slot.shows, slot.component, slot.strongest = Level.OK, "", None
        self._forget()
        return changes

    def reset(self, t_ns: int, sample: int, why: str) -> list[Alarm]:
        """Take back all alarms, for instance because the stream began again."""
        self._t_ns, self._sample = t_ns, sample
        changes = [self._change(slot, Level.OK, why) for slot in self._active()]
        self._slots.clear()
        self._state_sent_ns = None
        return changes

    def state(self, note: str = "", stale: bool = False) -> AlarmState:
        """All alarms that are not OK, as of the last window judged."""
        active = tuple(slot.alarm for slot in self._active() if slot.alarm is not None)
        level = max((alarm.level for alarm in active), default=Level.OK)
        return AlarmState(self._t_ns, self.frame_id, self.source, level, stale, note, self._sample, active)

    def state_due(self) -> bool:
        """True if 10 s of stream time passed since it was last true, or it never was."""
        due = self._state_sent_ns is None or self._t_ns - self._state_sent_ns >= self.STATE_PERIOD_NS
        if due:
            self._state_sent_ns = self._t_ns
        return due

    def _active(self) -> list[_Slot]:
        return [slot for _, slot in sorted(self._slots.items()) if slot.level > Level.OK]

    def _chosen(self, where: str, alarm_id: str) -> list[_Slot]:
        active = self._active()
        if not alarm_id:
            return active
        chosen = [slot for slot in active if slot.alarm is not None and slot.alarm.alarm_id == alarm_id]
        if not chosen:
            names = [slot.alarm.alarm_id for slot in active if slot.alarm is not None]
            expected = f"one of {', '.join(names)}" if names else "nothing: no alarm is active"
            raise InputError(where, "alarm_id", alarm_id, expected)
        return chosen

    def _supported(self, slot: _Slot) -> Level:
        """The level that the last windows support, with hysteresis around the one they did."""
        limits, settings = self.thresholds, self.settings
        last = list(slot.recent)
        recent = [_significance(i) for i in last[-settings.of_windows :] if i is None or i.may_raise]
        calm = [_significance(i) for i in last[-settings.clear_windows :]]

        def reached(limit: float) -> bool:
            return sum(s >= limit for s in recent) >= settings.raise_windows

        def left(limit: float) -> bool:
            return len(calm) == settings.clear_windows and all(s < limit for s in calm)

        if reached(limits.error):
            return Level.ERROR
        if reached(limits.warn):
            return max(slot.shows, Level.WARN)
        if slot.shows > Level.OK and left(limits.clear):
            return Level.OK
        if slot.shows == Level.ERROR and left(limits.warn):
            return Level.WARN
        return slot.shows

    def _follow(self, slot: _Slot, shows: Level) -> list[Alarm]:
        """Take what the windows support now; the level told follows unless it is latched."""
        before, slot.shows = slot.shows, shows
        held = self.settings.latch.holds(slot.level) and not slot.acknowledged
        if shows > slot.level or (shows < slot.level and not held):
            return [self._change(slot, shows)]
        turned = shows != before and Level.OK in (shows, before)
        if slot.level > Level.OK and (turned or self._more_is_known(slot)):
            return [
                self._change(slot, slot.level)
            ]  # latched, and its cause has gone or come back; or a detail
        return []

    def _more_is_known(self, slot: _Slot) -> bool:
        """True when the latest window brings a detail that the alarm was told without."""
        latest = slot.recent[-1]
        if slot.shows == Level.OK or slot.detail or latest is None:
            return False
        return bool(latest.detail) and latest.component == slot.component

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
        return [taken_back, self._change(slot, level)]

    def _change(self, slot: _Slot, level: Level, why: str = "") -> Alarm:
        deciding, shows = self._deciding(slot), slot.shows
        if slot.level == Level.OK:
            slot.component = _best_component(slot)
        if level > slot.level or level == Level.OK:
            slot.acknowledged, slot.operator = False, ""
        base = deciding if deciding is not None else slot.strongest
        assert base is not None
        shown = level > Level.OK and shows > Level.OK and level >= slot.level
        if shown and deciding is not None:
            slot.strongest = deciding
        slot.detail = (slot.detail or self._detail(slot)) if level > Level.OK else ""
        previous, slot.level = slot.level, level
        reason = why or (base.words + slot.detail if shown else self._calm_words(base, slot))
        latest = slot.recent[-1] if slot.recent else None
        slot.alarm = Alarm(
            t_ns=self._t_ns,
            frame_id=self.frame_id,
            alarm_id=self._name(slot.component, base),
            source=self.source,
            component=slot.component,
            fault=base.fault,
            channel=base.channel,
            level=level,
            previous_level=previous,
            expected_order=base.expected_order,
            found_order=base.found_order,
            found_frequency_hz=base.found_frequency_hz,
            value=base.significance if shown else _significance(latest),
            threshold=self._limit(level, shown),
            unit=UNIT,
            confidence=base.confidence,
            sample=self._sample,
            reason=reason,
            present=level > Level.OK and shows > Level.OK,
            acknowledged=slot.acknowledged,
            acknowledged_by=slot.operator,
        )
        return slot.alarm

    def _detail(self, slot: _Slot) -> str:
        """The latest detail of the component that is named."""
        known = (i.detail for i in reversed(slot.recent) if i is not None and i.component == slot.component)
        return next((detail for detail in known if detail), "")

    def _limit(self, level: Level, shown: bool) -> float:
        limits = self.thresholds
        if shown:
            return limits.error if level == Level.ERROR else limits.warn
        return limits.clear if level == Level.OK else limits.warn

    def _name(self, component: str, base: Indication) -> str:
        place = f"/{base.place}" if base.place else ""
        return f"{self.source}/{component or 'machine'}/{base.fault}{place}"

    def _deciding(self, slot: _Slot) -> Indication | None:
        """The strongest of the windows that count for raising, of the component that is named."""
        recent = [i for i in list(slot.recent)[-self.settings.of_windows :] if i is not None and i.may_raise]
        named = [i for i in recent if i.component == (slot.component or _best_component(slot))] or recent
        return max(named, key=lambda i: i.significance, default=None)

    def _calm_words(self, base: Indication, slot: _Slot) -> str:
        fault = base.fault.replace("_", " ")
        what = f"{fault} of {slot.component}" if slot.component else fault
        windows = self.settings.clear_windows
        if slot.shows > Level.OK:
            return f"{what}: weaker in the last {windows} windows"
        held = f"; {slot.level.name} is kept until it is acknowledged" if slot.level > Level.OK else ""
        return f"{what}: not seen in the last {windows} windows{held}"

    def _forget(self) -> None:
        """Drop memories of groups that are OK and showed nothing lately, so that the book stays small."""
        idle = [g for g, s in self._slots.items() if s.level == Level.OK and not any(s.recent)]
        for group in idle:
            del self._slots[group]


def _plain(alarm: Alarm) -> str:
    fault = alarm.fault.replace("_", " ")
    return f"{fault} of {alarm.component}" if alarm.component else fault


def _gone(shows: Level) -> str:
    return "its cause has gone" if shows == Level.OK else f"it has come down to {shows.name} meanwhile"


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
