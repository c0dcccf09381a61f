"""The verdict in plain words, and the numbers that carry it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import PurePath

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_dsp.diagnose import Diagnosis
from gearsim_dsp.families import FamilyEvidence
from gearsim_dsp.judges.bearing import ALARM_PROBABILITY, DOMINANCE_LIMIT, MODULATION_LIMIT
from gearsim_dsp.judges.finding import Finding

__all__ = [
    "Row",
    "evidence_rows",
    "family_rows",
    "fault_name",
    "headline",
    "judged_words",
    "meaning",
    "record_line",
    "record_rows",
    "shaft_words",
]

Row = tuple[str, ...]

_MEANING = {
    "outer_race": "The rolling elements run over a damaged place on the outer race, {often}.",
    "inner_race": "A damaged place on the inner race meets the rolling elements {often}; as it turns through "
    "the loaded zone the blows grow and fade once a turn of the shaft.",
    "rolling_element": "A rolling element has a damaged place that strikes the races {often}.",
    "cage": "The vibration swings with the turns of the cage, {often}: cage or uneven elements.",
    "gear_tooth_crack": "One tooth gives way more than the others whenever it carries the load, {often}: a "
    "crack at its root.",
    "gear_tooth_spall": "One tooth has a damaged flank that strikes its mate {often}.",
    "gear_wear": "The flanks are worn all round: the mesh at {hz} Hz is rich in multiples, the teeth differ.",
    "gear_eccentricity": "The wheel turns off its centre: the transmission swings once a turn, at {hz} Hz.",
    "unbalance": "The shaft is out of balance: it shakes at its own speed, {hz} Hz, in every direction.",
    "misalignment": "The shafts do not lie in one line: the coupling works at multiples of {hz} Hz.",
    "looseness": "Something is loose: the pedestal of one bearing rattles at many multiples of {hz} Hz.",
    "planet_tooth_crack": "A tooth of a planet gives way in both of its meshes, {often}: a crack.",
    "planet_tooth_spall": "A tooth of a planet has a damaged flank that strikes {often}.",
    "unknown": "Something strikes {often} that belongs to nothing on the nameplate.",
}
_NAMES = {
    "outer_race": "damaged outer race",
    "inner_race": "damaged inner race",
    "rolling_element": "damaged rolling element",
    "cage": "fault of the cage",
    "gear_tooth_crack": "cracked gear tooth",
    "gear_tooth_spall": "spalled gear tooth",
    "gear_wear": "worn gear teeth",
    "gear_eccentricity": "gear off its axis",
    "planet_tooth_crack": "cracked planet tooth",
    "planet_tooth_spall": "spalled planet tooth",
    "unknown": "fault of unknown origin",
}
_SEVERITIES = ("slight", "moderate", "severe")
_LEAST_DB = 6.0
_SAME = 1e-4


def fault_name(finding: Finding) -> str:
    """Such as "damaged outer race, bearing_1"."""
    what = _NAMES.get(finding.fault, finding.fault.replace("_", " "))
    if finding.fault in ("unbalance", "misalignment"):
        return f"{what}, {shaft_words(finding.component)}"
    return f"{what}, {finding.component}" if finding.component else what


def shaft_words(name: str) -> str:
    """Such as "shaft input", but not "shaft shaft"."""
    return name if name.startswith("shaft") else f"shaft {name}"


def meaning(finding: Finding) -> str:
    """What the fault is, in one sentence, its size if that is known."""
    hz = f"{finding.found_hz:.2f}"
    words = _MEANING.get(finding.fault, "Found at {hz} Hz.").format(hz=hz, often=f"{hz} times a second")
    if finding.size is not None:
        low, high = finding.size.ci95_mm
        words += (
            f" The damaged place is about {finding.size.value_mm:.2g} mm wide ({low:.2g} to {high:.2g} mm)."
        )
    return words


def headline(diagnosis: Diagnosis) -> tuple[str, str, str]:
    """Class of the banner ("fault", "sound", "open"), its words and the sentence below."""
    judged = judged_words(diagnosis)
    count = len(diagnosis.findings)
    if count:
        worst = max(diagnosis.findings, key=lambda one: _SEVERITIES.index(one.severity))
        names = "; ".join(fault_name(one) for one in diagnosis.findings)
        number = "One fault" if count == 1 else f"{count} faults"
        return "fault", f"{number} found: {names}", f"{_worst(worst.severity, count)} {judged}"
    if not diagnosis.judged_parts:
        return "open", "Nothing could be judged", f"{judged} The data quality below says why."
    return "sound", "No fault found", judged


def _worst(severity: str, count: int) -> str:
    return f"{severity.capitalize()}." if count == 1 else f"The worst is {severity}."


def judged_words(diagnosis: Diagnosis) -> str:
    """What was looked at, so that silence does not read as health."""
    parts = diagnosis.judged_parts
    if not parts:
        return "No part of the machine could be looked at."
    listed = parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1]
    return f"Looked at: {listed}."


@dataclass(frozen=True, slots=True)
class _Entry:
    key: str
    label: str
    say: Callable[[float], str]
    limit: str = ""


def _plain(value: float) -> str:
    return f"{value:.3g}"


def _percent(value: float) -> str:
    return f"{100 * value:.3g} %"


def _count(value: float) -> str:
    return f"{value:.0f}"


def _times(value: float) -> str:
    return f"{value:.3g} times"


def _chance(probability: float) -> str:
    if probability >= 0.1:
        return f"{probability:.1g}"
    return "below 1e-30" if probability < 1e-30 else f"{probability:.0e}"


_ENTRIES = (
    _Entry("false_alarm_probability", "chance that noise shows it", _chance, f"below {ALARM_PROBABILITY:g}"),
    _Entry("modulation", "swing of the envelope", _plain, f"{MODULATION_LIMIT:g} or more"),
    _Entry("dominance", "over the strongest unrelated lines", _times, f"{DOMINANCE_LIMIT:g} times or more"),
    _Entry("windows", "windows averaged", _count),
    _Entry("tooth_over_others", "energy of the tooth over that of the next", _times),
    _Entry("tooth_over_median", "energy of the tooth over the usual tooth", _times),
    _Entry("opposite_over_median", "energy half a turn away, over the usual", _times),
    _Entry("others_over_median", "energy of the strongest other tooth, over the usual", _times),
    _Entry("impulses_per_4_carrier_turns", "impulses in four turns of the carrier, by the pattern", _count),
    _Entry("impulses_seen", "of these seen one by one", _count),
    _Entry("planet_turns", "turns of the planet folded", _count),
    _Entry("residual_kurtosis", "kurtosis of the residual", _plain, "3 is noise"),
    _Entry("fm4", "FM4 of the wheel", _plain, "3 is noise"),
    _Entry("turns_averaged", "turns averaged", _count),
    _Entry("uneven_over_regular", "unrest between teeth over the regular mesh", _plain),
    _Entry("mesh_harmonics", "higher mesh harmonics over the first", _plain),
    _Entry("runout_of_pitch", "run-out, of the tooth pitch", _percent),
    _Entry("velocity_mm_s", "vibration velocity, mm/s RMS", _plain),
    _Entry("limit_mm_s", "level from which there is a finding, mm/s RMS", _plain),
)


def evidence_rows(material: Material, finding: Finding) -> list[Row]:
    """What was measured, how much, and the limit that it had to pass."""
    off = 100 * (finding.found_order / finding.expected_order - 1) if finding.expected_order else 0.0
    rows: list[Row] = [
        ("found at", f"{finding.found_hz:.2f} Hz = order {finding.found_order:.4f}", ""),
        ("expected at", f"order {finding.expected_order:.4f} ({off:+.2f} % off)", ""),
        ("over the noise around", f"{finding.snr_db:.0f} dB", ""),
    ]
    if finding.fault == "unknown":
        del rows[1]
    snr = finding.evidence.get("harmonic_snr_db")
    if isinstance(snr, list):
        clear = sum(level >= _LEAST_DB for level in snr)
        listed = ", ".join(f"{level:.0f}" for level in snr)
        rows.append(
            (
                "multiples 1x, 2x ... in dB over the noise",
                f"{listed} ({clear} clear)",
                f"{_LEAST_DB:.0f} dB is clear",
            )
        )
    sides = finding.evidence.get("sideband_snr_db")
    if isinstance(sides, list) and sides:
        rows.append(("their sidebands, dB", ", ".join(f"{level:.0f}" for level in sides), ""))
    for entry in _ENTRIES:
        value = finding.evidence.get(entry.key)
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            rows.append((entry.label, entry.say(float(value)), entry.limit))
    if "band_hz" in finding.evidence:
        low, high = material.band_hz(finding)
        chosen = " (chosen by the kurtogram)" if finding.evidence.get("band_choice") == "kurtogram" else ""
        rows.append(("carrier band", f"{low:.0f} to {high:.0f} Hz{chosen}", ""))
    shares = finding.evidence.get("component_shares")
    if isinstance(shares, dict):
        listed = ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares.items())
        rows.append(("like bearings, share in the blows", listed, ""))
    rows.append(("channel", finding.channel, ""))
    return rows


def family_rows(material: Material) -> list[Row]:
    """Every family of the bearings: where it is expected, how much of it there is; like ones in one row."""
    found = {(one.component, one.fault) for one in material.diagnosis.findings}
    together: dict[Row, list[str]] = {}
    for one in material.evidence():
        hertz = one.family.order * material.speed_hz
        state = "found" if (one.family.component, one.family.fault) in found else _state(material, one)
        row = (
            f"{one.family.fault.replace('_', ' ')} ({one.family.label})",
            f"{one.family.order:.4f}",
            f"{hertz:.2f}" if math.isfinite(hertz) else "not known",
            f"{one.snr_db:.0f}",
            _chance(one.false_alarm_probability),
            f"{one.modulation:.3f}",
            state,
        )
        together.setdefault(row, []).append(one.family.component)
    return [(", ".join(components), *row) for row, components in together.items()]


def _state(material: Material, one: FamilyEvidence) -> str:
    if any(
        finding.fault == one.family.fault and abs(finding.expected_order / one.family.order - 1.0) < _SAME
        for finding in material.diagnosis.findings
        if finding.expected_order
    ):
        return "the same lines, louder at the bearing found"
    if one.false_alarm_probability >= ALARM_PROBABILITY:
        return "nothing"
    return "weak" if one.modulation < MODULATION_LIMIT else "belongs to other lines"


def _small(percent: float) -> str:
    return f"{percent:.2g}" if percent >= 1e-3 else "less than 0.001"


def record_line(material: Material) -> str:
    """The measurement in one line below the machine's name."""
    record, speed = material.record, material.speed_hz
    name = PurePath(material.diagnosis.source).name or "record"
    turning = f", {60 * speed:.0f} rpm" if math.isfinite(speed) else ""
    count = len(record.channels)
    return f"{name}: {record.seconds:.2f} s of {count} channel{'s' if count > 1 else ''}{turning}"


def record_rows(material: Material) -> list[Row]:
    """What was measured and what is known of the machine's speed."""
    record, speed = material.record, material.diagnosis.speed
    rows: list[Row] = [
        ("machine", material.machine.name),
        ("source", material.diagnosis.source or "not stated"),
        ("length", f"{record.seconds:.2f} s at {record.sample_rate_hz:g} Hz"),
        ("channels", f"{', '.join(record.channels)} ({material.unit})"),
    ]
    if math.isfinite(speed.value_hz):
        half = 50 * (speed.ci95_hz[1] - speed.ci95_hz[0]) / speed.value_hz
        nominal = material.diagnosis.nominal_from
        source = {
            "estimated": "found in the vibration",
            "nameplate": "from the nameplate" if nominal == "nameplate" else nominal,
            "tacho": "from the tacho",
            "encoder": "from the encoder",
        }[speed.source]
        per_minute = 60 * speed.value_hz
        rows.append(
            (
                "speed of " + material.machine.reference_shaft,
                f"{speed.value_hz:.3f} Hz = {per_minute:.1f} rpm ± {_small(half)} %, {source}",
            )
        )
    else:
        rows.append(("speed", "not known"))
    rows += [(key, value) for key, value in record.notes.items() if key not in ("speed_hz",)]
    return rows
