"""Gear and shaft indicators of a stream, judged against the healthy machine.

Every window gives the indicators of each channel for the shafts of each speed (`gear_window`). What a sound
gear looks like depends on its teeth, so alarms rest on a learnt baseline alone. An alarm tells whether one
tooth stands out (FM4, M6A, NA4 and NB4 rise: crack, spall) or all of them changed (energy ratio, residual,
sidebands: wear, misalignment, eccentricity), or the lines of a shaft (unbalance, misalignment).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from gearsim_dsp.alarms import Indication
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.features import is_signal
from gearsim_dsp.quality import QualityIssue, check_samples
from gearsim_dsp.results import FeatureValue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window, WindowSettings
from gearsim_dsp.streams.baseline import Baseline, Key, Standing, speed_step
from gearsim_dsp.streams.baseline_keeper import BaselineKeeper
from gearsim_dsp.streams.feature_kinds import kind_of
from gearsim_dsp.streams.gear_window import Place, WheelsResult, analyse_wheels, places_of, thinned
from gearsim_dsp.streams.live_names import LiveNames, looks_like
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.window_speeds import LiveSpeeds
from gearsim_dsp.streams.windowed_monitor import WindowedMonitor, fatal_words
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["GearMonitor", "GearSettings"]

_KEEPS = 0.5
_LOCAL = ("fm4", "m6a", "na4", "nb4")
_SHOWN = 3
_FOLLOWED = 2  # channels that the speed is followed on where there is no tacho
_SURE = 0.8
_MOST_EARLIER = 400


@dataclass(frozen=True, slots=True)
class GearSettings:
    """Settings of the gear monitor.

    Parameters
    ----------
    window : WindowSettings
        Longer windows than other monitors have: an average over 40 turns at 10 Hz.
    learn_s : float
        Stream time that a baseline is learnt from.
    learn_at_start : bool
        Whether learning begins with the stream where no baseline is given.
    """

    window: WindowSettings = field(default_factory=lambda: WindowSettings(window_s=4.0, hop_s=2.0))
    learn_s: float = 120.0
    learn_at_start: bool = True

    def __post_init__(self) -> None:
        if not 1.0 <= self.learn_s <= 1e7:
            raise InputError("gear settings", "learn_s", self.learn_s, "1 to 1e7 s")


@dataclass(slots=True)
class _Reference:
    """Mean variances of residual and envelope while the machine is held to be healthy, for NA4 and NB4."""

    count: int = 0
    residual: float = 0.0
    envelope: float = 0.0

    def add(self, residual: float, envelope: float) -> None:
        self.count = min(self.count + 1, _MOST_EARLIER)
        self.residual += (residual - self.residual) / self.count
        self.envelope += (envelope - self.envelope) / self.count

    def values(self) -> tuple[float, float] | None:
        return (self.residual, self.envelope) if self.count else None


@dataclass(frozen=True, slots=True)
class _Row:
    """One indicator on one channel: value, unit, standing, and where in the turn a tooth stands out."""

    key: Key
    value: float
    unit: str
    standing: Standing | None
    peak_turn: float


class GearMonitor(WindowedMonitor):
    """Judges each window of a stream by the synchronous averages of all shafts.

    Parameters
    ----------
    machine : Machine
        Its shafts and gear meshes say what is averaged. Without tacho and encoder the angle is followed in
        the vibration.
    settings : GearSettings
    source : str
        Name in what is published.
    baseline : Baseline, optional
        What is known of the healthy machine.
    """

    def __init__(
        self,
        machine: Machine,
        settings: GearSettings | None = None,
        source: str = "gear",
        baseline: Baseline | None = None,
    ) -> None:
        self.settings = settings or GearSettings()
        super().__init__(machine, self.settings.window, source)
        self.keeper = BaselineKeeper(
            machine.name, self.settings.learn_s, baseline, self.settings.learn_at_start
        )
        self._places = places_of(machine)
        self._names = LiveNames(machine)
        self._references: dict[tuple[str, str, int], _Reference] = {}
        self._speeds = LiveSpeeds(machine, follow=False)

    def _restart(self) -> None:
        self.keeper.restart()
        self._names.reset()

    def _judge(self, window: Window) -> Report:
        speed = self._speeds.of(window)
        if speed.phase is None:
            speed = self._followed(window, speed)
        quality: list[QualityIssue] = []
        rows: list[_Row] = []
        why = self._why_not(speed)
        for index, channel in enumerate(window.channels if not why else ()):
            issues = check_samples(window.data[index], channel)
            quality += issues
            if any(issue.fatal for issue in issues):
                continue
            try:
                rows += self._channel(window, index, speed)
            except InputError as error:
                why = f"{error}; a longer window_s helps"
        self.keeper.advance(window.last_ns)
        known = [row for row in rows if row.standing is not None]
        return self._report(
            window,
            features=(
                self._features(window, channel, _values(rows, channel), speed) for channel in _channels(rows)
            ),
            indications=self._told(window, speed, known),
            tests=self.keeper.tests,
            judged=bool(known),
            note=why or fatal_words(quality) or self.keeper.why_not(speed.value_hz, self.source),
            quality=quality,
        )

    def _told(self, window: Window, speed: ShaftSpeed, known: list[_Row]) -> tuple[Indication, ...]:
        """What is different, and what it looks like."""
        found = _indications(known)
        if not any(sign.may_raise for sign in found):
            self._names.reset()
            return found
        names = self._names.of(window, speed)
        return tuple(replace(one, words=one.words + looks_like(one.component, names)) for one in found)

    def _followed(self, window: Window, speed: ShaftSpeed) -> ShaftSpeed:
        """Angle and speed found in the vibration of the window, where it gives them with confidence."""
        fit = [samples for samples in window.data if is_signal(samples)]
        if not fit or not any(place.wheels for place in self._places):
            return speed
        try:
            signals = np.stack(fit[:_FOLLOWED])
            track = track_speed(signals, window.sample_rate_hz, self.machine)
        except InputError as error:
            return replace(speed, note=str(error))
        if track.confidence >= _SURE:
            return track.shaft_speed()
        doubt = f"the vibration tells the speed with a confidence of {track.confidence:.1f} only"
        return replace(speed, note=f"no angle signal, and {doubt}")

    def _why_not(self, speed: ShaftSpeed) -> str:
        if not any(place.wheels for place in self._places):
            return "the nameplate lists no gears: nothing can be averaged"
        if speed.phase is None:
            return f"no angle of the shafts in this window: {speed.note or 'no tacho and no encoder'}"
        return ""

    def _channel(self, window: Window, index: int, speed: ShaftSpeed) -> list[_Row]:
        assert speed.phase is not None
        channel, step = window.channels[index], speed_step(speed.value_hz)
        samples, phase = thinned(
            window.data[index], window.sample_rate_hz, speed.phase, self.machine, speed.value_hz
        )
        rows: list[_Row] = []
        for place in self._places:
            reference = self._references.setdefault((channel, place.label, step), _Reference())
            result = analyse_wheels(samples, phase, place, window.unit, reference.values())
            healthy = self.keeper.learning or self.keeper.baseline is None
            if place.wheels is not None and (healthy or not reference.count):
                reference.add(*self._healthy_variances(channel, place, step, result))
            rows += self._rows(channel, place, step, result, window.last_ns)
        return rows

    def _healthy_variances(
        self, channel: str, place: Place, step: int, result: WheelsResult
    ) -> tuple[float, float]:
        """Those of this window while nothing better is known, else those that the baseline remembers."""
        assert place.wheels is not None
        learnt = []
        for name in ("residual_rms", "envelope_rms"):
            key = (self.source, channel, place.wheels.label, name)
            standing = self.keeper.standing(key, step, 1.0)
            learnt.append(standing.expected**2 if standing is not None else math.nan)
        now = (result.residual_variance, result.envelope_variance)
        return (learnt[0], learnt[1]) if all(map(math.isfinite, learnt)) else now

    def _rows(self, channel: str, place: Place, step: int, result: WheelsResult, t_ns: int) -> list[_Row]:
        rows = []
        for name, (value, unit) in result.values.items():
            of_shaft = name.startswith("shaft_order") or place.wheels is None
            component = place.label if of_shaft or place.wheels is None else place.wheels.label
            key = (self.source, channel, component, name)
            self.keeper.take(key, step, value, t_ns)
            standing = self.keeper.standing(key, step, value) if kind_of(name).judged else None
            rows.append(_Row(key, value, unit, standing, result.peak_turn))
        return rows


def _channels(rows: list[_Row]) -> list[str]:
    return list(dict.fromkeys(row.key[1] for row in rows))


def _values(rows: list[_Row], channel: str) -> list[FeatureValue]:
    return [FeatureValue(r.key[3], r.key[2], r.value, r.unit) for r in rows if r.key[1] == channel]


def _indications(rows: list[_Row]) -> tuple[Indication, ...]:
    """One for each component, from the indicator of all channels that is least probable."""
    found = []
    for component in dict.fromkeys(row.key[2] for row in rows):
        big = [(row, row.standing) for row in rows if row.standing and row.key[2] == component]
        big = [(row, standing) for row, standing in big if standing.size >= _KEEPS]
        if not big:
            continue
        big.sort(key=lambda pair: (pair[1].size < 1, -pair[1].significance))
        row, worst = big[0]
        found.append(
            Indication(
                component=component,
                fault="unknown",
                group=component,
                channel=row.key[1],
                significance=worst.significance,
                confidence=1.0 - min(1.0, 10.0**-worst.significance),
                words=_words(component, [(r, s) for r, s in big if s.size >= 1] or big[:1]),
                may_raise=worst.size >= 1,
            )
        )
    return tuple(found)


def _words(component: str, told: list[tuple[_Row, Standing]]) -> str:
    """What changed, the strongest first, each indicator once."""
    seen: dict[str, str] = {}
    for row, standing in told:
        name = row.key[3]
        label = name.upper() if name in (*_LOCAL, "fm0") else name.replace("_", " ")
        unit = "" if row.unit == "1" else f" {row.unit}"
        learnt = f"where the healthy machine has {standing.expected:.3g}"
        seen.setdefault(name, f"{label} {row.value:.3g}{unit} on {row.key[1]} {learnt}")
    names = list(seen)
    more = f"; and {len(names) - _SHOWN} more indicators" if len(names) > _SHOWN else ""
    return f"{component}: {_meaning(names, told[0][0])}: {'; '.join(list(seen.values())[:_SHOWN])}{more}"


def _meaning(names: list[str], first: _Row) -> str:
    if names[0].startswith("shaft_order"):
        return f"the line at {names[0][-1]} times the shaft's speed has grown"
    if set(names) & {"fm4", "m6a"}:
        return f"one tooth stands out, at {first.peak_turn:.2f} of the turn"
    return "the teeth as a whole have changed"
