"""What a record as a whole lets one say beside findings: doubts about orders, rate and nameplate."""

from __future__ import annotations

import math

from gearsim_dsp.bands import LEAST_TURNS
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.shaft import undecided_orders
from gearsim_dsp.judges.unlisted import unlisted_mesh
from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed
from gearsim_dsp.stated_rate import doubt_of_rate
from gearsim_io.nameplate import Machine
from gearsim_io.numbers import number
from gearsim_io.record import Record
from gearsim_io.stated_speed import given_far_off, origin_words

__all__ = ["LEAST_WINDOW_S", "record_remarks", "speed_remarks", "too_short", "what_is_lacking"]

LEAST_WINDOW_S = 0.05
"""Shortest window that is looked at."""


def record_remarks(record: Record, measured: Measured) -> list[QualityIssue]:
    """Orders that may be hum, a sampling rate that may be wrong, gears that nobody listed.

    Parameters
    ----------
    record : Record
    measured : Measured
        Its channels and speed.
    """
    remarks = list(undecided_orders(measured))
    rate = doubt_of_rate(record, measured.machine, measured.speed)
    remarks += [rate] if rate else []
    mesh = None if _has_parts(measured.machine) else unlisted_mesh(measured)
    return remarks + ([mesh] if mesh else [])


def speed_remarks(record: Record, machine: Machine, speed: ShaftSpeed) -> list[QualityIssue]:
    """What is to be said of the speed: not known, not measured, off the nameplate, an angle signal mended."""
    issues = []
    nominal, tolerance = machine.nominal_speed_hz, machine.speed_tolerance
    said = origin_words(record.notes, nominal)
    if not math.isfinite(speed.value_hz):
        detail = "no tacho, no nominal speed, and no comb of shaft lines in the signal"
        issues.append(QualityIssue("speed_unknown", "", detail))
    elif speed.source == "nameplate":
        reason = f" ({speed.note})" if speed.note else ""
        detail = f"{said} +- {number(100 * tolerance, 2)} % is taken{reason}"
        issues.append(QualityIssue("speed_not_measured", "", detail))
    elif math.isfinite(nominal) and abs(speed.value_hz / nominal - 1) > tolerance:
        percent = number(100 * (speed.value_hz / nominal - 1), 2, sign=True)
        detail = f"{number(speed.value_hz, 4)} Hz is {percent} % off {said}"
        issues.append(QualityIssue("speed_off_nameplate", "", detail))
    if far := given_far_off(record.notes, tolerance):
        issues.append(QualityIssue("speed_off_nameplate", "", far))
    if speed.source in ("tacho", "encoder") and speed.note:
        issues.append(QualityIssue(f"{speed.source}_mended", "", speed.note))
    return issues


def what_is_lacking(machine: Machine, measured: Measured, seconds: float) -> str:
    """Why nothing could be judged in a record of that length, as far as that is plain; ends a sentence."""
    if not _has_parts(machine):
        return ": the nameplate lists neither bearings nor pairs of gears"
    if least_s := too_short(machine, seconds):
        return f": {number(seconds, 2)} s are too short; {least_s}"
    if not measured.channels:
        return ": no channel is fit for it"
    return "" if measured.phase is not None else ": the angle is not known"


def too_short(machine: Machine, seconds: float) -> str:
    """How long a record must at least be, where that one is not; else empty."""
    nominal = machine.nominal_speed_hz
    least_s = LEAST_TURNS / nominal if math.isfinite(nominal) and nominal > 0 else LEAST_WINDOW_S
    if seconds >= max(least_s, LEAST_WINDOW_S):
        return ""
    turns = f" ({LEAST_TURNS:.0f} turns at {number(nominal, 3)} Hz)" if least_s > LEAST_WINDOW_S else ""
    return f"at least {number(max(least_s, LEAST_WINDOW_S), 2)} s{turns} are needed"


def _has_parts(machine: Machine) -> bool:
    return bool(machine.bearings or machine.gear_meshes or machine.planetary_stages)
