"""All findings of a record: those of every judge, without what one fault only looks like to another judge."""

from __future__ import annotations

import math

from gearsim_dsp.judges.drift import drifting_races
from gearsim_dsp.judges.finding import LEAST_CONFIDENCE, Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.registry import judge_all

__all__ = ["all_findings"]

_SAME_ORDER = 0.012
_SAME_SPEED = 1e-6
_CLEARLY_ITS_OWN = 3.0
# What a shaft that shakes its wheel looks like to the judge of gears.
_SHAKEN_GEARS = ("gear_eccentricity", "gear_wear")
_BY_ENCODERS = "transmission error"
_TOOTH_FAULTS = ("gear_tooth_crack", "gear_tooth_spall", "planet_tooth_crack", "planet_tooth_spall")


def all_findings(measured: Measured, bearings: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """Findings of bearings and of all other judges, the surest first.

    Parameters
    ----------
    measured : Measured
    bearings : tuple of Finding
        What the envelope spectra said.

    Notes
    -----
    Strong impacts of one tooth, once a turn, fill the envelope with the shaft's lines; what a bearing is then
    said to have at a multiple of that speed, or of half of it, is the tooth. A bad tooth also raises the
    unevenness by which wear is judged; the gear judge sees to that itself. So do the impacts of a bearing:
    beside one that is told nothing is said of wear. And as a large spall of an inner race passes the loaded
    zone the shaft yields, at one angle of every turn, which two encoders cannot tell from a soft tooth.
    Where a shaft shakes, teeth part and meet at angles that move, as a race's impacts do.
    """
    others = judge_all(measured)
    shaken = any(one.fault in ("unbalance", "misalignment", "looseness") for one in others)
    bearings = bearings or (() if shaken else drifting_races(measured))
    teeth = [one for one in others if one.fault in _TOOTH_FAULTS]
    kept = [one for one in bearings if not any(_is_teeths_doing(one, tooth, measured) for tooth in teeth)]
    told = [one for one in kept if one.confidence >= LEAST_CONFIDENCE]
    others = tuple(one for one in others if not (told and one.fault == "gear_wear"))
    yields = any(one.fault == "inner_race" and one.severity == "severe" for one in told)
    others = tuple(one for one in others if not (yields and _is_tooth_by_encoders(one)))
    kept += [one for one in others if not (shaken and _is_shaken(one))]
    return tuple(sorted(kept, key=lambda one: -one.confidence))


def _is_shaken(finding: Finding) -> bool:
    """What only looks like a fault of gears: a wheel that is shaken moves along the line of action, too."""
    by_encoders = _is_tooth_by_encoders(finding)
    return finding.fault in _SHAKEN_GEARS or (by_encoders and finding.fault == "gear_tooth_crack")


def _is_tooth_by_encoders(finding: Finding) -> bool:
    return finding.fault in _TOOTH_FAULTS and finding.evidence.get("witness") == _BY_ENCODERS


def _is_teeths_doing(bearing: Finding, tooth: Finding, measured: Measured) -> bool:
    """At a multiple of the tooth's rate; or in a planet, where the carrier's sidebands of it are."""
    if _is_multiple(bearing, tooth) or _is_covered(bearing, tooth, measured):
        return True
    planets = {stage.planet_shaft for stage in measured.machine.planetary_stages}
    inside = measured.machine.bearing(bearing.component).shaft in planets
    dominance = bearing.evidence.get("dominance")
    return (
        inside
        and tooth.fault.startswith("planet_")
        and isinstance(dominance, float)
        and dominance < _CLEARLY_ITS_OWN
    )


def _is_covered(bearing: Finding, tooth: Finding, measured: Measured) -> bool:
    """Lines that the record does not part from those of the tooth's shaft, which are its impacts'."""
    _, _, shaft = str(bearing.evidence.get("covered_by", "")).partition(" x ")
    return bool(shaft) and math.isclose(
        measured.machine.shaft(shaft).ratio, tooth.found_order, rel_tol=_SAME_SPEED
    )


def _is_multiple(bearing: Finding, tooth: Finding) -> bool:
    """Of the tooth's rate or of half of it: teeth that part at a low load meet harder every other turn."""
    number = round(2.0 * bearing.found_order / tooth.found_order) / 2.0
    return (
        number >= 1 and abs(bearing.found_order / (number * tooth.found_order) - 1.0) < _SAME_ORDER / number
    )
