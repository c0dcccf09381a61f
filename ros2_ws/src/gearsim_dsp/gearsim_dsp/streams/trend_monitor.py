"""Follows all indicators that other nodes publish: against the healthy machine, and over time.

Each `Features` message is judged when it arrives, so no window is waited for. Alarms have no name of a
component: what the indicator was taken from is told, and how far it has gone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from gearsim_dsp.alarms import AlarmSettings, Indication, Thresholds
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.results import Features, Trends, TrendValue
from gearsim_dsp.streams.assembler import WindowAssembler
from gearsim_dsp.streams.baseline import Baseline, BaselineLearner, Key, Standing, speed_step
from gearsim_dsp.streams.feature_kinds import kind_of
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.trend import Slope, TrendHistory
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["TrendMonitor", "TrendSettings"]

_KEEPS = 0.5
_MOST_NAMED = 3
_BACK_S = 5.0


@dataclass(frozen=True, slots=True)
class TrendSettings:
    """Settings of the trend monitor.

    Parameters
    ----------
    learn_s : float
        Stream time that a baseline is learnt from.
    learn_at_start : bool
        Whether learning begins with the stream where no baseline is given.
    hop_s : float
        Distance of the windows that the indicators come from; only the arithmetic of false alarms uses it.
    publish_s : float
        Stream time between two reports of all trends.
    sources : tuple of str
        Nodes whose indicators can raise alarms; all others are followed only.
    """

    learn_s: float = 60.0
    learn_at_start: bool = True
    hop_s: float = 0.5
    publish_s: float = 10.0
    sources: tuple[str, ...] = ("envelope", "kurtosis")

    def __post_init__(self) -> None:
        for name, low, high in (("learn_s", 1.0, 1e7), ("hop_s", 0.01, 3600.0), ("publish_s", 0.1, 3600.0)):
            value = getattr(self, name)
            if not low <= value <= high:
                raise InputError("trend settings", name, value, f"{low:g} to {high:g} s")


@dataclass(slots=True)
class _Series:
    history: TrendHistory
    unit: str
    step: int = 0


class TrendMonitor:
    """Judges and follows indicators; holds at most `MOST_SERIES` of them.

    Parameters
    ----------
    machine : Machine
    settings : TrendSettings
    source : str
        Name in what is published.
    baseline : Baseline, optional
        What is known of the healthy machine.
    alarms : AlarmSettings, optional
        Those that the alarms are raised by: the limit told beside a trend is that of WARN.
    """

    MOST_SERIES = 4000

    def __init__(
        self,
        machine: Machine,
        settings: TrendSettings | None = None,
        source: str = "trend",
        baseline: Baseline | None = None,
        alarms: AlarmSettings | None = None,
    ) -> None:
        self.machine = machine
        self.settings = settings or TrendSettings()
        self.source = source
        self.assembler: WindowAssembler | None = None
        self.alarms = alarms or AlarmSettings()
        self.baseline = baseline
        self.learnt: Baseline | None = None
        self.ignored = 0
        self._series: dict[Key, _Series] = {}
        self._learner: BaselineLearner | None = None
        self._learn_s = self.settings.learn_s
        self._extend = False
        self._began_ns: int | None = None
        self._t_ns = 0
        self._sample = 0
        self._latest: dict[str, int] = {}
        self._warn = math.nan
        self._sent_ns: int | None = None
        self._run = 0
        self._why_none = ""
        if baseline is None and self.settings.learn_at_start:
            self.learn()

    @property
    def hop_s(self) -> float:
        """Distance of two windows."""
        return self.settings.hop_s

    @property
    def learning(self) -> bool:
        """True while a baseline is being learnt."""
        return self._learner is not None

    @property
    def baseline_words(self) -> str:
        """State of the baseline in words."""
        if self._learner is not None:
            done = 0.0 if self._began_ns is None else (self._t_ns - self._began_ns) / 1e9
            return f"learning {done:.0f} of {self._learn_s:g} s"
        if self.baseline is not None:
            return f"learnt from {self.baseline.seconds:.0f} s"
        return self._why_none or "none"

    def learn(self, seconds: float = 0.0, *, extend: bool = False) -> None:
        """Learn a baseline from now on, beside what is known or in its place; 0 s: as the settings say.

        Raises
        ------
        InputError
            When the time is not positive and finite.
        """
        wanted = seconds or self.settings.learn_s
        if not (math.isfinite(wanted) and wanted > 0):
            raise InputError("learn_baseline", "seconds", seconds, "a finite time above 0 s, or 0")
        self._learn_s, self._extend = wanted, extend
        self._learner = BaselineLearner(self.machine.name)
        self._began_ns = None

    def disturb(self, why: str) -> bool:
        """Something speaks against the machine's being healthy: give up learning; True if it was going on."""
        if self._learner is None:
            return False
        self._learner = None
        self._why_none = f"none: learning was given up, {why}"
        return True

    def push(self, features: Features) -> list[Report]:
        """Take the indicators of one channel over one window; return the report that follows."""
        if features.frame_id not in ("", self.machine.name):
            self.ignored += 1
            return []
        last_ns = features.t0_ns + round((features.sample_count - 1) * 1e9 / features.sample_rate_hz)
        if last_ns < self._latest.get(features.source, last_ns) - _BACK_S * 1e9:
            self._restart()
        self._latest[features.source] = last_ns
        self._t_ns = max(self._t_ns, last_ns)
        self._sample = max(self._sample, features.first_sample + features.sample_count - 1)
        step = speed_step(features.speed_hz)
        for key, value in _values(features):
            self._take(key, step, value, last_ns, features)
        self._learn_on()
        judged = self._judgeable(features)
        trends = self._trends_due()
        if not judged and trends is None:
            return []
        standings = self._standings(features, step) if judged and self.baseline is not None else []
        known = bool(standings)
        return [
            Report(
                run=self._run,
                first_sample=features.first_sample,
                end_sample=features.first_sample + features.sample_count,
                last_ns=self._t_ns,
                frame_id=self.machine.name,
                features=(),
                spectra=(),
                indications=_indications(_scope(features), features, standings) if known else (),
                tests=max(self.baseline.tests, 1) if self.baseline is not None else 1,
                judged=known,
                note="" if known or not judged else self._why_not(features),
                quality=tuple[QualityIssue, ...](),
                scope=_scope(features),
                trends=trends,
                passed=not judged,
            )
        ]

    def finish(self) -> list[Report]:
        """The end of the input: nothing waits."""
        return []

    def trends(self) -> Trends:
        """All indicators as they stand now."""
        if self.baseline is not None:
            self._warn = Thresholds.derive(self.alarms, max(self.baseline.tests, 1), self.hop_s).warn
        rows = tuple(self._row(key, series) for key, series in sorted(self._series.items()))
        words = self.baseline_words
        return Trends(self._t_ns, self.machine.name, self.source, self._sample, words, rows)

    def _restart(self) -> None:
        self._run += 1
        self._t_ns = self._sample = 0
        self._latest.clear()
        self._series.clear()
        self._sent_ns = None
        if self._learner is not None:
            self.learn(self._learn_s, extend=self._extend)

    def _take(self, key: Key, step: int, value: float, t_ns: int, features: Features) -> None:
        series = self._series.get(key)
        if series is None:
            if len(self._series) >= self.MOST_SERIES:
                self.ignored += 1
                return
            block_s = 2.0 * features.sample_count / features.sample_rate_hz
            unit = next(v.unit for v in features.values if (v.component, v.name) == key[2:])
            series = self._series[key] = _Series(TrendHistory(block_s), unit)
        series.step = step
        series.history.add(t_ns * 1e-9, value)
        if self._learner is not None:
            if self._began_ns is None:
                self._began_ns = t_ns
            self._learner.add(key, step, value)

    def _learn_on(self) -> None:
        if self._learner is None or self._began_ns is None:
            return
        seconds = (self._t_ns - self._began_ns) / 1e9
        if seconds < self._learn_s:
            return
        learner, self._learner = self._learner, None
        try:
            found = learner.finish(seconds)
        except InputError as error:
            self._why_none = f"none: {error}"
            return
        keep = self.baseline if self._extend else None
        self.baseline = self.learnt = found if keep is None else keep.extended(found)

    def _judgeable(self, features: Features) -> bool:
        wanted = features.source in self.settings.sources
        return wanted and any(kind_of(value.name).judged for value in features.values)

    def _standings(self, features: Features, step: int) -> list[tuple[Key, float, Standing]]:
        assert self.baseline is not None
        found = []
        for key, value in _values(features):
            standing = self.baseline.standing(key, step, value) if kind_of(key[3]).judged else None
            if standing is not None:
                found.append((key, value, standing))
        return found

    def _why_not(self, features: Features) -> str:
        if self.baseline is None:
            return f"no baseline to judge by: {self.baseline_words}"
        speeds = ", ".join(f"{speed:.3g}" for speed in self.baseline.speeds_hz())
        at = f"{features.speed_hz:.3g} Hz" if math.isfinite(features.speed_hz) else "an unknown speed"
        return f"no baseline at {at}: it was learnt near {speeds} Hz"

    def _trends_due(self) -> Trends | None:
        if self._sent_ns is not None and self._t_ns - self._sent_ns < self.settings.publish_s * 1e9:
            return None
        self._sent_ns = self._t_ns
        return self.trends()

    def _row(self, key: Key, series: _Series) -> TrendValue:
        now, slope = series.history.latest, series.history.slope()
        standing, limit = None, math.nan
        if self.baseline is not None:
            standing = self.baseline.standing(key, series.step, now)
            limit = self.baseline.limit(key, series.step, self._warn)
        return TrendValue(
            source=key[0],
            channel=key[1],
            component=key[2],
            name=key[3],
            unit=series.unit,
            value=now,
            expected=standing.expected if standing else math.nan,
            limit=limit,
            deviation=standing.deviation if standing else math.nan,
            slope=slope.value,
            slope_low=slope.low,
            slope_high=slope.high,
            direction=slope.direction,
            hours_to_limit=hours_to(now, limit, slope),
            span_s=series.history.span_s,
        )


def hours_to(now: float, limit: float, slope: Slope) -> float:
    """Hours until `now` reaches `limit` at the median slope: 0 beyond it, infinite where nothing rises."""
    if math.isnan(limit) or math.isnan(now):
        return math.nan
    if now >= limit:
        return 0.0
    if slope.direction == "unknown":
        return math.nan
    return (limit - now) / slope.value if slope.direction == "rising" else math.inf


def _values(features: Features) -> list[tuple[Key, float]]:
    stem = (features.source, features.channel)
    return [((*stem, value.component, value.name), value.value) for value in features.values]


def _scope(features: Features) -> str:
    """Name of what one message speaks of; a channel may have several messages for a window."""
    return f"{features.source}/{features.channel}/{features.values[0].name if features.values else ''}"


def _indications(
    scope: str, features: Features, standings: list[tuple[Key, float, Standing]]
) -> tuple[Indication, ...]:
    """One for the channel, from the indicator that is least probable among those that changed enough."""
    big = [row for row in standings if row[2].size >= _KEEPS]
    if not big:
        return ()
    big.sort(key=lambda row: (row[2].size < 1, -row[2].significance))
    key, value, worst = big[0]
    units = {(v.component, v.name): v.unit for v in features.values}
    told = [_words(k, v, s, units[k[2:]]) for k, v, s in big if s.size >= 1]
    told = told or [_words(key, value, worst, units[key[2:]])]
    more = len(told) - _MOST_NAMED
    words = "; ".join(told[:_MOST_NAMED]) + (f"; and {more} more" if more > 0 else "")
    return (
        Indication(
            component="",
            fault="unknown",
            group=scope,
            channel=features.channel,
            significance=worst.significance,
            confidence=1.0 - min(1.0, 10.0**-worst.significance),
            words=f"{features.channel}: {words}",
            may_raise=worst.size >= 1,
            place=f"{features.source}/{features.channel}",
        ),
    )


def _words(key: Key, value: float, standing: Standing, unit: str) -> str:
    name = key[3].replace("_", " ") + (f" of {key[2]}" if key[2] else "")
    with_unit = "" if unit in ("1", "") else f" {unit}"
    learnt = f"{value:.3g}{with_unit} where the healthy machine has {standing.expected:.3g}"
    ratio = kind_of(key[3]).ratio and standing.expected > 0
    return f"{name} {value / standing.expected:.1f} times as high, {learnt}" if ratio else f"{name} {learnt}"
