"""Alarms: when a sign of a fault becomes a level that people are told, and when it is taken back.

All in stream time: an alarm's stamp is that of the last sample that led to it, and equal windows give equal
alarms. Thresholds follow from the false alarms one is ready to bear (`Thresholds.derive`); docs/alarms.md
has the arithmetic. Who keeps the levels is `alarm_book.AlarmBook`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from enum import StrEnum

from gearsim_dsp.results import Alarm, Level
from gearsim_io.errors import InputError

__all__ = ["AlarmSettings", "Indication", "Judgement", "Latch", "Thresholds", "format_alarm"]

UNIT = "-log10 of the false-alarm probability"
_TEN_MINUTES_S = 600.0
_TEN_YEARS_S = 10 * 365.25 * 86400.0
_SECONDS_OF_A_CALENDAR = 1e9


class Latch(StrEnum):
    """Which levels stay until somebody acknowledges them, though their cause has gone."""

    NONE = "none"
    ERROR = "error"
    ALL = "all"

    def holds(self, level: Level) -> bool:
        """True for a level that stays."""
        return level > Level.OK and (self is Latch.ALL or (self is Latch.ERROR and level == Level.ERROR))


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
    latch : Latch
        Levels that stay until they are acknowledged.
    """

    warn_probability: float = 1e-3
    error_probability: float = 1e-3
    clear_probability: float = 0.05
    raise_windows: int = 2
    of_windows: int = 3
    clear_windows: int = 8
    latch: Latch = Latch.NONE

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
    detail : str
        What ends the words once it is known, such as ", about 0.8 mm wide"; an alarm that was raised without
        it is told once more with it.
    place : str
        Last part of the alarm's name where one fault of one component has several alarms, such as a channel.
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
    place: str = ""
    detail: str = ""


@dataclass(frozen=True, slots=True)
class Judgement:
    """One window judged: `indications` hold at most one entry per group; what is absent showed nothing.

    Where a window is judged in parts, `scope` is what the names of the groups judged begin with.
    """

    t_ns: int
    sample: int
    indications: tuple[Indication, ...]
    scope: str = ""


def format_alarm(alarm: Alarm) -> str:
    """One line for people: time of the stream, level, reason, who saw it where.

    Stamps that are a time of day (the source counts from 1970) are shown as such, in UTC.
    """
    seconds = alarm.t_ns / 1e9
    when = f"{seconds:10.2f} s"
    if seconds > _SECONDS_OF_A_CALENDAR:
        when = datetime.fromtimestamp(seconds, UTC).strftime("%H:%M:%S.%f")[:-4] + " UTC"
    return f"{when}  {alarm.level.name:<5}  {alarm.reason}  [{alarm.source}, {alarm.channel}]"
