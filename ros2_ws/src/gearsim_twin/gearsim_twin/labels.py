"""What records say against their labels: a shaft that did not turn at the speed stated.

A model runs at the speed that was measured, so a wrong label changes none of its levels. It is wrong all the
same, and has a place of its own: the frequency of the shaft, measured against stated. How far lines are off
is told in decibels as for all frequencies: 6 dB for the distance at which lines part.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np

from gearsim_twin.causes.cause import Cause
from gearsim_twin.causes.shaft_speed_offset import LARGEST
from gearsim_twin.compare.discrepancy import RATIO_DB
from gearsim_twin.compare.merged import Discrepancy
from gearsim_twin.compare.places import Place
from gearsim_twin.stated_comb import other_speed_hz
from gearsim_twin.verdict import Found, Number
from gearsim_twin.view import View

__all__ = ["Label", "speed_label"]

_SIGMAS = 3.0
_MOST_DB, _MOST_Z = 40.0, 99.0
_Z95 = 1.959964
# Of a speed told by counting multiples, and how sure that is.
_ROUGH, _ANY, _CONTRADICTED = 0.005, 0.5, 0.95
_FITS_NOTHING = (
    "lines fit the speed stated only beyond its tolerance, and those of a supply fit no supply: the record "
    "is of another run, was sampled at another rate"
)


@dataclass(frozen=True, slots=True)
class Label:
    """A label that the records contradict: what is wrong with it, and what differs by that.

    `contradicted` tells that the lines are not those of the speed at which the model runs: no cause of
    anything else can then be told.
    """

    found: Found
    discrepancy: Discrepancy
    contradicted: bool = False


def speed_label(
    training: Sequence[View], heldout: Sequence[View], causes: Sequence[Cause], window_turns: float
) -> Label | None:
    """The wrong speed of a label; None where labels hold, or nothing but they tell the speed.

    Parameters
    ----------
    training, heldout : sequence of View
        Of training most must contradict it.
    causes : sequence of Cause
        Those that may be named.
    window_turns : float
        Turns in which lines part that differ by one; NaN: all of a record.

    Notes
    -----
    A speed is off where it is further from the one stated than the nameplate's tolerance and three of its own
    standard deviations. Up to a tenth it is an offset; beyond, or where the angle signal contradicts the
    vibration, the record is of another run or has another tacho. Where the lines are those of quite another
    speed than the one found near the one stated, that is told alone.
    """
    others = [other_speed_hz(view) for view in training]
    if 2 * sum(each is not None for each in others) > len(training):
        return _contradicted(training[0], [each for each in others if each is not None], causes)
    off = [view for view in training if _is_off(view)]
    if not off or 2 * len(off) <= len(training):
        return None
    if all(any(issue.issue == "sampling_rate_doubtful" for issue in view.issues) for view in off):
        return _contradicted(off[0], [], causes)
    ratio = float(np.mean([view.speed_hz / view.machine.nominal_speed_hz for view in off]))
    contradicted = any(issue.issue == "angle_contradicted" for view in off for issue in view.issues)
    other = contradicted or abs(ratio - 1.0) > LARGEST
    known = {cause.name: cause for cause in causes}
    cause = known.get("mislabelled_record" if other else "shaft_speed_offset")
    if cause is None:
        return None
    turns = window_turns if math.isfinite(window_turns) else min(view.turns for view in training)
    stated = float(np.mean([view.machine.nominal_speed_hz for view in off]))
    speed = ratio * stated
    std = float(np.mean([_std(view) for view in off]))
    component = "speed" if other else ""
    values: dict[str, float | str] = {
        "speed_hz": speed,
        "stated_hz": stated,
        "speed_ratio": ratio,
        "component": component,
    }
    numbers = {"speed_hz": (speed, std), "speed_ratio": (ratio, std / stated)}
    parameters = tuple(_number(one.name, one.unit, *numbers[one.name]) for one in cause.parameters)
    before = _db(ratio, turns)
    held = [view.speed_hz / view.machine.nominal_speed_hz for view in heldout if _is_known(view)]
    gains = [_db(each, turns) - _db(each / ratio, turns) for each in held] or [before]
    gain, spread = float(np.mean(gains)), _Z95 * RATIO_DB * turns * std / stated
    beyond = (abs(ratio - 1.0) - _tolerance(off[0])) * stated / std
    found = Found(
        name=cause.name,
        component=component,
        parameters=parameters,
        heldout_gain_db=gain,
        heldout_ci95_db=(max(gain - spread, 0.0), min(gain + spread, _MOST_DB)),
        domain="orders",
        probability=NormalDist().cdf(beyond),
        signature=cause.signature(values),
    )
    shaft = off[0].machine.reference_shaft
    place = Place("orders", off[0].record.channels[0], "ratio", 1.0, "order", 100.0 / turns, shaft)
    where = f"speed of {shaft}: {speed:.5g} Hz measured, {stated:.5g} Hz stated"
    z = math.copysign(min(abs(ratio - 1.0) * stated / std, _MOST_Z), ratio - 1.0)
    size = math.copysign(before, ratio - 1.0)
    return Label(found, Discrepancy("d0", "orders", where, size, z, (place,), cause.name))


def _contradicted(view: View, speeds_hz: Sequence[float], causes: Sequence[Cause]) -> Label | None:
    """A record whose lines are those of another speed than the one that was found near the one stated.

    Without `speeds_hz` nothing tells which: lines fit the speed stated badly, and those of a supply none.
    """
    cause = next((each for each in causes if each.name == "mislabelled_record"), None)
    stated = view.machine.nominal_speed_hz if math.isfinite(view.machine.nominal_speed_hz) else view.speed_hz
    speed = float(np.median(speeds_hz)) if speeds_hz else view.speed_hz
    ratio = speed / stated
    if cause is None:
        return None
    values: dict[str, float | str] = {"speed_hz": speed, "speed_ratio": ratio, "component": "speed"}
    parameter = cause.parameters[0]
    told = cause.signature(values) if speeds_hz else _FITS_NOTHING
    found = Found(
        name=cause.name,
        component="speed",
        parameters=(_number(parameter.name, parameter.unit, ratio, (_ROUGH if speeds_hz else _ANY) * ratio),),
        heldout_gain_db=0.0,
        heldout_ci95_db=(0.0, 0.0),
        domain="orders",
        probability=_CONTRADICTED,
        signature=f"{told}, or of another machine; nothing else is looked for",
    )
    shaft = view.machine.reference_shaft
    place = Place("orders", view.record.channels[0], "ratio", 1.0, "order", 1.0, shaft)
    beside = f"those of {shaft} at {view.speed_hz:.4g} Hz do not"
    where = f"multiples of {speed:.4g} Hz stand out, {beside}" if speeds_hz else f"speed of {shaft}: {told}"
    size = math.copysign(_MOST_DB, ratio - 1.0)
    z = math.copysign(_MOST_Z, ratio - 1.0)
    return Label(found, Discrepancy("d0", "orders", where, size, z, (place,), cause.name), contradicted=True)


def _is_known(view: View) -> bool:
    nominal = view.machine.nominal_speed_hz
    return view.source != "nameplate" and math.isfinite(nominal) and math.isfinite(view.speed_hz)


def _is_off(view: View) -> bool:
    if not _is_known(view):
        return False
    nominal = view.machine.nominal_speed_hz
    return abs(view.speed_hz / nominal - 1.0) > max(_tolerance(view), _SIGMAS * _std(view) / nominal)


def _tolerance(view: View) -> float:
    return float(view.machine.speed_tolerance)


def _std(view: View) -> float:
    low, high = view.speed.ci95_hz
    return max(0.5 * (high - low) / _Z95, 1e-6 * view.speed_hz)


def _db(ratio: float, turns: float) -> float:
    """How far off lines are at order 1, as levels."""
    return min(RATIO_DB * abs(math.log(ratio)) * turns, _MOST_DB)


def _number(name: str, unit: str, value: float, std: float) -> Number:
    return Number(name, unit, value, (value - _Z95 * std, value + _Z95 * std))
