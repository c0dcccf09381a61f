"""What the transmission error between two encoders says of a gear pair: one bad tooth, worn flanks.

Limits lie beyond what 115 sound random gearboxes reach (tooth over the next one 2.1, over the median 5;
unevenness of one wheel over that of its mate 2.8), see docs/diagnosis.md.

A spall lets a flank drop by micrometres as it rolls over it, a crack lets its tooth yield by some tenths: of
48 teeth found in fitted cases all but three lie on the right side of the limit between the two.
"""

from __future__ import annotations

import math

from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.tooth_errors import ToothError
from gearsim_io.nameplate import GearMesh

__all__ = ["bad_tooth_of_mesh", "spall_probability", "stands_out", "worn_wheel_of_mesh"]

WITNESS = "transmission error"
_OVER_REST = 3.0
_OVER_MEDIAN = 9.0
_LOG10_CHANCE = -1.0
_SPALL_OVER_MEDIAN = 43.0
_SPALL_SLOPE = 3.0
_UNEVEN_OVER_MATE = 3.4
_SEVERE, _MODERATE = 150.0, 30.0


def stands_out(tooth: ToothError) -> bool:
    """True where one tooth is none of the others' kind."""
    event = tooth.event
    return (
        event.over_rest >= _OVER_REST
        and event.over_median >= _OVER_MEDIAN
        and event.log10_chance <= _LOG10_CHANCE
    )


def spall_probability(tooth: ToothError) -> float:
    """Of a tooth that stands out: a spall rather than a crack."""
    odds = math.exp(_SPALL_SLOPE * math.log(tooth.event.over_median / _SPALL_OVER_MEDIAN))
    return odds / (1.0 + odds)


def bad_tooth_of_mesh(
    measured: Measured, mesh: GearMesh, teeth: tuple[ToothError, ...], channel: str
) -> Finding | None:
    """A cracked or spalled tooth of the wheel on which it stands out more.

    Parameters
    ----------
    measured : Measured
    mesh : GearMesh
    teeth : tuple of ToothError
        Of both wheels.
    channel : str
        An accelerometer near by, for pictures.
    """
    standing = [one for one in teeth if stands_out(one)]
    if not standing:
        return None
    tooth = min(standing, key=lambda one: one.event.log10_chance)
    event, spall = tooth.event, spall_probability(tooth)
    fault = "gear_tooth_spall" if spall >= 0.5 else "gear_tooth_crack"
    sure = max(spall, 1.0 - spall)
    features = {
        "over_rest": math.log(event.over_rest / _OVER_REST),
        "over_median": math.log(event.over_median / _OVER_MEDIAN),
        "improbable": min(-event.log10_chance, 30.0) / 10.0,
        "kind": math.log(sure / max(1.0 - sure, 1e-3)),
    }
    evidence: dict[str, object] = {
        **_evidence(measured, mesh, tooth, channel, features),
        "tooth_angle_turns": event.place,
        "tooth_over_others": event.over_rest,
        "tooth_over_median": event.over_median,
        "deviation_of_pitch": event.size_of_pitch,
    }
    severity = _severity(event.over_median, _MODERATE, _SEVERE)
    ratio = measured.machine.shaft(tooth.shaft).ratio
    snr_db = 10 * math.log10(event.over_median)
    return _finding(
        measured, _wheel(mesh, tooth), fault, ratio, snr_db, severity, channel, features, evidence
    )


def worn_wheel_of_mesh(
    measured: Measured, mesh: GearMesh, teeth: tuple[ToothError, ...], channel: str
) -> Finding | None:
    """The wheel whose teeth are far more uneven than its mate's; parameters as above.

    Both wheels are heard through the same shafts and couplings, which the ratio does not feel. Of wheels of
    one speed, or of whole multiples, nothing can be said: the slower one's average holds all that the faster
    one does.
    """
    small, large = sorted((mesh.driving_teeth, mesh.driven_teeth))
    if len(teeth) != 2 or large % small == 0 or any(stands_out(one) for one in teeth):
        return None
    worn, mate = sorted(teeth, key=lambda one: -one.event.unevenness)
    over_mate = worn.event.unevenness / max(mate.event.unevenness, 1e-12)
    if over_mate < _UNEVEN_OVER_MATE:
        return None
    features = {"over_mate": math.log(over_mate / _UNEVEN_OVER_MATE)}
    evidence = _evidence(measured, mesh, worn, channel, features)
    evidence |= {"uneven_of_pitch": worn.event.unevenness, "uneven_over_mate": over_mate}
    severity = _severity(over_mate, 2 * _UNEVEN_OVER_MATE, 4 * _UNEVEN_OVER_MATE)
    order = measured.machine.shaft(worn.shaft).ratio * worn.teeth
    snr_db = 20 * math.log10(over_mate)
    component = _wheel(mesh, worn)
    return _finding(measured, component, "gear_wear", order, snr_db, severity, channel, features, evidence)


def _wheel(mesh: GearMesh, tooth: ToothError) -> str:
    """The mesh where both of its wheels turn at one speed."""
    if mesh.driving_teeth == mesh.driven_teeth:
        return mesh.name
    small = min(mesh.driving_teeth, mesh.driven_teeth)
    return f"{mesh.name}.{'pinion' if tooth.teeth == small else 'gear'}"


def _severity(size: float, moderate: float, severe: float) -> str:
    return "severe" if size >= severe else "moderate" if size >= moderate else "slight"


def _evidence(
    measured: Measured, mesh: GearMesh, tooth: ToothError, channel: str, features: dict[str, float]
) -> dict[str, object]:
    return {
        "channel": channel,
        "witness": WITNESS,
        "encoders": [mesh.driving_shaft, mesh.driven_shaft],
        "turns_averaged": tooth.turns,
        "mesh": mesh.name,
        "frequency_hz": measured.machine.shaft(tooth.shaft).ratio * measured.speed.value_hz,
        "speed_source": measured.speed.source,
        "features": features,
    }


def _finding(
    measured: Measured,
    component: str,
    fault: str,
    order: float,
    snr_db: float,
    severity: str,
    channel: str,
    features: dict[str, float],
    evidence: dict[str, object],
) -> Finding:
    return Finding(
        component,
        fault,
        order,
        order,
        order * measured.speed.value_hz,
        snr_db,
        confidence(fault, features),
        severity,
        channel,
        evidence,
    )
