"""Shafts: unbalance, misalignment of couplings, loose feet, from the low orders of the shaft's own bearings.

Levels are velocities, whose limits are steps of ISO 10816-1 (class I: up to 0.71 mm/s RMS good, 1.8
acceptable, 4.5 bad). Sound rigs reach 1.0 mm/s at order 1 and 0.5 mm/s at its harmonics (MFPT baselines), so
there is no finding below 1.8 and 1.12 mm/s. What turns with the shaft:

unbalance       order 1 in every direction across the shaft, little else
misalignment    orders 2 to 8 strong against order 1 (jaws work three times a turn, universal joints twice)
looseness       many orders, halves among them, on one bearing's pedestal much more than on the others; or in
                one direction only, that of lifting, where a coupling shakes all round

The harmonics of a gear mesh lie far above; a wheel off its axis presses along the line of action only, so
of two directions the weaker one counts where both are measured. An order on the supply's frequency or a
multiple of it (order 5 at 10 Hz) adds nothing to a level as long as the speed is constant: it may be hum.
Such lines are told (`undecided_orders`).
"""

from __future__ import annotations

import math
from typing import Any, cast

import numpy as np

from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.levels import BearingLevels, bearing_levels
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.quality import QualityIssue
from gearsim_io.nameplate import Shaft

__all__ = ["judge_shafts", "shaken_shafts", "undecided_orders"]

_UNBALANCE_MM_S = 1.8
_HARMONICS_MM_S = 1.12
_MODERATE_MM_S, _SEVERE_MM_S = 4.5, 11.2
_HARMONIC_SHARE = 0.35
_LOOSE_ORDERS = 6
_LOOSE_OVER_OTHERS = 2.0
# One foot that is lifted: couplings out of line shake across by a quarter and more of what they do along.
_LIFT_SHARE = 0.24
_LIFT_ORDERS = 4
_LIFT_OVER_OTHERS = 1.2
_SHAKEN_MM_S = 0.4
_END = 1 / 3
_WORSE_DB = 3.0


def judge_shafts(measured: Measured) -> tuple[Finding, ...]:
    """Findings on shafts and feet; none without an angle signal or where the unit is not m/s^2.

    Faults grow: the last third of the record is judged as well, and where it is worse it counts.
    """
    if measured.phase is None or measured.unit != "m/s^2":
        return ()
    whole = _judged(measured)
    end = _judged(measured.last(_END))
    return end if _worst(end) > _worst(whole) + _WORSE_DB else whole


def _worst(findings: tuple[Finding, ...]) -> float:
    """In decibels over the limits; minus infinity where nothing was found."""
    return max((_over_limit_db(one) for one in findings), default=-math.inf)


def _over_limit_db(finding: Finding) -> float:
    value, limit = finding.evidence["velocity_mm_s"], finding.evidence["limit_mm_s"]
    return _decibels(cast(float, value), cast(float, limit))


def _decibels(value: float, reference: float) -> float:
    return 20 * math.log10(value / max(reference, 1e-9))


def _judged(measured: Measured) -> tuple[Finding, ...]:
    levels = bearing_levels(measured)
    loose = _looseness(measured, levels)
    if loose:
        return loose
    found: list[Finding] = []
    ratios = {round(shaft.ratio, 9) for shaft in measured.machine.shafts}
    for ratio in sorted(ratios):
        shafts = [s for s in measured.machine.shafts if abs(s.ratio / ratio - 1) < 1e-6 and s.name in levels]
        # Shafts of one speed shake each other; the one with the higher levels is meant.
        if shafts:
            shaft = max(shafts, key=lambda s: max(one.total for one in levels[s.name]))
            finding = _of_shaft(measured, shaft, levels[shaft.name])
            found += [finding] if finding else []
    return tuple(found)


def shaken_shafts(measured: Measured, hidden_mm_s: float = math.inf) -> set[str]:
    """Shafts that move once a turn in every direction, and so do not do it for their wheel's teeth.

    Parameters
    ----------
    measured : Measured
    hidden_mm_s : float
        Shafts that may move by so much without standing out of the noise are counted, too.
    """
    if measured.phase is None or measured.unit != "m/s^2":
        return set()
    levels = bearing_levels(measured)
    return {
        shaft
        for shaft, group in levels.items()
        if max(one.faint_mm_s for one in group) >= _SHAKEN_MM_S
        or min(one.unseen_mm_s for one in group) >= hidden_mm_s
    }


def undecided_orders(measured: Measured) -> tuple[QualityIssue, ...]:
    """Orders that lie on lines of the supply at a constant speed and would weigh if they were the shaft's."""
    if measured.phase is None or measured.unit != "m/s^2":
        return ()
    issues = []
    for one in (one for group in bearing_levels(measured).values() for one in group):
        if float(np.sqrt(np.sum(one.undecided_mm_s**2))) < _HARMONICS_MM_S:
            continue
        turn = measured.machine.shaft(one.bearing.shaft).ratio * measured.speed.value_hz
        told = ", ".join(
            f"order {0.5 * k:g} ({0.5 * k * turn:.2f} Hz, {v:.2g} mm/s)"
            for k, v in enumerate(one.undecided_mm_s, 1)
            if v > 0
        )
        detail = f"{told} of shaft {one.bearing.shaft!r} at {one.bearing.name!r}: lines of the supply lie "
        detail += "there, too, and the speed is constant; which it is cannot be decided, none was counted"
        issues.append(QualityIssue("order_or_supply", "", detail))
    return tuple(issues)


def _looseness(measured: Measured, levels: dict[str, list[BearingLevels]]) -> tuple[Finding, ...]:
    everyone = [one for group in levels.values() for one in group]
    if len(everyone) < 2:
        return ()
    worst = max(everyone, key=lambda one: math.hypot(one.harmonics, one.halves))
    own = math.hypot(worst.harmonics, worst.halves)
    others = [math.hypot(one.harmonics, one.halves) for one in everyone if one is not worst]
    over = own / max(max(others), 1e-6)
    rattles = worst.count >= _LOOSE_ORDERS and over >= _LOOSE_OVER_OTHERS
    lifts = (
        worst.across_mm_s <= _LIFT_SHARE * own and worst.count >= _LIFT_ORDERS and over >= _LIFT_OVER_OTHERS
    )
    if own < _HARMONICS_MM_S or not (rattles or lifts):
        return ()
    features = {
        "level": math.log(own / _HARMONICS_MM_S),
        "over_others": math.log(min(over, 1e3) / _LOOSE_OVER_OTHERS),
        "orders": worst.count / _LOOSE_ORDERS - 1.0,
    }
    return (_finding(measured, worst, worst.bearing.name, "looseness", own, features),)


def _of_shaft(measured: Measured, shaft: Shaft, levels: list[BearingLevels]) -> Finding | None:
    """Misalignment where the harmonics rule, else unbalance."""
    bent = max(levels, key=lambda one: one.harmonics)
    share = bent.harmonics / max(bent.first, 1e-9)
    if bent.harmonics >= _HARMONICS_MM_S and share >= _HARMONIC_SHARE:
        features = {
            "level": math.log(bent.harmonics / _HARMONICS_MM_S),
            "share": math.log(min(share, 1e3) / _HARMONIC_SHARE),
        }
        return _finding(measured, bent, shaft.name, "misalignment", bent.harmonics, features)
    heavy = max(levels, key=lambda one: one.all_round_mm_s)
    if heavy.all_round_mm_s < _UNBALANCE_MM_S:
        return None
    features = {
        "level": math.log(heavy.all_round_mm_s / _UNBALANCE_MM_S),
        "purity": math.log(heavy.first / max(heavy.harmonics, 1e-3 * heavy.first)),
    }
    return _finding(measured, heavy, shaft.name, "unbalance", heavy.all_round_mm_s, features)


def _finding(
    measured: Measured,
    levels: BearingLevels,
    component: str,
    fault: str,
    velocity: float,
    features: dict[str, float],
) -> Finding:
    ratio = measured.machine.shaft(levels.bearing.shaft).ratio
    limit = _UNBALANCE_MM_S if fault == "unbalance" else _HARMONICS_MM_S
    counted = levels.noise_mm_s[1:2] if fault == "unbalance" else levels.noise_mm_s
    noise = float(np.sqrt(np.sum(counted**2)))
    severity = (
        "severe" if velocity >= _SEVERE_MM_S else "moderate" if velocity >= _MODERATE_MM_S else "slight"
    )
    evidence: dict[str, Any] = {
        "channel": levels.channel,
        "bearing": levels.bearing.name,
        "velocity_mm_s": velocity,
        "limit_mm_s": limit,
        "order_velocities_mm_s": {
            f"{0.5 * k:g}": round(float(v), 4) for k, v in enumerate(levels.velocity_mm_s, 1) if v > 0
        },
        "frequency_hz": ratio * measured.speed.value_hz,
        "speed_source": measured.speed.source,
        "features": features,
    }
    return Finding(
        component,
        fault,
        ratio,
        ratio,
        ratio * measured.speed.value_hz,
        _decibels(velocity, noise),
        confidence(fault, features),
        severity,
        levels.channel,
        evidence,
    )
