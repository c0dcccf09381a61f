"""Teeth of planets: crack or spall, from the impulses that one tooth gives and the others do not.

A tooth of a planet meets the ring and, half a turn of the planet later, the sun (thesis 7.9). A crack takes
stiffness from both meshes, a spall lies on the flank of one. So, with Z_r / Z_p turns of the planet against
the carrier in each turn of the carrier, a crack gives 2 Z_r / Z_p impulses and a spall Z_r / Z_p of them: 32
and 16 in four turns of the carrier of the thesis's stage (Table 7.7).

Two views of a planet's turn are judged. Turns averaged with the carrier's place known (`planet_turns`) are
free of noise and of what all teeth do; one tooth that differs stands out there by tens of decibels. What
differs from turn to turn, as a tooth that now and then goes unloaded, is seen in single turns: the residual
of a linear prediction, whose length is that of the most impulsive residual, at most a quarter of the
impulses' spacing (thesis 7.8.2), folded over the turn::

    P(u) = mean over turns k, but the loudest, of E(k + u), over its median,

which adds up what a single sensor hears of each pass, near or far. One tooth that stands out is a spall, two
half a turn (less or more half a tooth pitch) apart are a crack. Of averaged turns a pair has to be clear: a
second contact that is there is seen.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gearsim_dsp.judges.confidence import confidence
from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.judges.planet_side import spall_side
from gearsim_dsp.judges.planet_turns import averaged_profile, averaged_turns
from gearsim_dsp.separation.linear_prediction import ar_residual, best_ar_length, longest_ar_length
from gearsim_dsp.synchronous.whirl import push_of_tooth
from gearsim_io.nameplate import PlanetaryStage

__all__ = ["FoldedResidual", "ToothImpulses", "fold_stage", "judge_planets"]

Array = NDArray[np.float64]

_BINS_PER_TOOTH = 8
_LEAST_TURNS = 8.0  # of a planet against the carrier: below, one loud moment is a pattern
_LONGEST = 300
_SEARCH_SAMPLES = 1 << 17
_NEAR_TEETH = 2.5
_NEAR_TEETH_AVERAGED = 4.5  # the waves fitted to the others miss a little beside the tooth
_PAIR_TEETH = 1.3  # half a pitch of the tooth's two contacts, and the smoothing over one tooth
_TURNS_COUNTED = 4
# Limits over what a thousand healthy simulated stages show, see docs/evaluation.md.
_LEAST_RATIO = 1.35
_LEAST_DEVIATIONS = 7.0
_PAIR_DEVIATIONS = 4.0
_PAIR_OVER_REST = 1.04
# Of averaged turns of 150 healthy stages none had a ratio above 3.6, of 100 spalls none a pair above 1.75.
_LEAST_RATIO_AVERAGED = 5.0
_LEAST_DEVIATIONS_AVERAGED = 5.0
_PAIR_OVER_REST_AVERAGED = 1.75
_TOGETHER = "all channels"
_LEAST_STRAIGHT = 0.5
_SEVERE, _MODERATE = 30.0, 5.0


@dataclass(frozen=True, slots=True, eq=False)
class FoldedResidual:
    """Energy of a channel's residual over the turn of a planet.

    Parameters
    ----------
    channel : str
    length : int
        Of the prediction, in samples.
    kurtosis : float
        Of the residual.
    energy : ndarray, shape (turns, teeth * 8)
        Mean square of the residual in each eighth of a tooth pitch, smoothed over one pitch.
    residual : ndarray, shape (n,)
    """

    channel: str
    length: int
    kurtosis: float
    energy: Array
    residual: Array

    @property
    def profile(self) -> Array:
        """Mean over the turns but the loudest one, which may be a knock, over its median."""
        mean = (self.energy.sum(axis=0) - self.energy.max(axis=0)) / (self.energy.shape[0] - 1)
        return np.asarray(mean / max(float(np.median(mean)), np.finfo(np.float64).tiny))


@dataclass(frozen=True, slots=True)
class ToothImpulses:
    """The tooth that stands out of a folded residual, and the place half a turn away from it.

    `place` is the bin of the tooth, `pair_place` that of the second. `peak`, `pair` and `rest` are the
    profile there and its highest value anywhere else; `deviations` and `pair_deviations` say how far the
    logarithms of the first two lie above the median, in robust standard deviations.
    """

    place: int
    pair_place: int
    peak: float
    pair: float
    rest: float
    deviations: float
    pair_deviations: float

    def stands_out(
        self, least_ratio: float = _LEAST_RATIO, least_deviations: float = _LEAST_DEVIATIONS
    ) -> bool:
        """One tooth is no part of the usual scatter."""
        return self.peak >= least_ratio * self.rest and self.deviations >= least_deviations

    def is_pair(self, least_over_rest: float) -> bool:
        """The other side of the planet answers: both meshes feel the tooth."""
        return self.pair >= least_over_rest * self.rest and self.pair_deviations >= _PAIR_DEVIATIONS


def judge_planets(measured: Measured) -> tuple[Finding, ...]:
    """Findings on the planets of all stages; none where angle or turns are missing."""
    found = []
    for stage in measured.machine.planetary_stages:
        folded = fold_stage(measured, stage)
        if folded:
            finding = _judge(measured, stage, folded)
            if finding is not None:
                found.append(finding)
    return tuple(found)


def fold_stage(measured: Measured, stage: PlanetaryStage) -> list[FoldedResidual]:
    """The residual of every channel over the turn of this stage's planets; empty without enough turns."""
    if measured.phase is None:
        return []
    spin = _spin_order(measured, stage)
    turns = np.interp(np.arange(measured.sample_count), measured.phase.samples, measured.phase.turns * spin)
    if turns[-1] - turns[0] < _LEAST_TURNS:
        return []
    impacts_hz = 2 * spin * measured.speed.value_hz
    longest = min(_LONGEST, longest_ar_length(measured.sample_rate_hz, impacts_hz, measured.sample_count))
    return [
        _folded(name, np.asarray(values, dtype=np.float64), turns, stage.planet_teeth, longest)
        for name, values in measured.channels.items()
        if float(np.ptp(values)) > 0
    ]


def _spin_order(measured: Measured, stage: PlanetaryStage) -> float:
    """Turns of a planet against the carrier in one turn of the reference shaft."""
    ratios = stage.member_ratios()
    shaft = {"carrier": stage.carrier_shaft, "sun": stage.sun_shaft, "ring": stage.ring_shaft}
    scale = measured.machine.shaft(shaft[stage.input_member]).ratio
    return abs(ratios["planet"]) * scale


def _folded(channel: str, x: Array, turns: Array, teeth: int, longest: int) -> FoldedResidual:
    middle = x.size // 2
    part = x[max(0, middle - _SEARCH_SAMPLES // 2) : middle + _SEARCH_SAMPLES // 2]
    length = best_ar_length(part, min(longest, (part.size - 1) // 4))
    residual = ar_residual(x, length)
    used = residual[length:]
    square = np.mean(used**2)
    kurtosis = float(np.mean(used**4) / max(square**2, np.finfo(np.float64).tiny))
    bins = teeth * _BINS_PER_TOOTH
    first, last = math.ceil(turns[length]), math.floor(turns[-1])
    begin, end = np.searchsorted(turns, [first, last])
    place = np.minimum(((turns[begin:end] - first) * bins).astype(np.intp), (last - first) * bins - 1)
    total = np.bincount(place, residual[begin:end] ** 2, (last - first) * bins)
    count = np.bincount(place, minlength=(last - first) * bins)
    energy = uniform_filter1d(total / np.maximum(count, 1), _BINS_PER_TOOTH, mode="wrap")
    return FoldedResidual(channel, length, kurtosis, energy.reshape(last - first, bins), residual)


def find_impulses(profile: Array, near_teeth: float = _NEAR_TEETH) -> ToothImpulses:
    """The tooth that stands out of a profile of `teeth * 8` bins."""
    level = np.log(np.maximum(profile, 1e-12))
    level = level - np.median(level)
    bins = level.size
    place = int(np.argmax(level))
    away = (np.arange(bins) - place + bins // 2) % bins - bins // 2
    opposite = np.abs(np.abs(away) - bins / 2)
    across = opposite <= _PAIR_TEETH * _BINS_PER_TOOTH
    rest = (np.abs(away) > near_teeth * _BINS_PER_TOOTH) & (opposite > (_PAIR_TEETH + 1.5) * _BINS_PER_TOOTH)
    spread = max(1.4826 * float(np.median(np.abs(level[rest] - np.median(level[rest])))), 1e-3)
    pair_place = int(np.flatnonzero(across)[np.argmax(level[across])])
    return ToothImpulses(
        place,
        pair_place,
        float(np.exp(level[place])),
        float(np.exp(level[pair_place])),
        float(np.exp(level[rest].max())),
        float(level[place] / spread),
        float(level[pair_place] / spread),
    )


def _judge(measured: Measured, stage: PlanetaryStage, folded: list[FoldedResidual]) -> Finding | None:
    """Averaged turns decide, all channels together; where they show nothing, the clearest of single turns."""
    turns, bins = averaged_turns(measured, stage), stage.planet_teeth * _BINS_PER_TOOTH
    averaged = _impulses(
        {name: averaged_profile(parts, stage.planet_teeth, _BINS_PER_TOOTH) for name, parts in turns.items()},
        _NEAR_TEETH_AVERAGED,
    )
    single = _impulses({one.channel: one.profile for one in folded}, _NEAR_TEETH)
    together = averaged.get(_TOGETHER, next(iter(averaged.values()), None))
    standing = [one for one in single.values() if one.stands_out()]
    if together is not None and together.stands_out(_LEAST_RATIO_AVERAGED, _LEAST_DEVIATIONS_AVERAGED):
        clearest, least = together, _PAIR_OVER_REST_AVERAGED
    elif standing:
        clearest, least = max(standing, key=lambda one: one.peak / one.rest), _PAIR_OVER_REST
        together = None
    else:
        return None
    own = [(one, least) for one in single.values()]
    own += [(one, _PAIR_OVER_REST_AVERAGED) for one in averaged.values()]
    own = [(one, limit) for one, limit in own if _near_either(one.place, clearest, bins)]
    crack = any(one.is_pair(limit) for one, limit in own)
    crack = crack or any(_is_opposite(one.place, clearest, bins) for one in standing)
    pair = max(one.pair / one.rest for one, _ in own)
    tooth = _Tooth(clearest, crack, together is not None, pair)
    finding = _finding(measured, stage, folded, single, tooth)
    finding.evidence.update(_which_planet(measured, stage, turns.get("ring"), clearest.place / bins))
    if not crack:
        finding.evidence.update(spall_side(turns, stage.planet_teeth, clearest.place / bins))
    return finding


@dataclass(frozen=True, slots=True)
class _Tooth:
    """What is known of the bad tooth: its impulses, and whether averaged turns showed them."""

    clearest: ToothImpulses
    is_crack: bool
    is_averaged: bool
    pair_over_rest: float


def _which_planet(
    measured: Measured, stage: PlanetaryStage, ring: NDArray[np.complex128] | None, place: float
) -> dict[str, object]:
    """What one needs at the machine to find the planet, which no nameplate tells: the carrier's place.

    The ring moves along the line of action of the planet's mesh with it, whichever flank is bad; where that
    is the axis of the ring's sensor, the planet stands a pressure angle from square to it.
    """
    unknown = "not told: the nameplate does not say where the planets stand at the tacho's pulse"
    tacho = measured.speed.source == "tacho" and measured.machine.reference_shaft == stage.carrier_shaft
    if ring is None or ring.shape[2] < 3 or not tacho:
        return {"which_planet": unknown}
    turn, straight = push_of_tooth(ring.mean(axis=0), stage.planet_teeth, place)
    if straight < _LEAST_STRAIGHT:
        return {"which_planet": unknown}
    where = (
        f"its tooth pushes the ring along the ring's sensor {turn:.2f} and {turn + 0.5:.2f} turns after it"
    )
    return {"which_planet": f"{unknown}; {where}", "carrier_turn_of_push": round(turn, 4)}


def _impulses(profiles: dict[str, Array], near_teeth: float) -> dict[str, ToothImpulses]:
    """Of each channel and of all together."""
    found = {name: find_impulses(profile, near_teeth) for name, profile in profiles.items()}
    if len(profiles) > 1:
        logs = [np.log(np.maximum(profile, 1e-12)) for profile in profiles.values()]
        found[_TOGETHER] = find_impulses(np.exp(np.mean(logs, axis=0)), near_teeth)
    return found


def _near_either(place: int, clearest: ToothImpulses, bins: int) -> bool:
    """At the tooth's one contact or the other: which of a crack's is louder differs from sensor to sensor."""
    return abs(_apart(place, clearest.place, bins)) <= _BINS_PER_TOOTH or _is_opposite(place, clearest, bins)


def _is_opposite(place: int, clearest: ToothImpulses, bins: int) -> bool:
    """One channel hears the ring's contact best, another the sun's: together they are a pair."""
    return abs(abs(_apart(place, clearest.place, bins)) - bins / 2) <= _PAIR_TEETH * _BINS_PER_TOOTH


def _apart(one: int, other: int, bins: int) -> int:
    return (one - other + bins // 2) % bins - bins // 2


def _finding(
    measured: Measured,
    stage: PlanetaryStage,
    folded: list[FoldedResidual],
    single: dict[str, ToothImpulses],
    tooth: _Tooth,
) -> Finding:
    spin, clearest = _spin_order(measured, stage), tooth.clearest
    best = max(folded, key=lambda one: single[one.channel].peak)
    fault = "planet_tooth_crack" if tooth.is_crack else "planet_tooth_spall"
    order = 2 * spin if tooth.is_crack else spin
    turns_of_carrier = spin * stage.planet_teeth / stage.ring_teeth
    places = [clearest.place, clearest.pair_place] if tooth.is_crack else [clearest.place]
    heard = next((one for one in folded if one.channel == "ring"), best)
    loudest = single[best.channel]
    features = {
        "stands_out": math.log(min(clearest.peak / clearest.rest, 1e4)),
        "deviations": math.log(min(clearest.deviations, 300.0)),
        "pair": abs(math.log(tooth.pair_over_rest)),
    }
    evidence: dict[str, object] = {
        "channel": best.channel,
        "prediction_length": best.length,
        "residual_kurtosis": best.kurtosis,
        "impulses_per_4_carrier_turns": round(_TURNS_COUNTED * order / turns_of_carrier),
        "impulses_seen": _seen(heard, places, _TURNS_COUNTED * stage.ring_teeth / stage.planet_teeth),
        "impulses_seen_on": heard.channel,
        "tooth_over_median": loudest.peak,
        "opposite_over_median": loudest.pair,
        "others_over_median": loudest.rest,
        "stands_out_of": "turns averaged with the carrier" if tooth.is_averaged else "energy of single turns",
        "tooth_over_others_db": 10 * math.log10(clearest.peak / clearest.rest),
        "planet_turns": int(best.energy.shape[0]),
        "speed_source": measured.speed.source,
        "frequency_hz": order * measured.speed.value_hz,
        "features": features,
    }
    severity = "severe" if loudest.peak >= _SEVERE else "moderate" if loudest.peak >= _MODERATE else "slight"
    return Finding(
        f"{stage.name}.planet",
        fault,
        order,
        order,
        order * measured.speed.value_hz,
        10 * math.log10(clearest.peak),
        confidence(fault, features),
        severity,
        best.channel,
        evidence,
    )


def _seen(folded: FoldedResidual, places: list[int], planet_turns: float) -> int:
    """Impulses that stand out one by one, in so many turns of the planet.

    A pass counts when its energy is above what 999 of 1,000 other places of the same record show.
    """
    energy = folded.energy[: max(1, round(planet_turns))]
    bins = energy.shape[1]
    quiet = np.ones(bins, dtype=np.bool_)
    for place in places:
        away = np.abs([_apart(k, place, bins) for k in range(bins)])
        quiet &= away > _NEAR_TEETH * _BINS_PER_TOOTH
    limit = float(np.quantile(energy[:, quiet], 0.999)) if quiet.any() else math.inf
    reach = _BINS_PER_TOOTH
    around = [np.arange(place - reach, place + reach + 1) % bins for place in places]
    return int(sum(np.count_nonzero(energy[:, index].max(axis=1) > limit) for index in around))
