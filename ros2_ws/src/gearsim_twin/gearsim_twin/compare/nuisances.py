"""What a model need not explain: the measuring chain that brings it closest to the records.

Gains, noise floors and bandwidths of the channels (`chains`) are fitted to the levels of bands and lines
before anything is concluded from what differs.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_twin.compare.chain_fits import KNOTS, ChainData, solve, stacked
from gearsim_twin.compare.chains import ChannelNuisance, Nuisance, apply
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.places import Place

__all__ = ["ChannelNuisance", "Limits", "Nuisance", "apply", "fit_nuisance", "fit_nuisances", "fit_several"]

Vector = NDArray[np.float64]

_TINY = 1e-300
# What a model that is nearly right still misses at a band and at a line, for the weights of the fit alone.
_BAND_TAU_DB, _LINE_TAU_DB = 1.0, 2.0
_KNOT_SPREAD_DB, _KNOT_REACH_DB = 6.0, 60.0
# Where no floor is needed none should be left: a pull too weak to move one that is.
_KNOT_DEPTH_DB = 40.0
_FEWEST_PLACES = 4
_LEAST_REPEAT_DB, _HALF = 0.3, 0.5
_SELDOM, _APART_DB = 0.15, 1.0
_LEAST_CORNER, _USUAL_CORNER, _CORNER_SPREAD = math.log(0.05), math.log(4.0), 2.0
_CORNER_STARTS = (_USUAL_CORNER, math.log(0.5))


@dataclass(frozen=True, slots=True)
class Limits:
    """How far nuisances are believed in: standard deviation of a gain (10 dB where the unit is unknown)."""

    gain_std_db: float = 3.0


def fit_nuisance(measured: Features, simulated: Features, limits: Limits | None = None) -> Nuisance:
    """The chain that brings the model closest to one record."""
    return fit_nuisances([(measured, simulated)], limits)


def fit_nuisances(pairs: Sequence[tuple[Features, Features]], limits: Limits | None = None) -> Nuisance:
    """The chain that brings the model closest to some records of it.

    Parameters
    ----------
    pairs : sequence of (measured, simulated)
        At the same places.
    limits : Limits, optional

    Notes
    -----
    Least squares of the levels of bands and lines with Cauchy's loss, so that what the model lacks at some
    places does not bend the chain; gains near 0 dB, corners beyond the range and smooth floors are preferred.
    """
    if not pairs:
        raise InputError("fit_nuisances", "pairs", 0, "one or more")
    for measured, simulated in pairs:
        if measured.places != simulated.places:
            raise InputError("fit_nuisances", "places", "different ones", "the same on both sides")
    return fit_several(pairs, [limits or Limits()])[0]


def fit_several(pairs: Sequence[tuple[Features, Features]], limits: Sequence[Limits]) -> tuple[Nuisance, ...]:
    """As `fit_nuisances`, with several beliefs at one go."""
    levels = _Levels.of(pairs)
    problems = [
        problem
        for number, each in enumerate(limits)
        for channel in levels.channels
        for problem in levels.problems(channel, each, number)
    ]
    found: list[dict[str, tuple[float, ChannelNuisance]]] = [{} for _ in limits]
    if problems:
        ends, costs = solve(
            stacked([one.data for one in problems]), np.stack([one.start for one in problems])
        )
        for problem, x, cost in zip(problems, ends, costs.tolist(), strict=True):
            best = found[problem.limits].get(problem.channel)
            if best is None or cost < best[0]:
                found[problem.limits][problem.channel] = (cost, problem.chain(x))
    return tuple(Nuisance(tuple(chain for _, chain in each.values())) for each in found)


@dataclass(frozen=True, slots=True, eq=False)
class _Problem:
    """The chain of one channel, from one start."""

    channel: str
    limits: int
    data: ChainData
    start: Vector
    knots_hz: Vector
    top_hz: float
    has_gain: bool

    def chain(self, x: Vector) -> ChannelNuisance:
        """The chain at some unknowns."""
        corner = math.exp(x[-1]) * self.top_hz
        # A corner that takes less than 0.05 dB anywhere is none.
        corner = math.inf if x[-1] > math.log(3.0) or not self.has_gain else corner
        count = self.knots_hz.size
        knots, floor = tuple(self.knots_hz.tolist()), tuple(x[1 : 1 + count].tolist())
        return ChannelNuisance(self.channel, float(x[0]) if self.has_gain else 0.0, knots, floor, corner)


@dataclass(frozen=True, slots=True, eq=False)
class _Levels:
    """Bands and lines of all records that chains are fitted to; all arrays of shape (n,)."""

    channel: NDArray[np.str_]
    measured_db: Vector
    simulated: Vector
    weight: Vector
    hz: Vector
    width: Vector
    is_band: NDArray[np.bool_]
    turning: frozenset[str]
    own: Vector

    @classmethod
    def of(cls, pairs: Sequence[tuple[Features, Features]]) -> _Levels:
        places = pairs[0][0].places
        fitted = np.array([_is_fitted(place) for place in places], dtype=np.bool_)
        quiet = np.array([place.kind in ("band", "floor") for place in places], dtype=np.bool_)
        channel = np.array([place.channel for place in places])
        tau = np.where(quiet, _BAND_TAU_DB, _LINE_TAU_DB)
        parts: list[tuple[NDArray[np.intp], Vector, Vector, Vector, Vector, Vector, Vector]] = []
        for measured, simulated in pairs:
            m, s = measured.levels, simulated.levels
            use = fitted & (measured.stands_out | simulated.stands_out)
            use &= np.isfinite(m.level_db) & np.isfinite(s.level_db) & np.isfinite(m.frequency_hz)
            rows = np.flatnonzero(use)
            # Sharper than so a loss that forgives would let no start find its way.
            repeat = np.maximum(s.repeat_db[rows], _LEAST_REPEAT_DB) * (1 - s.own[rows])
            missed2 = (tau[rows] * s.own[rows]) ** 2 + repeat**2
            sigma = np.sqrt(m.std_db[rows] ** 2 + s.std_db[rows] ** 2 + missed2)
            power = 10 ** (0.1 * s.level_db[rows])
            hz, width = m.frequency_hz[rows], m.bandwidth_hz[rows]
            parts.append((rows, m.level_db[rows], power, 1 / sigma, hz, width, s.own[rows]))
        index = np.concatenate([part[0] for part in parts])
        level, power, weight, hz, width, own = (
            np.concatenate([np.asarray(part[k], dtype=np.float64) for part in parts]) for k in range(1, 7)
        )
        others = {place.channel for place in places if place.domain != "torsional"}
        turning = frozenset(place.channel for place in places) - others
        return cls(channel[index], level, power, weight, hz, width, quiet[index], turning, own)

    @property
    def channels(self) -> list[str]:
        """Those that have levels enough, in their order."""
        names, counts = np.unique(self.channel, return_counts=True)
        enough = set(names[counts >= _FEWEST_PLACES].tolist())
        return [name for name in dict.fromkeys(self.channel.tolist()) if name in enough]

    def problems(self, channel: str, limits: Limits, number: int) -> list[_Problem]:
        """What is to be solved for a channel: from two gains and two corners."""
        mine = self.channel == channel
        part = _Levels(
            self.channel[mine],
            self.measured_db[mine],
            self.simulated[mine],
            self.weight[mine],
            self.hz[mine],
            self.width[mine],
            self.is_band[mine],
            self.turning,
            self.own[mine],
        )
        gain_std = 0.0 if channel in self.turning else limits.gain_std_db
        bands = part.hz[part.is_band]
        plain = channel in self.turning or bands.size < KNOTS
        knots = np.array([1.0]) if plain else np.geomspace(bands.min(), bands.max(), KNOTS)
        corners = _CORNER_STARTS if gain_std else _CORNER_STARTS[:1]
        found = []
        for gain, corner in itertools.product(part.first_gains(gain_std), corners):
            low, floor = part.first_floor(gain, knots)
            data = part.data(knots, gain_std, low)
            start = np.concatenate(([gain], floor, np.zeros(KNOTS - knots.size), [corner]))
            top = float(part.hz.max())
            found.append(_Problem(channel, number, data, start, knots, top, bool(gain_std)))
        return found

    def first_gains(self, gain_std_db: float) -> list[float]:
        """None, the usual ratio of lines, and the one at which the model is hardly ever too loud.

        Noise fills what a model lacks and takes nothing away: with a gain of any size, a fit that starts too
        loud may stay there.
        """
        if gain_std_db == 0:
            return [0.0]
        lines = ~self.is_band
        use = lines if lines.sum() >= _FEWEST_PLACES else np.ones_like(lines)
        ratio = self.measured_db - 10 * np.log10(np.maximum(self.simulated, _TINY))
        guesses = [float(np.median(ratio[use])), float(np.quantile(ratio, _SELDOM))]
        found = [0.0]
        for guess in np.clip(guesses, -4 * gain_std_db, 4 * gain_std_db).tolist():
            if all(abs(guess - other) > _APART_DB for other in found):
                found.append(guess)
        return found

    def first_floor(self, gain_db: float, knots_hz: Vector) -> tuple[Vector, Vector]:
        """Lowest and first value of the knots: what the measured bands near them hold more than the model."""
        density = self.measured_db - 10 * np.log10(self.width)
        model = 10 * np.log10(np.maximum(self.simulated / self.width, _TINY)) + gain_db
        bands = self.is_band if self.is_band.any() else np.ones_like(self.is_band)
        order = np.argsort(self.hz[bands])
        measured, model = density[bands][order], model[bands][order]
        first = []
        for part in np.array_split(np.arange(order.size), knots_hz.size):
            quiet = float(np.quantile(measured[part], 0.3)) if part.size else float(measured.min())
            below = bool(part.size) and float(np.median(model[part])) < quiet - 1.0
            # What the healthy machine showed has the noise of the sensors already.
            below &= float(np.median(self.own)) > _HALF
            first.append(quiet if below else quiet - 20.0)
        floor = np.array(first)
        return np.full(floor.size, float(floor.min()) - _KNOT_REACH_DB), floor

    def data(self, knots_hz: Vector, gain_std_db: float, low: Vector) -> ChainData:
        """What the solver wants, as a single problem; unknowns that do not count are held at 0."""
        count, size = knots_hz.size, self.hz.size
        weights = np.zeros((size, KNOTS))
        weights[:, :count] = _knot_weights(self.hz, knots_hz)
        ratio4 = (self.hz / self.hz.max()) ** 4 if gain_std_db else np.zeros(size)
        belief, believed = self._beliefs(count, gain_std_db)
        wide = 60.0 if gain_std_db else 0.0
        rest = np.zeros(KNOTS - count)
        lower = np.concatenate(([-wide], low, rest, [_LEAST_CORNER]))
        upper = np.concatenate(([wide], low + 2 * _KNOT_REACH_DB, rest, [math.log(100.0)]))
        arrays = (self.measured_db, self.simulated, self.weight, ratio4, self.width, weights)
        return ChainData(*(each[None] for each in (*arrays, belief, believed, lower, upper)))

    def _beliefs(self, count: int, gain_std_db: float) -> tuple[Vector, Vector]:
        """Rows of what is believed beforehand: gain, bends and depth of the floor, corner."""
        belief = np.zeros((2 * KNOTS, KNOTS + 2))
        believed = np.zeros(2 * KNOTS)
        belief[0, 0] = 1 / gain_std_db if gain_std_db else 0.0
        for k in range(count - 2):
            belief[1 + k, k + 1 : k + 4] = np.array([1.0, -2.0, 1.0]) / _KNOT_SPREAD_DB
        for k in range(count):
            belief[KNOTS - 1 + k, 1 + k] = 1 / _KNOT_DEPTH_DB
            believed[KNOTS - 1 + k] = (self._quietest() - _KNOT_REACH_DB) / _KNOT_DEPTH_DB
        belief[-1, -1] = 1 / _CORNER_SPREAD
        believed[-1] = _USUAL_CORNER / _CORNER_SPREAD
        return belief, believed

    def _quietest(self) -> float:
        """Least density measured."""
        density = self.measured_db - 10 * np.log10(self.width)
        return float(np.min(density[self.is_band] if self.is_band.any() else density))


def _is_fitted(place: Place) -> bool:
    """Bands and lines; tones and passages are no business of the chain."""
    return place.domain in ("psd", "orders", "torsional") and place.kind not in ("tone", "passage")


def _knot_weights(hz: Vector, knots_hz: Vector) -> Vector:
    """Weights of straight lines between knots over the logarithm of frequency, shape (places, knots)."""
    at = np.log(np.maximum(hz, 1e-9))
    return np.stack([np.interp(at, np.log(knots_hz), row) for row in np.eye(knots_hz.size)], axis=1)
