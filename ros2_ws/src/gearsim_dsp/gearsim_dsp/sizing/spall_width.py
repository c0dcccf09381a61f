"""Width of a spall from entry and impact of the elements that cross it.

The steps: whiten the record (`whitening`), find the impacts and average them (`impacts`), compare all ways
across spalls that could have made their mean (`double_event`), with the geometry of the nameplate
(`crossing`), in several bands that vote (`votes`). Two events far apart are measured in each crossing
(`energy_pair`). The interval holds all widths that explain the impacts nearly as well as the best one; where
it is wide, entry and impact cannot be told apart and no width is given.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import uniform_filter1d
from scipy.signal import resample_poly

from gearsim_dsp.judges.finding import Finding
from gearsim_dsp.sizing.crossing import RacePass
from gearsim_dsp.sizing.double_event import FEW, MANY, Explanations, explain
from gearsim_dsp.sizing.energy_pair import EnergyPair, energy_pair
from gearsim_dsp.sizing.impacts import MeanImpact, mean_impact
from gearsim_dsp.sizing.steady import Stretch, steady_stretch
from gearsim_dsp.sizing.votes import (
    INTERVAL_EXCESS,
    MOST_DISCORD,
    Verdict,
    agreed,
    pair_vote,
    width_grid,
    width_vote,
)
from gearsim_dsp.sizing.whitening import whitened
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["Kind", "Sizing", "Width", "size_defect", "spall_width"]

Kind = Literal["localised", "wide", "extended", "unknown"]

_NARROWEST = 0.05  # of the element's radius: 0.2 mm with elements of 7 mm
_WIDEST = 0.45  # of the elements' spacing; beyond, the next element's entry is as near as the impact
_PATH_S = 1.6e-3
_BANDS = 3
_LEAST_RELEASE_SAMPLES = 1.2
_CLEAR_POWER = 10.0
_SMOOTH_HZ = 800.0
_RATE_OVER_TOP = 4.0
_LEAST_IMPACTS = 16
_LEAST_LIKENESS = 0.3
_LEAST_GAIN = 40.0
_MOST_RATIO = 2.0
_PAIR_RELEASES = 4.0  # spacing from which a pair is told by its energy, in expected release distances
_SURE_SPEED = 1e-4
_MOST_EXTENT = 0.22  # of the period: the mean of spalls has 0.05 to 0.12, of rough zones 0.32 to 0.41
_CLEAR_MEAN = 3.0  # standard deviation of the mean over its noise: noise itself takes the whole period
_AT_LIMIT = 1.1


@dataclass(frozen=True, slots=True)
class Width:
    """Width of a spall along the race.

    Parameters
    ----------
    value_m : float
    ci95_m : tuple of float
        Interval that holds the true width with 95 % probability.
    pairs : int
        Pairs of entry and impact that it rests on.
    note : str
        How it was told, for people.
    """

    value_m: float
    ci95_m: tuple[float, float]
    pairs: int
    note: str


@dataclass(frozen=True, slots=True)
class Sizing:
    """A width, or why there is none.

    Parameters
    ----------
    width : Width or None
    kind : {"localised", "wide", "extended", "unknown"}
        One event or two close together; two events so far apart that each crossing shows both; a long rough
        zone without single events; nothing that can be told.
    reason : str
        Why there is no width; empty where there is one.
    pair : EnergyPair or None
        Spacing of two separate events in samples, for `double_impact`.
    """

    width: Width | None
    kind: Kind
    reason: str = ""
    pair: EnergyPair | None = None


def spall_width(
    signal: ArrayLike, sample_rate_hz: float, finding: Finding, machine: Machine, speed: ShaftSpeed
) -> Width | None:
    """Width of the spall that a finding is about; None where it cannot be told (`size_defect` says why).

    Parameters are those of `size_defect`; findings of other faults than of races have no width.
    """
    if finding.fault not in ("outer_race", "inner_race"):
        return None
    return size_defect(signal, sample_rate_hz, finding, machine, speed).width


def size_defect(
    signal: ArrayLike, sample_rate_hz: float, finding: Finding, machine: Machine, speed: ShaftSpeed
) -> Sizing:
    """Width of a defect of a race, or the reason why it cannot be told.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Acceleration at the bearing, any unit, finite; a hundred impacts and more are good.
    sample_rate_hz : float
    finding : Finding
        An outer or inner race fault: which bearing, and at which frequency, right within 0.4 %.
    machine : Machine
    speed : ShaftSpeed
        Of the reference shaft over the signal. With a phase the longest stretch of steady speed is used;
        without one the speed is taken as constant.

    Raises
    ------
    InputError
        For another fault, an unknown bearing, or a signal that is none.
    """
    x = np.asarray(signal, dtype=np.float64)
    if x.ndim != 1 or not np.all(np.isfinite(x)):
        raise InputError("spall_width", "signal", f"shape {x.shape}", "a vector of finite samples")
    bearing = machine.bearing(finding.component)
    stretch = steady_stretch(x.size, sample_rate_hz, speed)
    passes = finding.found_hz if stretch.phase is None else finding.found_order * stretch.speed_hz
    way = RacePass.of(bearing, finding.fault, passes)
    x = x[stretch.first : stretch.stop]
    needed = 2 * _LEAST_IMPACTS / passes
    if x.size < needed * sample_rate_hz:
        text = f"{x.size / sample_rate_hz:.3g} s at steady speed are too short, {needed:.3g} s are needed"
        return Sizing(None, "unknown", text)
    if float(np.ptp(x)) == 0:
        return Sizing(None, "unknown", "the signal is constant")
    turning = finding.fault == ("outer_race" if bearing.outer_ring_rotates else "inner_race")
    sideband = stretch.speed_hz * machine.shaft(bearing.shaft).ratio if turning else 0.0
    shafts = (
        [stretch.speed_hz * s.ratio for s in machine.shafts] if speed.relative_error < _SURE_SPEED else []
    )
    white, first = whitened(x, sample_rate_hz, passes, sideband, shafts)
    mean = mean_impact(white, sample_rate_hz, passes, _shifted(stretch, first))
    return _sized(mean, sample_rate_hz, way)


def _shifted(stretch: Stretch, first: int) -> Phase | None:
    phase = stretch.phase
    return None if phase is None else replace(phase, samples=phase.samples - first)


def _sized(mean: MeanImpact | None, sample_rate_hz: float, way: RacePass) -> Sizing:
    if mean is None or mean.count < _LEAST_IMPACTS:
        return Sizing(None, "unknown", f"fewer than {_LEAST_IMPACTS} impacts")
    if mean.likeness < _LEAST_LIKENESS:
        return Sizing(None, "unknown", f"impacts are not alike (correlation {mean.likeness:.2f})")
    per_m = sample_rate_hz / way.speed_m_s
    least = _PAIR_RELEASES * way.release_m * per_m
    pair = energy_pair(mean.segments, sample_rate_hz, least, _WIDEST * mean.period)
    found = explanations(mean, sample_rate_hz, way)
    verdict = judged(found, pair, per_m, way)
    if pair is None and max(each.gain for each, _ in found) < _LEAST_GAIN:
        if mean.extent > _MOST_EXTENT and float(np.std(mean.values)) > _CLEAR_MEAN * mean.noise:
            share = f"{100 * mean.extent:.0f} % of the period"
            return Sizing(None, "extended", f"vibration during {share} without single events: a rough zone")
        text = "a single impulse explains the impacts as well as entry and impact do"
        return Sizing(None, "unknown", text)
    kind: Kind = "localised" if pair is None else "wide"
    if pair is None and verdict.discord > MOST_DISCORD:
        return Sizing(None, kind, "the bands contradict each other about entry and impact")
    if verdict.high > _MOST_RATIO * verdict.low:
        span = f"{verdict.low * 1e3:.2g} to {verdict.high * 1e3:.2g} mm"
        return Sizing(None, kind, f"entry and impact cannot be told apart: {span}", pair)
    narrowest = _NARROWEST * way.element_radius_m
    if verdict.low < _AT_LIMIT * narrowest:
        text = f"one event is seen: narrower than {narrowest * 1e3:.2g} mm, or the other is hidden"
        return Sizing(None, kind, text, pair)
    pairs = mean.count if pair is None else pair.count
    note = f"mean of {pairs} impacts, path identified" if pair is None else f"two events in {pairs} crossings"
    return Sizing(Width(verdict.value, (verdict.low, verdict.high), pairs, note), kind, "", pair)


def explanations(mean: MeanImpact, sample_rate_hz: float, way: RacePass) -> list[tuple[Explanations, float]]:
    """What explains the mean impact in several bands, each with its samples per metre of the race."""
    factor = max(1, int(sample_rate_hz / (_RATE_OVER_TOP * _top_hz(mean, sample_rate_hz))))
    few: list[tuple[Explanations, float]] = []
    many: list[tuple[Explanations, float]] = []
    for down in range(factor, factor + _BANDS):
        per_m = sample_rate_hz / down / way.speed_m_s
        if down > factor and way.release_m * per_m < _LEAST_RELEASE_SAMPLES:
            break
        values = np.asarray(resample_poly(mean.values, 1, down)) if down > 1 else mean.values
        order = int(np.clip(_PATH_S * sample_rate_hz / down, 12, max(12, values.size // 5)))
        limits = (_NARROWEST * way.element_radius_m * per_m, _WIDEST * way.spacing_m * per_m)
        for length, found in ((FEW, few), (MANY, many)):
            found.append((explain(values, order, way.release_m * per_m, limits, length), per_m))
    # All bands hear one way from the contact to the sensor: most of them decide what kind it is.
    ask = sum(b.criterion < a.criterion for (a, _), (b, _) in zip(few, many, strict=True))
    return many if 2 * ask > len(few) else few


def judged(
    found: list[tuple[Explanations, float]], pair: EnergyPair | None, per_m: float, way: RacePass
) -> Verdict:
    """The width on which the bands agree; where there are two separate events these must be the pair."""
    grid = width_grid(_NARROWEST * way.element_radius_m, _WIDEST * way.spacing_m)
    votes = [width_vote(grid, each.width / rate, each.cost, way.release_m) for each, rate in found]
    verdict = agreed(grid, votes)
    if pair is None:
        return verdict
    apart = pair_vote(grid, pair.spacing / per_m, pair.error / per_m, way.release_m)
    at = int(np.argmin(np.abs(grid - np.log(verdict.value))))
    sure = verdict.discord <= MOST_DISCORD and min(each.gain for each, _ in found) >= _LEAST_GAIN
    if sure and apart[at] <= INTERVAL_EXCESS:
        return agreed(grid, [np.mean(votes, axis=0) + apart])
    return agreed(grid, [apart])


def _top_hz(mean: MeanImpact, sample_rate_hz: float) -> float:
    """Frequency up to which the mean impact stands clearly above its noise."""
    window = np.hanning(mean.values.size)
    power = np.abs(np.fft.rfft(mean.values * window)) ** 2
    ratio = power / max(mean.noise**2 * float(np.sum(window**2)), 1e-300)
    step = sample_rate_hz / mean.values.size
    smooth = uniform_filter1d(ratio, max(3, round(_SMOOTH_HZ / step)))
    clear = np.flatnonzero(smooth > _CLEAR_POWER)
    return float(max(clear[-1] * step if clear.size else 0.0, 0.03 * sample_rate_hz))
