"""The nominal model under the conditions of a measured record, as the content of a scenario.

Speed and load are those of the record, sensors are ideal, channels, rate and angle signals as the record has
them. Numbers are `{value, unit}`, so that whoever extends the model can change them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.machines import machine_file, machine_names
from gearsim_twin.case import Case
from gearsim_twin.load import stated_force_n
from gearsim_twin.view import View

__all__ = ["follows_speed", "machine_word", "scenario_content", "speed_trace"]

_RIG = "bearing_rig"
# A change of speed is an operating condition where means over a quarter of the record show it, by more than
# the nameplate's tolerance either way; what is quicker or smaller is for the judge to find and to name.
_SLOW_SHARE, _MOST_CHANGE = 4, 2.0
# Points of a followed speed: as many as that a run-up's bend is met, each a mean over some turns.
_POINTS, _LEAST_TURNS = 32, 4.0
# Part of the mean speed by which a smooth course may miss a mean over some turns.
_TRACE_TOLERANCE = 1e-3


def scenario_content(case: Case, view: View) -> dict[str, Any]:
    """What a scenario file holds that runs the nominal model as the record was taken.

    Parameters
    ----------
    case : Case
    view : View
        The record, whose speed, load, rate and channels are taken.

    Raises
    ------
    InputError
        If nothing tells the speed, or speed or load are beyond the described drive.

    Notes
    -----
    The speed is constant, at the mean that was measured. Only where it changes slowly and by more than the
    nameplate allows (a run-up) the measured course is followed; quicker changes are a deviation of the
    machine from its model and not a condition. The load is what the record states, else the description's;
    a radial force that the record states goes to the rig's bearing.
    """
    if not math.isfinite(view.speed_hz):
        raise _no_speed(view)
    _check_drive(case, view)
    content: dict[str, Any] = {
        "description": f"{case.machine.name} by {case.model} under the conditions of a measured record",
        "machine": machine_word(case.machine_path),
        "model": case.model,
        "seed": 1,
        "sample_rate": _number(view.record.sample_rate_hz, "Hz"),
        "operating_point": {
            "speed": _number(view.speed_hz, "Hz"),
            "load": _number(_load_nm(case, view), "N*m"),
        },
        "sensors": _sensors(case, view),
    }
    if follows_speed(view):
        del content["operating_point"]["speed"]
        content["profile"] = {"trace": speed_trace(view)}
    force_n = stated_force_n(view.record)
    if force_n is not None and case.modelled.kind == _RIG:
        content["parameters"] = {"radial_load": _number(force_n, "N")}
    return content


def follows_speed(view: View) -> bool:
    """Whether the baseline follows the course of the speed in place of its mean."""
    if view.phase is None:
        return False
    _, speed_hz = view.speed_course(view.record.seconds / _POINTS)
    width = max(1, speed_hz.size // _SLOW_SHARE)
    slow = np.convolve(speed_hz, np.full(width, 1.0 / width), mode="valid")
    return float(np.ptp(slow)) > _MOST_CHANGE * view.machine.speed_tolerance * view.speed_hz


def machine_word(path: Path) -> str:
    """A machine as a scenario names it: by its shipped name, or the path of its description."""
    name = path.stem
    return name if name in machine_names() and machine_file(name) == path else str(path.absolute())


def _no_speed(view: View) -> InputError:
    expected = (
        "a speed of the reference shaft, without which no model can be run beside the record: a tacho or "
        "encoder, a nominal speed on the nameplate, or --speed; without one `gearsim diagnose` still tells "
        "impulses and electrical lines"
    )
    found = "none (no angle signal, none on the nameplate, no shaft lines in the vibration)"
    return InputError(view.record.source or "record", "speed", found, expected)


def _check_drive(case: Case, view: View) -> None:
    """A record beyond what the described drive can do is of another machine, or wrongly described."""
    load_nm = _load_nm(case, view)
    able = case.modelled
    where = view.record.source or "record"
    drive = f"as the drive of {case.machine.name} can do; it is another machine, or has a stronger drive"
    if view.speed_hz > able.speed_limit_hz:
        got = f"{view.speed_hz:.4g} Hz ({view.source})"
        raise InputError(where, "speed", got, f"at most {able.speed_limit_hz:g} Hz, {drive}")
    if load_nm > able.load_limit_nm:
        raise InputError(where, "load", f"{load_nm:.4g} N*m", f"at most {able.load_limit_nm:g} N*m, {drive}")


def _load_nm(case: Case, view: View) -> float:
    return case.modelled.load_nm if view.load_nm is None else view.load_nm


def _sensors(case: Case, view: View) -> dict[str, Any]:
    """Ideal accelerometers and torque transducers, and the angle signals that the record has."""
    record, able = view.record, case.modelled
    # One number of pulses holds for all tachos of a scenario: that of the one which the angle is read from.
    tachos = [
        one for one in record.tachos if one.shaft in able.tacho_shafts and _whole(one.pulses_per_revolution)
    ]
    tachos.sort(key=lambda one: (one.shaft != case.machine.reference_shaft, -one.samples.size))
    tachos = [one for one in tachos if one.pulses_per_revolution == tachos[0].pulses_per_revolution]
    encoders = [one for one in record.encoders if one.shaft in able.tacho_shafts]
    encoders = [one for one in encoders if one.lines_per_revolution == encoders[0].lines_per_revolution]
    names = record.torques.channels if record.torques is not None else ()
    torques = [name.removesuffix("_torque") for name in names]
    sensors: dict[str, Any] = {
        "accelerometers": {"chain": "ideal", "channels": list(record.channels)},
        "tachos": {"shafts": [one.shaft for one in tachos]},
        "encoders": {"shafts": [one.shaft for one in encoders]},
        "torques": {"chain": "ideal", "shafts": [name for name in torques if name in able.torque_shafts]},
    }
    if tachos:
        sensors["tachos"]["pulses"] = round(tachos[0].pulses_per_revolution)
    if encoders:
        sensors["encoders"]["lines"] = encoders[0].lines_per_revolution
    return sensors


def _whole(value: float) -> bool:
    return value >= 1 and value == round(value)


def speed_trace(view: View) -> dict[str, Any]:
    """The slow course of the speed as points of a scenario's trace, from the first sample to the last."""
    seconds = view.record.seconds
    step_s = max(seconds / _POINTS, _LEAST_TURNS / view.speed_hz)
    time_s, speed_hz = view.speed_course(step_s)
    time_s = np.concatenate(([0.0], time_s, [seconds]))
    speed_hz = np.concatenate(([_beyond(speed_hz)], speed_hz, [_beyond(speed_hz[::-1])]))
    columns = {"time_s": _rounded(time_s), "speed_hz": _rounded(np.maximum(speed_hz, 0.0))}
    return {"columns": columns, "tolerance": _number(_TRACE_TOLERANCE * view.speed_hz, "Hz")}


def _beyond(values: NDArray[np.float64]) -> float:
    """Half a step before the first value, on the straight line through the first two."""
    return float(values[0] - 0.5 * (values[1] - values[0])) if values.size > 1 else float(values[0])


def _rounded(values: NDArray[np.float64]) -> list[float]:
    return [float(f"{value:.9g}") for value in values]


def _number(value: float, unit: str) -> dict[str, Any]:
    """A quantity as scenarios write it, exact to what a record can tell."""
    return {"value": float(f"{value:.12g}"), "unit": unit}
