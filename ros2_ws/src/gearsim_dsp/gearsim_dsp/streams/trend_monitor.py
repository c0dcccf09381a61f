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
from gearsim_dsp.streams.baseline import Baseline, Key, Standing, speed_step
from gearsim_dsp.streams.baseline_keeper import BaselineKeeper
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
        self.keeper = BaselineKeeper(
            machine.name, self.settings.learn_s, baseline, self.settings.learn_at_start
        )
        self.ignored = 0
        self._series: dict[Key, _Series] = {}
        self._t_ns = 0
        self._sample = 0
        self._latest: dict[str, int] = {}
        self._warn = math.nan
        self._sent_ns: int | None = None
        self._run = 0

    @property
    def hop_s(self) -> float:
        """Distance of two windows."""
        return self.settings.hop_s

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
        self.keeper.advance(self._t_ns)
        judged = self._judgeable(features)
        trends = self._trends_due()
        if not judged and trends is None:
            return []
        standings = self._standings(features, step) if judged else []
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
                tests=self.keeper.tests,
                judged=known,
                note="" if known or not judged else self.keeper.why_not(features.speed_hz, features.source),
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
        self._warn = Thresholds.derive(self.alarms, self.keeper.tests, self.hop_s).warn
        rows = tuple(self._row(key, series) for key, series in sorted(self._series.items()))
        words = self.keeper.words
        return Trends(self._t_ns, self.machine.name, self.source, self._sample, words, rows)

    def _restart(self) -> None:
        self._run += 1
        self._t_ns = self._sample = 0
        self._latest.clear()
        self._series.clear()
        self._sent_ns = None
        self.keeper.restart()

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
        self.keeper.take(key, step, value, t_ns)

    def _judgeable(self, features: Features) -> bool:
        wanted = features.source in self.settings.sources
        return wanted and any(kind_of(value.name).judged for value in features.values)

    def _standings(self, features: Features, step: int) -> list[tuple[Key, float, Standing]]:
        found = []
        for key, value in _values(features):
            standing = self.keeper.standing(key, step, value) if kind_of(key[3]).judged else None
            if standing is not None:
                found.append((key, value, standing))
        return found

    def _trends_due(self) -> Trends | None:
        if self._sent_ns is not None and self._t_ns - self._sent_ns < self.settings.publish_s * 1e9:
            return None
        self._sent_ns = self._t_ns
        return self.trends()

    def _row(self, key: Key, series: _Series) -> TrendValue:
        now, slope = series.history.latest, series.history.slope()
        standing = self.keeper.standing(key, series.step, now)
        limit = self.keeper.limit(key, series.step, self._warn)
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
