"""What a monitor says of one window of all channels, and what becomes of it in alarms."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from gearsim_dsp.alarm_book import AlarmBook
from gearsim_dsp.alarms import AlarmSettings, Indication, Judgement, Thresholds
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.results import Alarm, AlarmState, Features, Level, Spectrum, Trends
from gearsim_dsp.streams.assembler import WindowAssembler
from gearsim_io.nameplate import Machine

__all__ = ["AlarmedMonitor", "Monitor", "Outcome", "Report"]

_MOST_NOTES = 3


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """All that a monitor found in one window.

    Parameters
    ----------
    run : int
        Start of the stream that the window belongs to.
    first_sample, end_sample : int
    last_ns : int
        Time of the window's last sample.
    frame_id : str
    features, spectra : what is to be published, for each channel that could be judged.
    indications : tuple of Indication
        Signs of faults, at most one for each group.
    tests : int
        Statistical tests made in this window (groups times channels), for the alarms' thresholds.
    judged : bool
        False when no channel could be judged; then the window says nothing about any fault.
    note : str
        What stood in the way, for people; empty if nothing.
    quality : tuple of QualityIssue
    results : tuple
        The analysis itself (`window.WindowResult` of each channel), for those who combine windows.
    scope : str
        What the groups that this report speaks of begin with; empty: it speaks of all.
    passed : bool
        True when nothing was to be judged here, so that alarms and their state stay as they are.
    trends : Trends or None
        Trends to be published.
    """

    run: int
    first_sample: int
    end_sample: int
    last_ns: int
    frame_id: str
    features: tuple[Features, ...]
    spectra: tuple[Spectrum, ...]
    indications: tuple[Indication, ...]
    tests: int
    judged: bool
    note: str
    quality: tuple[QualityIssue, ...]
    results: tuple[Any, ...] = ()
    scope: str = ""
    passed: bool = False
    trends: Trends | None = None


class Monitor(Protocol):
    """A streaming analysis: batches (or indicators) in, reports out, no clock."""

    source: str
    machine: Machine

    @property
    def assembler(self) -> WindowAssembler | None:
        """Where windows are made of samples, None where none are."""
        ...

    @property
    def hop_s(self) -> float:
        """Distance of two windows, in seconds of signal."""
        ...

    def push(self, batch: Any) -> list[Report]:
        """Take one batch, in any interleaving; return the reports of the windows that are complete now."""
        ...

    def finish(self) -> list[Report]:
        """The end of the input: reports of the windows that still waited for something."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """A report with the changes of alarms it leads to.

    `present` is the alarm state after it; `state_due` is true when that is to be published: on every change
    and at least every 10 s of the stream.
    """

    report: Report
    alarms: tuple[Alarm, ...]
    present: AlarmState
    state_due: bool


class AlarmedMonitor:
    """A monitor and its alarms.

    Parameters
    ----------
    monitor : Monitor
    settings : AlarmSettings
    """

    def __init__(self, monitor: Monitor, settings: AlarmSettings | None = None) -> None:
        self.monitor = monitor
        self.settings = settings or AlarmSettings()
        self._book: AlarmBook | None = None
        self._run = 0
        self._tests = 0
        self._notes: dict[str, str] = {}  # by scope: why it cannot be judged; empty where it can

    @property
    def assembler(self) -> WindowAssembler | None:
        """Where the monitor's windows are made, with the counts of gaps and the like."""
        return self.monitor.assembler

    def push(self, batch: Any) -> list[Outcome]:
        """Take one batch; return what became of the windows that are complete now."""
        return [self._outcome(report) for report in self.monitor.push(batch)]

    def finish(self) -> list[Outcome]:
        """The end of the input."""
        return [self._outcome(report) for report in self.monitor.finish()]

    @property
    def present(self) -> AlarmState:
        """The alarms after the last window."""
        if self._book is None:
            frame_id = self.monitor.machine.name
            return AlarmState(0, frame_id, self.monitor.source, Level.OK, True, "no window judged yet", 0)
        told = dict.fromkeys(note for note in self._notes.values() if note)
        return self._book.state("; ".join(list(told)[:_MOST_NOTES]), all(self._notes.values()))

    def acknowledge(self, alarm_id: str = "", by: str = "") -> list[Alarm]:
        """Take note of an alarm, or of all; see `AlarmBook.acknowledge`."""
        book = self._book or self._empty_book()
        return book.acknowledge(alarm_id, by)

    def clear(self, alarm_id: str = "", by: str = "") -> list[Alarm]:
        """Take an alarm back, or all, and forget what led to it; see `AlarmBook.clear`."""
        book = self._book or self._empty_book()
        return book.clear(alarm_id, by)

    def withdraw(self, why: str) -> list[Alarm]:
        """Take all alarms back, as of the last window judged."""
        if self._book is None:
            return []
        last = self._book.state()
        return self._book.reset(last.t_ns, last.sample, why)

    def _outcome(self, report: Report) -> Outcome:
        if report.passed:
            return Outcome(report, (), self.present, False)
        changes: list[Alarm] = []
        book = self._book
        if book is None or report.tests != self._tests or report.frame_id != book.frame_id:
            changes += self._back(report, "the source changed")
            self._notes.clear()
            self._book = book = self._new_book(report)
        elif report.run != self._run:
            changes += self._back(report, "the stream began again")
            self._notes.clear()
        self._run = report.run
        note = "" if report.judged else report.note
        news = note != self._notes.get(report.scope, "")
        self._notes[report.scope] = note
        if report.judged:
            changes += book.judge(
                Judgement(report.last_ns, report.end_sample - 1, report.indications, report.scope)
            )
        due = book.state_due()
        return Outcome(report, tuple(changes), self.present, due or bool(changes) or news)

    def _back(self, report: Report, why: str) -> list[Alarm]:
        return self._book.reset(report.last_ns, report.end_sample - 1, why) if self._book else []

    def _new_book(self, report: Report) -> AlarmBook:
        self._tests = report.tests
        return self._empty_book(report.frame_id)

    def _empty_book(self, frame_id: str = "") -> AlarmBook:
        thresholds = Thresholds.derive(self.settings, max(self._tests, 1), self.monitor.hop_s)
        return AlarmBook(self.monitor.source, frame_id, self.settings, thresholds)
