"""The diagnosis of a whole record, with the code of the live monitors.

The record goes batch by batch through the envelope and the kurtosis monitor, as a live stream would; what
they found in the single windows is pooled over the record, and the verdict is that of the pooled
evidence.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from gearsim_dsp.angle.record_speed import RecordSpeed, record_speed
from gearsim_dsp.bands import least_window_s
from gearsim_dsp.electrical import ElectricalLines, find_electrical_lines
from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.judges.bearing import Verdict, find_faults
from gearsim_dsp.judges.combine import all_findings
from gearsim_dsp.judges.finding import LEAST_CONFIDENCE, Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.sizes import with_size
from gearsim_dsp.judges.strange import find_strange_comb
from gearsim_dsp.kinematics import mesh_orders
from gearsim_dsp.quality import QualityIssue, check_levels
from gearsim_dsp.remarks import (
    LEAST_WINDOW_S,
    record_remarks,
    speed_remarks,
    too_short,
    what_is_lacking,
)
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.streams.assembler import Window, WindowAssembler, WindowSettings
from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor, EnvelopeSettings
from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor, KurtosisSettings
from gearsim_dsp.streams.report import Report
from gearsim_dsp.streams.window_speeds import KnownSpeeds, LiveSpeeds, WindowSpeeds
from gearsim_io.batches import TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.importers import machine_for
from gearsim_io.nameplate import Machine
from gearsim_io.numbers import number, plural
from gearsim_io.record import Record
from gearsim_io.stated_speed import FROM_FILE, FROM_USER

_IMPACT_PROBABILITY = 1e-4
_NOTHING = "nothing_to_look_for"
_ORIGIN = {FROM_USER: "as given, not measured", FROM_FILE: "as stated in the file, not measured"}

__all__ = ["LEAST_CONFIDENCE", "Diagnosis", "DiagnosisSettings", "diagnose_record"]


@dataclass(frozen=True, slots=True)
class DiagnosisSettings:
    """How the record is cut into windows.

    Parameters
    ----------
    window_s : float
        Length of a window; it is made longer where the shaft needs that for `least_turns`, and shorter where
        the record is.
    least_turns : float
        Turns in a window of the slowest shaft that has bearings: its harmonics must be parted from their
        lines.
    batch_samples : int
        Size of the batches handed to the monitors; it has no influence on the result.
    """

    window_s: float = 2.0
    least_turns: float = 20.0
    batch_samples: int = 8192

    def __post_init__(self) -> None:
        if not (0.1 <= self.window_s <= 60 and 1 <= self.least_turns <= 1000 and self.batch_samples >= 1):
            got = (self.window_s, self.least_turns, self.batch_samples)
            raise InputError(
                "diagnosis settings", "window_s, least_turns, batch_samples", got, "sensible values"
            )


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What is known of a machine after one record; `angle` is that of its reference shaft over the record.

    `doubtful` are those below `LEAST_CONFIDENCE`, which are no findings. `nominal_from` tells in words where
    a speed comes from that was not measured.
    """

    speed: ShaftSpeed
    quality: tuple[QualityIssue, ...]
    findings: tuple[Finding, ...]
    machine: str = ""
    source: str = ""
    verdict: Verdict | None = field(default=None, repr=False, compare=False)
    judged_parts: tuple[str, ...] = ()
    angle: RecordSpeed = field(default=RecordSpeed(None), repr=False, compare=False)
    lacking: str = ""
    doubtful: tuple[Finding, ...] = ()
    nominal_from: str = "nameplate"

    @property
    def judged(self) -> bool:
        """False when nothing on the machine could be judged."""
        return bool(self.judged_parts)

    @property
    def healthy(self) -> bool:
        """True when nothing was found; weak comfort where nothing could be judged."""
        return not self.findings

    def to_json(self) -> dict[str, object]:
        """The object of `diagnose --json`."""
        return {
            "speed_hz": self.speed.to_json(),
            "quality": [issue.to_json() for issue in self.quality],
            "healthy": self.healthy,
            "findings": [finding.to_json() for finding in self.findings],
        }

    def lines(self) -> list[str]:
        """The same for people, line by line."""
        speed = self.speed
        lines = []
        if np.isfinite(speed.value_hz):
            half = 50 * (speed.ci95_hz[1] - speed.ci95_hz[0]) / speed.value_hz
            source = self.nominal_from if speed.source == "nameplate" else speed.source
            lines.append(f"speed: {speed.value_hz:.3f} Hz +- {_error(half)} % ({source})")
        else:
            lines.append("speed: not known")
        lines += [
            f"quality: {q.channel + ': ' if q.channel else ''}{q.issue.replace('_', ' ')}: {q.detail}"
            for q in self.quality
            if not (q.issue == _NOTHING and self.lacking)  # the last line says it
        ]
        lines += [_finding_line(finding) for finding in self.findings]
        if not self.findings:
            # Silence about what was not judged must not read as its health.
            judged = f"no fault found; judged: {', '.join(self.judged_parts)}"
            nothing = f"no fault found: nothing could be judged{self.lacking}"
            lines.append(judged if self.judged else nothing)
        return lines


def _error(percent: float) -> str:
    return number(percent, 2) if percent >= 1e-3 else "less than 0.001"


def _finding_line(finding: Finding) -> str:
    what = f"{finding.fault.replace('_', ' ')} of {finding.component}"
    return (
        f"{what}: {finding.found_hz:.2f} Hz (order {finding.found_order:.4f}, expected "
        f"{finding.expected_order:.4f}), {finding.snr_db:.0f} dB over the floor, {finding.severity}, "
        f"{_size_words(finding)}confidence {finding.confidence:.2f}"
    )


def _doubtful(finding: Finding) -> QualityIssue:
    return QualityIssue("doubtful_finding", finding.channel, _finding_line(finding))


def _size_words(finding: Finding) -> str:
    if finding.size is None:
        return ""
    low, high = finding.size.ci95_mm
    width, low_mm, high_mm = (number(mm, 2) for mm in (finding.size.value_mm, low, high))
    return f"about {width} mm wide ({low_mm} to {high_mm}), "


def diagnose_record(record: Record, machine: Machine, settings: DiagnosisSettings | None = None) -> Diagnosis:
    """Diagnose a record of a machine.

    Parameters
    ----------
    record : Record
    machine : Machine
        Its nominal speed is replaced by the one that the record's file states, if it does.
    settings : DiagnosisSettings, optional

    Returns
    -------
    Diagnosis

    Raises
    ------
    InputError
        When the record has none of the machine's channels or the nameplate is impossible.
    """
    settings = settings or DiagnosisSettings()
    plate = machine_for(record, machine)
    listed = {channel.name for channel in plate.channels}
    if listed and not listed & set(record.channels):
        expected = "a channel of the machine: " + ", ".join(sorted(listed))
        raise InputError(record.source or "record", "channels", ", ".join(record.channels), expected)
    angle = record_speed(record, plate)
    window = _window(record, plate, settings, angle.speed)
    known = KnownSpeeds(angle.speed, record.first_sample) if angle.speed is not None else None
    speeds = known if known is not None and angle.replaces_angle else LiveSpeeds(plate, follow=False)
    pool, reports, impulsive = _by_windows(record, plate, speeds, window, settings.batch_samples)
    verdict = find_faults(plate, pool)
    if verdict.speed.source == "nameplate" and known is not None and speeds is not known:
        # Single windows do not tell the speed, but the whole record does; how impulsive they are stays.
        pool, reports, _ = _by_windows(record, plate, known, window, settings.batch_samples, impulses=False)
        verdict = find_faults(plate, pool)
    speed = angle.speed or verdict.speed
    # Where no window could be judged, the speed of the record is known all the same.
    told = speed if angle.replaces_angle or verdict.speed.source == "nameplate" else verdict.speed
    notes = _quality(record, plate, reports, told)
    # A wrong angle signal is not to be read again.
    sound = replace(record, tachos=(), encoders=()) if angle.replaces_angle else record
    measured = Measured.of_record(sound, plate, speed)
    said = all_findings(measured, verdict.findings)
    findings = tuple(with_size(one, measured) for one in said if one.confidence >= LEAST_CONFIDENCE)
    doubtful = tuple(one for one in said if one.confidence < LEAST_CONFIDENCE)
    notes += [_doubtful(one) for one in doubtful]
    electrical = _electrical_notes(record, plate, verdict, findings)
    if not findings:
        supply = plate.line_frequency_hz or 50.0
        strange = find_strange_comb(plate, pool, (supply, 60.0))
        findings = (strange,) if strange else ()
    notes += record_remarks(record, measured)
    impacts = () if findings else _impacts(impulsive)  # which a finding would explain
    quality = (*angle.issues, *notes, *electrical, *verdict.notes, *impacts)
    return Diagnosis(
        told,
        tuple(dict.fromkeys(quality)),
        findings,
        plate.name,
        record.source,
        verdict,
        _judged_parts(measured, verdict),
        angle,
        what_is_lacking(plate, measured, record.seconds),
        doubtful,
        _ORIGIN.get(record.notes.get("speed from", ""), "nameplate"),
    )


def _by_windows(
    record: Record,
    plate: Machine,
    speeds: WindowSpeeds,
    window: WindowSettings,
    batch_samples: int,
    impulses: bool = True,
) -> tuple[EvidencePool, list[Report], list[Report]]:
    """All windows' evidence, the envelope monitor's reports and, if asked, those of the kurtosis monitor."""
    settings = EnvelopeSettings(window, size_every=0, between=True)
    envelope = EnvelopeMonitor(plate, settings, speeds=speeds, by_window=False)
    kurtosis = KurtosisMonitor(plate, KurtosisSettings(window))
    pool = EvidencePool(plate)
    reports: list[Report] = []
    impulsive: list[Report] = []
    for one in _windows(record, plate, window, batch_samples):
        report = envelope.judge(one)
        pool.add(report.results)
        reports.append(replace(report, results=()))  # or memory would grow with the record
        if impulses:
            impulsive.append(kurtosis.judge(one))
    return pool, reports, impulsive


def _windows(record: Record, plate: Machine, window: WindowSettings, batch_samples: int) -> Iterator[Window]:
    """The windows that a live stream of the record would be cut into, one set for all monitors."""
    assembler = WindowAssembler(plate, window)
    for batch in record.batches(batch_samples):
        if not isinstance(batch, TorqueBatch):
            yield from assembler.push(batch)
    yield from assembler.finish()


def _judged_parts(measured: Measured, verdict: Verdict) -> tuple[str, ...]:
    """Kinds of parts that were looked at; what needs the angle is looked at only where that is known."""
    machine = measured.machine
    parts = ["bearings"] if verdict.evidence else []
    if measured.phase is not None and measured.channels:
        parts += ["gears"] if machine.gear_meshes else []
        parts += ["planets"] if machine.planetary_stages else []
        parts += ["shafts"] if machine.bearings and measured.unit == "m/s^2" else []
    return tuple(parts)


def _window(
    record: Record, machine: Machine, settings: DiagnosisSettings, known: ShaftSpeed | None
) -> WindowSettings:
    """Windows of the length asked for, at most the record's, overlapping by three quarters."""
    length = settings.window_s
    if np.isfinite(machine.nominal_speed_hz):
        slowest = min((machine.shaft(one.shaft).ratio for one in machine.bearings), default=1.0)
        length = max(length, settings.least_turns / (slowest * machine.nominal_speed_hz))
    speed_hz = machine.nominal_speed_hz if known is None else known.value_hz
    if machine.bearings and np.isfinite(speed_hz):
        length = max(length, least_window_s(speed_hz))
    length = float(np.clip(length, LEAST_WINDOW_S, 60.0))
    if record.seconds < length:
        length = max(LEAST_WINDOW_S, np.floor(record.sample_count * 0.999) / record.sample_rate_hz)
    return WindowSettings(window_s=length, hop_s=max(0.01, length / 4), angle_wait_s=0.0)


def _quality(
    record: Record, machine: Machine, reports: list[Report], speed: ShaftSpeed
) -> list[QualityIssue]:
    issues = _merged(reports)
    if not reports:
        least = too_short(machine, record.seconds)
        samples = f"{plural(record.sample_count, 'sample')}, {number(record.seconds, 2)} s"
        issues.append(QualityIssue("too_short", "", f"{samples}{least and f'; {least}'}", True))
    issues += speed_remarks(record, machine, speed)
    issues += check_levels(record, machine)
    if not machine.bearings:
        issues.append(QualityIssue(_NOTHING, "", "the nameplate lists no bearings: none were judged"))
    return issues


def _electrical_notes(
    record: Record, machine: Machine, verdict: Verdict, findings: tuple[Finding, ...]
) -> list[QualityIssue]:
    issues = []
    for row, channel in enumerate(record.channels):
        if np.all(np.isfinite(record.data[row])):
            issues += _line_notes(_electrical(record, row, machine, verdict, findings), channel)
    return issues


def _merged(reports: list[Report]) -> list[QualityIssue]:
    """One entry for each kind of issue of each channel, with the number of windows."""
    found: dict[tuple[str, str], list[QualityIssue]] = defaultdict(list)
    for report in reports:
        for issue in report.quality:
            found[issue.issue, issue.channel].append(issue)
    return [
        QualityIssue(
            kind, channel, f"{items[0].detail} (in {len(items)} of {len(reports)} windows)", items[0].fatal
        )
        for (kind, channel), items in found.items()
    ]


def _electrical(
    record: Record, row: int, machine: Machine, verdict: Verdict, findings: tuple[Finding, ...]
) -> ElectricalLines:
    turn = verdict.speed.value_hz
    lines: list[float] = []
    if np.isfinite(turn):
        lines += [turn * shaft.ratio for shaft in machine.shafts]
        lines += [turn * order for order in mesh_orders(machine).values()]
    lines += [finding.found_hz for finding in findings]
    error = verdict.speed.relative_error if np.isfinite(turn) else 1e-3
    return find_electrical_lines(
        record.data[row], record.sample_rate_hz, machine.line_frequency_hz, lines, max(error, 1e-4)
    )


def _line_notes(lines: ElectricalLines, channel: str) -> list[QualityIssue]:
    notes = []
    if lines.supply_lines_hz:
        listed = ", ".join(f"{f:.1f}" for f in lines.supply_lines_hz[:6])
        detail = f"lines of the {lines.supply_hz:g} Hz supply at {listed} Hz"
        notes.append(QualityIssue("electrical_lines", channel, detail))
    if lines.carriers_hz:
        listed = ", ".join(f"{f:.0f}" for f in lines.carriers_hz)
        detail = f"narrow lines with their doubles, like an inverter's carrier, at {listed} Hz"
        notes.append(QualityIssue("inverter_lines", channel, detail))
    return notes


def _impacts(reports: list[Report]) -> list[QualityIssue]:
    """Impacts in most windows that no fault family explains."""
    channels: dict[str, int] = defaultdict(int)
    for report in reports:
        limit = -np.log10(_IMPACT_PROBABILITY / max(report.tests, 1))
        for indication in report.indications:
            if indication.may_raise and indication.significance >= limit:
                channels[indication.channel] += 1
    return [
        QualityIssue("unexplained_impacts", channel, f"impulsive in {count} of {len(reports)} windows")
        for channel, count in channels.items()
        if 2 * count > len(reports)
    ]
