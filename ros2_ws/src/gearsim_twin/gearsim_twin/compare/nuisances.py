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
from scipy.optimize import least_squares

from gearsim_io.errors import InputError
from gearsim_twin.compare.chains import ChannelNuisance, Nuisance, apply
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.places import Place

__all__ = ["ChannelNuisance", "Limits", "Nuisance", "apply", "fit_nuisance", "fit_nuisances"]

Vector = NDArray[np.float64]

_KNOTS = 5
_TINY = 1e-300
# What a model that is nearly right still misses at a band and at a line, for the weights of the fit alone.
_BAND_TAU_DB, _LINE_TAU_DB = 1.0, 2.0
_KNOT_SPREAD_DB, _KNOT_REACH_DB = 6.0, 60.0
# Where no floor is needed none should be left: a pull too weak to move one that is.
_KNOT_DEPTH_DB = 40.0
_FEWEST_PLACES = 4
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
    chosen = limits or Limits()
    names = dict.fromkeys(place.channel for place in pairs[0][0].places)
    fitted = [_Fit.of(name, pairs, chosen) for name in names]
    return Nuisance(tuple(fit.solve() for fit in fitted if fit is not None))


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """The least squares of one channel: bands and lines of all records."""

    channel: str
    measured_db: Vector
    simulated: Vector
    weight: Vector
    hz: Vector
    width: Vector
    is_band: NDArray[np.bool_]
    knots_hz: Vector
    gain_std_db: float

    @classmethod
    def of(cls, channel: str, pairs: Sequence[tuple[Features, Features]], limits: Limits) -> _Fit | None:
        rows = []
        for measured, simulated in pairs:
            m, s = measured.levels, simulated.levels
            clear = measured.stands_out | simulated.stands_out
            known = np.isfinite(m.level_db) & np.isfinite(s.level_db) & np.isfinite(m.frequency_hz)
            for k, place in enumerate(measured.places):
                if place.channel == channel and known[k] and clear[k] and _is_fitted(place):
                    quiet = place.kind in ("band", "floor")
                    tau = _BAND_TAU_DB if quiet else _LINE_TAU_DB
                    sigma = math.hypot(m.std_db[k], s.std_db[k], tau)
                    power = 10 ** (0.1 * s.level_db[k])
                    rows.append(
                        (m.level_db[k], power, 1 / sigma, m.frequency_hz[k], m.bandwidth_hz[k], quiet)
                    )
        if len(rows) < _FEWEST_PLACES:
            return None
        level, power, weight, hz, width, band = (np.array(column) for column in zip(*rows, strict=True))
        is_band = np.asarray(band, dtype=np.bool_)
        turning = all(p.domain == "torsional" for p in pairs[0][0].places if p.channel == channel)
        bands = hz[is_band]
        knots = np.array([1.0]) if turning or bands.size < _KNOTS else np.geomspace(*_ends(bands), _KNOTS)
        gain_std = 0.0 if turning else limits.gain_std_db
        return cls(channel, level, power, weight, hz, width, is_band, knots, gain_std)

    def solve(self) -> ChannelNuisance:
        """The best chain."""
        corners = _CORNER_STARTS if self.gain_std_db else _CORNER_STARTS[:1]
        starts = itertools.product(self._first_gains(), corners)
        best = min((self._from(gain, corner) for gain, corner in starts), key=lambda found: found[0])[1]
        return self._chain(best)

    def _first_gains(self) -> list[float]:
        if self.gain_std_db == 0:
            return [0.0]
        lines = ~self.is_band
        use = lines if lines.sum() >= _FEWEST_PLACES else np.ones_like(lines)
        ratio = self.measured_db[use] - 10 * np.log10(np.maximum(self.simulated[use], _TINY))
        guess = float(np.clip(np.median(ratio), -4 * self.gain_std_db, 4 * self.gain_std_db))
        return [0.0, guess] if abs(guess) > 1.0 else [0.0]

    def _from(self, gain_db: float, corner: float) -> tuple[float, Vector]:
        low, start = self._first_floor(gain_db)
        x = np.concatenate(([gain_db], start, [corner]))
        wide = 60.0 if self.gain_std_db else 1e-6
        lower = np.concatenate(([-wide], low, [_LEAST_CORNER]))
        upper = np.concatenate(([wide], low + 2 * _KNOT_REACH_DB, [math.log(100.0)]))
        found = least_squares(
            self._residuals,
            np.clip(x, lower + 1e-9, upper - 1e-9),
            jac=self._jacobian,
            bounds=(lower, upper),
            loss="cauchy",
            f_scale=2.0,
            x_scale=np.concatenate(([1.0], np.full(start.size, 3.0), [0.3])),
            max_nfev=40,
        )
        return float(found.cost), np.asarray(found.x)

    def _first_floor(self, gain_db: float) -> tuple[Vector, Vector]:
        """Lowest and first value of the knots: what the measured bands near them hold more than the model."""
        density = self.measured_db - 10 * np.log10(self.width)
        model = 10 * np.log10(np.maximum(self.simulated / self.width, _TINY)) + gain_db
        bands = self.is_band if self.is_band.any() else np.ones_like(self.is_band)
        order = np.argsort(self.hz[bands])
        hz, measured, model = self.hz[bands][order], density[bands][order], model[bands][order]
        first = []
        for part in np.array_split(np.arange(hz.size), self.knots_hz.size):
            quiet = float(np.quantile(measured[part], 0.3)) if part.size else float(measured.min())
            below = bool(part.size) and float(np.median(model[part])) < quiet - 1.0
            first.append(quiet if below else quiet - 20.0)
        floor = np.array(first)
        return np.full(floor.size, float(floor.min()) - _KNOT_REACH_DB), floor

    def _chain(self, x: Vector) -> ChannelNuisance:
        corner = math.exp(x[-1]) * float(self.hz.max())
        # A corner that takes less than 0.05 dB anywhere is none.
        corner = math.inf if x[-1] > math.log(3.0) else corner
        knots, floor = tuple(self.knots_hz.tolist()), tuple(x[1:-1].tolist())
        return ChannelNuisance(self.channel, float(x[0]) if self.gain_std_db else 0.0, knots, floor, corner)

    def _parts(self, x: Vector) -> tuple[Vector, Vector, Vector, Vector]:
        """Power of model and floor, (f / f_c)^4, and the weights of the knots at each place."""
        ratio4 = (self.hz / (math.exp(x[-1]) * self.hz.max())) ** 4 if self.gain_std_db else 0 * self.hz
        model = 10 ** (0.1 * x[0]) / (1 + ratio4) * self.simulated
        weights = _knot_weights(self.hz, self.knots_hz)
        floor = 10 ** (0.1 * (weights @ x[1:-1])) * self.width
        return model, floor, ratio4, weights

    def _residuals(self, x: Vector) -> Vector:
        model, floor, _, _ = self._parts(x)
        data = self.weight * (10 * np.log10(model + floor) - self.measured_db)
        return np.concatenate((data, self._beliefs() @ x - self._believed()))

    def _jacobian(self, x: Vector) -> Vector:
        model, floor, ratio4, weights = self._parts(x)
        share = model / (model + floor)
        corner = share * 10 / math.log(10) * 4 * ratio4 / (1 + ratio4)
        slopes = np.column_stack((share, (1 - share)[:, None] * weights, corner))
        return np.vstack((self.weight[:, None] * slopes, self._beliefs()))

    def _beliefs(self) -> Vector:
        """Rows of what is believed beforehand: gain, bends and depth of the floor, corner."""
        count = self.knots_hz.size
        gain = np.zeros((1, count + 2))
        gain[0, 0] = 1 / self.gain_std_db if self.gain_std_db else 1.0
        bends = np.zeros((max(count - 2, 0), count + 2))
        for k in range(bends.shape[0]):
            bends[k, k + 1 : k + 4] = np.array([1.0, -2.0, 1.0]) / _KNOT_SPREAD_DB
        depth = np.zeros((count, count + 2))
        depth[:, 1:-1] = np.eye(count) / _KNOT_DEPTH_DB
        corner = np.zeros((1, count + 2))
        corner[0, -1] = 1 / _CORNER_SPREAD
        return np.vstack((gain, bends, depth, corner))

    def _believed(self) -> Vector:
        count = self.knots_hz.size
        out = np.zeros(1 + max(count - 2, 0) + count + 1)
        out[-1 - count : -1] = (self._quietest() - _KNOT_REACH_DB) / _KNOT_DEPTH_DB
        out[-1] = _USUAL_CORNER / _CORNER_SPREAD
        return out

    def _quietest(self) -> float:
        """Least density measured."""
        density = self.measured_db - 10 * np.log10(self.width)
        return float(np.min(density[self.is_band] if self.is_band.any() else density))


def _is_fitted(place: Place) -> bool:
    """Bands and lines; tones are no business of the chain."""
    return place.domain in ("psd", "orders", "torsional") and place.kind != "tone"


def _ends(values: Vector) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _knot_weights(hz: Vector, knots_hz: Vector) -> Vector:
    """Weights of straight lines between knots over the logarithm of frequency, shape (places, knots)."""
    at = np.log(np.maximum(hz, 1e-9))
    return np.stack([np.interp(at, np.log(knots_hz), row) for row in np.eye(knots_hz.size)], axis=1)
