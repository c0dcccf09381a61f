"""Gears: one bad tooth (crack or spall), teeth worn all round, a wheel off its axis.

From the synchronous average over the turn of each wheel (`gear_signs`):

- a tooth whose difference signal (Stewart's, behind FM4) is far above that of every other tooth is cracked or
  spalled. A pit is a short, hard event; a softer tooth is felt as long as it is in contact, and less. A
  linear discriminant of size, duration and pitch of the event tells the two (see `tooth_kind`);
- worn flanks raise the mesh harmonics, and scatter between the teeth raises the difference signal all round.

Where there are encoders on both shafts of a mesh the transmission error between them is the better witness of
single teeth and of wear (`encoder_gear`): a crack hardly shakes a gearbox, but its tooth yields.

A wheel off its axis hardly shakes a stiff gearbox; it shows in the transmission error between two encoders,
once a turn, in parts of the tooth pitch. Run-out of grade 10 of ISO 1328 is some 0.5 % of it; sound random
gearboxes reach 0.67 %.

Wheels that turn at one speed leave their marks in the same average: the component is then the mesh, not one
of its wheels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.encoder_gear import bad_tooth_of_mesh, worn_wheel_of_mesh
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.gear_signs import ShaftSigns, shaft_signs
from gearsim_dsp.judges.measured import Measured, wheels_on
from gearsim_dsp.judges.runout import wheel_runout
from gearsim_dsp.judges.shaft import shaken_shafts
from gearsim_dsp.judges.tooth_errors import ToothError, tooth_errors
from gearsim_dsp.judges.tooth_kind import tooth_kind
from gearsim_io.nameplate import GearMesh

__all__ = ["judge_gears", "wheel_name"]

# Limits over what a thousand healthy simulated gearboxes show, see docs/evaluation.md.
_TOOTH_OVER_REST = 2.0
_TOOTH_OVER_MEDIAN = 4.0
_TOOTH_LOG10_CHANCE = -4.0
_TOOTH_OVER_DOUBT = 6.0
_WEAR_SPREAD = 0.06
_WEAR_HARMONICS = 0.35
_WEAR_MEAN, _WEAR_EACH = 1.2, 0.75  # sound gearboxes reach means of 1.12
_WEAR_TURNS = 10  # fewer leave too much of the mate's teeth in the average
_RUNOUT_OF_PITCH = 0.0075
_HIDDEN_MM_S = 0.8  # of unbalance in the noise, which would look like run-out
_SEVERE_TOOTH, _MODERATE_TOOTH = 300.0, 30.0


def judge_gears(measured: Measured) -> tuple[Finding, ...]:
    """Findings on the wheels of all meshes; none without the angle or with fewer than five turns."""
    if measured.phase is None:
        return ()
    machine = measured.machine
    geared = {s for mesh in machine.gear_meshes for s in (mesh.driving_shaft, mesh.driven_shaft)}
    ratios = {round(machine.shaft(name).ratio, 9): machine.shaft(name).ratio for name in sorted(geared)}
    signs = [one for ratio in ratios.values() for one in shaft_signs(measured, ratio)]
    # A shaft that shakes all round takes its wheel along, which encoders cannot tell from teeth.
    shaken = shaken_shafts(measured)
    still = [mesh for mesh in machine.gear_meshes if not {mesh.driving_shaft, mesh.driven_shaft} & shaken]
    errors = {mesh.name: tooth_errors(measured, mesh) for mesh in still}
    found = _by_encoders(measured, signs, errors, bad_tooth_of_mesh)
    found += [_bad_tooth(measured, one) for one in _strongest_teeth(signs)]
    # Both witnesses speak of one tooth; the surer one is heard.
    found = sorted(found, key=lambda one: -one.confidence)[:1]
    if not found:
        found = _by_encoders(measured, signs, errors, worn_wheel_of_mesh)
        # What two encoders see of unlike wheels is the better witness, also of sound ones.
        heard = [one for one in signs if not _is_compared(measured, one, errors)]
        found = found or _wear(measured, heard)
    hidden = shaken_shafts(measured, _HIDDEN_MM_S)
    found += _off_axis(
        measured, [mesh for mesh in still if not {mesh.driving_shaft, mesh.driven_shaft} & hidden]
    )
    return tuple(found)


def _is_compared(measured: Measured, signs: ShaftSigns, errors: Mapping[str, tuple[ToothError, ...]]) -> bool:
    """True where encoders told the unevenness of this wheel beside that of its mate."""
    mesh = wheel_name(measured, signs.ratio, signs.teeth)[1]
    return bool(errors.get(mesh.name)) and mesh.driving_teeth != mesh.driven_teeth


def _by_encoders(
    measured: Measured,
    signs: list[ShaftSigns],
    errors: Mapping[str, tuple[ToothError, ...]],
    judge: Callable[[Measured, GearMesh, tuple[ToothError, ...], str], Finding | None],
) -> list[Finding]:
    """What a judge of transmission errors finds in the meshes that have any."""
    channel = signs[0].best.channel if signs else next(iter(measured.channels), "")
    meshes = [mesh for mesh in measured.machine.gear_meshes if errors.get(mesh.name)]
    return [one for mesh in meshes if (one := judge(measured, mesh, errors[mesh.name], channel))]


def wheel_name(measured: Measured, ratio: float, teeth: int) -> tuple[str, GearMesh]:
    """Component of the wheel with so many teeth on the shafts of one speed, and its mesh.

    "mesh.pinion" or "mesh.gear"; the mesh alone where both of its wheels qualify.
    """
    wheels = [wheel for wheel in wheels_on(measured.machine, ratio) if wheel[2] == teeth]
    mesh, side, _ = wheels[0]
    twins = [wheel for wheel in wheels if wheel[0] is mesh]
    return (mesh.name if len(twins) > 1 else f"{mesh.name}.{side}"), mesh


def _strongest_teeth(signs: list[ShaftSigns]) -> list[ShaftSigns]:
    """The wheel with the tooth that stands out most; the other one of its mesh hears it too."""
    standing = [
        one
        for one in signs
        if one.over_rest >= _TOOTH_OVER_REST
        and one.over_median >= _TOOTH_OVER_MEDIAN
        and one.over_doubt >= _TOOTH_OVER_DOUBT
        and one.log10_chance <= _TOOTH_LOG10_CHANCE
    ]
    return sorted(standing, key=lambda one: -one.over_rest)[:1]


def _bad_tooth(measured: Measured, signs: ShaftSigns) -> Finding:
    component, mesh = wheel_name(measured, signs.ratio, signs.teeth)
    kind = tooth_kind(signs)
    features = {
        "over_rest": math.log(signs.over_rest / _TOOTH_OVER_REST),
        "over_median": math.log(signs.over_median / _TOOTH_OVER_MEDIAN),
        "over_doubt": math.log(min(signs.over_doubt, 1e4) / _TOOTH_OVER_DOUBT),
        "improbable": min(-signs.log10_chance, 30.0) / 10.0,
        "kind": math.log(kind.probability / max(1.0 - kind.probability, 1e-3)),
        "spread": math.log(max(signs.spread, 1e-4) / _WEAR_SPREAD),
    }
    peak = signs.over_median
    severity = "severe" if peak >= _SEVERE_TOOTH else "moderate" if peak >= _MODERATE_TOOTH else "slight"
    evidence = _evidence(measured, signs, features)
    evidence.update(
        {
            "tooth_angle_turns": signs.place,
            "tooth_over_others": signs.over_rest,
            "tooth_over_median": signs.over_median,
            "fm4": signs.best.fm4,
            "kind_features": [round(value, 4) for value in kind.features],
            "mesh": mesh.name,
        }
    )
    return Finding(
        component,
        kind.fault,
        signs.ratio,
        signs.ratio,
        signs.ratio * measured.speed.value_hz,
        10 * math.log10(signs.over_median),
        confidence(kind.fault, features),
        severity,
        signs.best.channel,
        evidence,
    )


def _wear(measured: Measured, signs: list[ShaftSigns]) -> list[Finding]:
    """Both signs together: uneven teeth all round, and mesh harmonics that sound teeth do not have."""
    if measured.speed.source not in ("tacho", "encoder"):
        return []  # an angle read from the vibration smears the average, which looks like uneven teeth
    averaged = [one for one in signs if one.turns >= _WEAR_TURNS]
    worst = max((one for one in averaged if one.mesh_is_heard), key=_wear_size, default=None)
    if worst is None or _wear_size(worst) < 1.0:
        return []
    component, _ = wheel_name(measured, worst.ratio, worst.teeth)
    features = {
        "spread": math.log(worst.spread / _WEAR_SPREAD),
        "harmonics": math.log(max(worst.harmonics, 1e-3) / _WEAR_HARMONICS),
    }
    evidence = _evidence(measured, worst, features)
    evidence.update({"uneven_over_regular": worst.spread, "mesh_harmonics": worst.harmonics})
    mesh_order = worst.ratio * worst.teeth
    size = _wear_size(worst)
    finding = Finding(
        component,
        "gear_wear",
        mesh_order,
        mesh_order,
        mesh_order * measured.speed.value_hz,
        20 * math.log10(size),
        confidence("gear_wear", features),
        "severe" if size > 4 else "moderate" if size > 2 else "slight",
        worst.best.channel,
        evidence,
    )
    return [finding]


def _wear_size(signs: ShaftSigns) -> float:
    """1 at the limit: the geometric mean of both signs over their limits, neither far below its own."""
    spread, harmonics = signs.spread / _WEAR_SPREAD, signs.harmonics / _WEAR_HARMONICS
    return math.sqrt(spread * harmonics) / _WEAR_MEAN if min(spread, harmonics) >= _WEAR_EACH else 0.0


def _evidence(measured: Measured, signs: ShaftSigns, features: dict[str, float]) -> dict[str, Any]:
    return {
        "channel": signs.best.channel,
        "turns_averaged": signs.turns,
        "regular_rms": signs.best.regular_rms,
        "difference_rms": signs.best.difference_rms,
        "noise_rms": signs.best.noise_rms,
        "speed_source": measured.speed.source,
        "frequency_hz": signs.ratio * measured.speed.value_hz,
        "features": features,
    }


def _off_axis(measured: Measured, meshes: list[GearMesh]) -> list[Finding]:
    """The larger run-out of each pair with encoders on both shafts, if it is too large."""
    found = []
    for mesh in meshes:
        runout = wheel_runout(measured, mesh)
        if runout is None:
            continue
        # Two wheels that cannot be parted add up what each may have, in any phase.
        limit = _RUNOUT_OF_PITCH * (1.0 if runout.side else math.sqrt(2.0))
        if runout.share_of_pitch < limit:
            continue
        ratio = measured.machine.shaft(runout.shaft).ratio
        features = {"runout": math.log(runout.share_of_pitch / limit)}
        share = runout.share_of_pitch
        finding = Finding(
            f"{mesh.name}.{runout.side}" if runout.side else mesh.name,
            "gear_eccentricity",
            ratio,
            ratio,
            ratio * measured.speed.value_hz,
            20 * math.log10(max(runout.over_floor, 1e-3)),
            confidence("gear_eccentricity", features),
            "severe"
            if share > 4 * _RUNOUT_OF_PITCH
            else "moderate"
            if share > 2 * _RUNOUT_OF_PITCH
            else "slight",
            "transmission error",
            {
                "runout_of_pitch": share,
                "encoders": [mesh.driving_shaft, mesh.driven_shaft],
                "frequency_hz": ratio * measured.speed.value_hz,
                "speed_source": measured.speed.source,
                "features": features,
            },
        )
        found.append(finding)
    return found
