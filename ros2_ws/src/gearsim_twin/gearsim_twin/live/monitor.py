"""The live twin as a monitor: a model beside each window, and alarms where a discrepancy is new.

No model is right, so what it misses of the sound machine is learnt first: the standing discrepancy, per
indicator its mean and scatter over windows. What leaves that is new, be it a fault or a change of load.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from gearsim_dsp.alarms import Indication
from gearsim_dsp.quality import QualityIssue, check_samples
from gearsim_dsp.results import Features, FeatureValue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window, WindowSettings
from gearsim_dsp.streams.baseline import Baseline, Key, Standing, speed_step
from gearsim_dsp.streams.baseline_keeper import BaselineKeeper
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.window_speeds import LiveSpeeds
from gearsim_dsp.streams.windowed_monitor import WindowedMonitor, fatal_words
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record
from gearsim_twin.compare.features import Features as Levelled
from gearsim_twin.compare.features import Plan, features
from gearsim_twin.compare.places import DOMAINS
from gearsim_twin.live.groups import Group, Residual, groups_of, residuals
from gearsim_twin.live.model import LiveModel
from gearsim_twin.view import View

__all__ = ["TwinMonitor", "TwinSettings"]

_KEEPS = 0.5
_MOST_KEPT = 500
_SHOWN = 2
_UNIT = "dB"


@dataclass(frozen=True, slots=True)
class TwinSettings:
    """Settings of the live twin.

    Parameters
    ----------
    window : WindowSettings
        As long as lines of slow shafts need.
    learn_s : float
        Stream time that the standing discrepancy is learnt from.
    learn_at_start : bool
        Whether learning begins with the stream where none is given.
    """

    window: WindowSettings = field(default_factory=lambda: WindowSettings(window_s=4.0, hop_s=2.0))
    learn_s: float = 120.0
    learn_at_start: bool = True

    def __post_init__(self) -> None:
        if not 1.0 <= self.learn_s <= 1e7:
            raise InputError("twin settings", "learn_s", self.learn_s, "1 to 1e7 s")


@dataclass(frozen=True, slots=True)
class _Row:
    """One indicator in one window, and where it stands."""

    key: Key
    residual: Residual
    standing: Standing | None


@dataclass(frozen=True, slots=True, eq=False)
class _Layout:
    """What a stream of one layout is compared by; `kept` is what the model shows, by steps of speed."""

    of: tuple[tuple[str, ...], float, int]
    plan: Plan
    groups: tuple[Group, ...]
    kept: OrderedDict[int, Levelled] = field(default_factory=OrderedDict)

    def modelled(self, model: LiveModel, measured: View) -> Levelled:
        """What the model shows beside a window."""
        step = model.step_of(measured)
        if step is None:
            return features(model.beside(measured), self.plan)
        if step not in self.kept:
            self.kept[step] = features(model.beside(measured), self.plan)
        self.kept.move_to_end(step)
        while len(self.kept) > _MOST_KEPT:
            self.kept.popitem(last=False)
        return self.kept[step]


class TwinMonitor(WindowedMonitor):
    """Judges each window of a stream by a model that runs beside it at the measured speed.

    Parameters
    ----------
    machine : Machine
        Of the stream.
    model : LiveModel
    settings : TwinSettings
    source : str
        Name in what is published.
    baseline : Baseline, optional
        The standing discrepancy, where it was learnt before.

    Raises
    ------
    InputError
        If the model is of another machine.
    """

    def __init__(
        self,
        machine: Machine,
        model: LiveModel,
        settings: TwinSettings | None = None,
        source: str = "twin",
        baseline: Baseline | None = None,
    ) -> None:
        if machine.name != model.machine.name:
            raise InputError(
                "twin", "model", model.name, f"a model of {machine.name}, whose samples the stream has"
            )
        self.settings = settings or TwinSettings()
        super().__init__(machine, self.settings.window, source)
        self.keeper = BaselineKeeper(
            machine.name, self.settings.learn_s, baseline, self.settings.learn_at_start
        )
        self.model = model
        self._speeds = LiveSpeeds(machine)
        self._layout: _Layout | None = None

    def _restart(self) -> None:
        self.keeper.restart()
        self._speeds.reset()

    def _judge(self, window: Window) -> Report:
        speed = self._speeds.of(window)
        quality, bad = _quality(window)
        rows: list[_Row] = []
        why = ""
        try:
            rows = self._rows(window, speed, bad)
        except InputError as error:
            why = str(error)
        self.keeper.advance(window.last_ns)
        known = [row for row in rows if row.standing is not None]
        channels = dict.fromkeys(row.residual.group.channel for row in rows)
        return self._report(
            window,
            features=(self._told_of(window, channel, rows, speed) for channel in channels),
            indications=_indications(known, speed.value_hz),
            tests=self.keeper.tests,
            judged=bool(known),
            note=why or fatal_words(quality) or self.keeper.why_not(speed.value_hz, self.source),
            quality=(*quality, *self._speeds.issues),
        )

    def _rows(self, window: Window, speed: ShaftSpeed, bad: set[str]) -> list[_Row]:
        if self._speeds.lost:
            raise InputError(
                "twin", "speed", "lost in the vibration", "a tacho, or a speed that can be followed"
            )
        layout = self._compared(window)
        names = layout.of[0]
        data = np.stack([_safe(window, name, name in bad) for name in names])
        record = Record(window.sample_rate_hz, names, window.unit, data, machine=self.machine.name)
        measured = View(record, self.model.machine, speed)
        modelled = layout.modelled(self.model, measured)
        found = residuals(layout.groups, features(measured, layout.plan), modelled)
        step = speed_step(speed.value_hz)
        rows = []
        for each in found:
            group = each.group
            if group.channel in bad:
                continue
            key = (self.source, group.channel, group.thing, f"{group.domain}_residual")
            self.keeper.take(key, step, each.value_db, window.last_ns)
            rows.append(_Row(key, each, self.keeper.standing(key, step, each.value_db)))
        return rows

    def _compared(self, window: Window) -> _Layout:
        """What is compared, made anew where the layout of the stream changes."""
        names = self.model.channels(window.channels)
        if not names:
            got = ", ".join(window.channels)
            raise InputError("twin", "channels", got, f"one that {self.model.name} gives")
        of = (names, window.sample_rate_hz, window.sample_count)
        if self._layout is None or self._layout.of != of:
            plan = self.model.plan(names, window.sample_rate_hz, window.sample_count / window.sample_rate_hz)
            self._layout = _Layout(of, plan, groups_of(plan.places))
        return self._layout

    def _told_of(self, window: Window, channel: str, rows: list[_Row], speed: ShaftSpeed) -> Features:
        """The residuals of a channel: of every indicator, and of each domain what is new."""
        mine = [row for row in rows if row.residual.group.channel == channel]
        values = [FeatureValue(row.key[3], row.key[2], row.residual.value_db, _UNIT) for row in mine]
        for domain in DOMAINS:
            new = [_new_db(row) for row in mine if row.residual.group.domain == domain]
            if new:
                level = float(np.sqrt(np.mean(np.square(new))))
                values.append(FeatureValue(f"{domain}_residual_rms", "", level, _UNIT))
        return self._features(window, channel, values, speed)


def _new_db(row: _Row) -> float:
    """What is beyond the standing discrepancy; all of it while that is not known."""
    expected = 0.0 if row.standing is None else row.standing.expected
    return row.residual.value_db - expected


def _quality(window: Window) -> tuple[list[QualityIssue], set[str]]:
    """What is wrong with the samples, and the channels that cannot be judged for it."""
    found: list[QualityIssue] = []
    bad: set[str] = set()
    for samples, channel in zip(window.data, window.channels, strict=True):
        issues = check_samples(samples, channel)
        found += issues
        if any(issue.fatal for issue in issues):
            bad.add(channel)
    return found, bad


def _safe(window: Window, channel: str, bad: bool) -> np.ndarray:
    """The samples of a channel; noise in place of those that cannot be judged, of which nothing is told."""
    if bad:
        return np.random.default_rng(0).standard_normal(window.sample_count).astype(np.float32)
    return np.asarray(window.data[window.channels.index(channel)])


def _indications(rows: Iterable[_Row], speed_hz: float) -> tuple[Indication, ...]:
    """One for each domain, from the indicator of all channels that is least probable."""
    by_domain: dict[str, list[tuple[_Row, Standing]]] = {}
    for row in rows:
        if row.standing is not None and row.standing.size >= _KEEPS:
            by_domain.setdefault(row.residual.group.domain, []).append((row, row.standing))
    found = []
    for domain, told in by_domain.items():
        told.sort(key=lambda pair: (pair[1].size < 1, -pair[1].significance))
        row, worst = told[0]
        found.append(
            Indication(
                component="",
                fault="unknown",
                group=domain,
                channel=row.residual.group.channel,
                significance=worst.significance,
                confidence=1.0 - min(1.0, 10.0**-worst.significance),
                words=_words(domain, [pair for pair in told if pair[1].size >= 1] or told[:1], speed_hz),
                may_raise=worst.size >= 1,
                place=domain,
            )
        )
    return tuple(found)


def _words(domain: str, told: list[tuple[_Row, Standing]], speed_hz: float) -> str:
    """What is new, the surest first: "envelope: line 1 x BPFO ... 21 dB above the model, 1 dB was usual"."""
    seen: dict[str, str] = {}
    # What is new in excess first, as it has a source; what sinks may be drowned by it.
    for row, standing in sorted(told, key=lambda pair: _new_db(pair[0]) < 0):
        value, usual = row.residual.value_db, standing.expected
        side = "above" if value >= 0 else "below"
        plain = f"{abs(value):.0f} dB {side} the model where {usual:+.0f} dB is usual"
        seen.setdefault(row.key[2], f"{row.residual.worst.words(speed_hz)}: {plain}")
    listed = list(seen.values())
    more = f"; and {len(listed) - _SHOWN} more" if len(listed) > _SHOWN else ""
    return f"new in {domain}: {'; '.join(listed[:_SHOWN])}{more}"
