"""The measuring chain: what a gain, a noise floor and a low pass do to levels, in closed form.

Per channel a gain, a coloured floor (power density, straight in decibels over the logarithm of frequency
between a few knots) and a low pass of second order. Nothing is simulated for them. Of a place that holds the
power P of the model, at the frequency f with the bandwidth B,

    P' = g H^2(f) P + N(f) B,     H^2 = 1 / (1 + (f / f_c)^4).

Modulations and statistics of a band are diluted by the noise. With S and N the densities of model and noise
in the band, and s the model's share of its power,

    squared envelope spectrum     X' = s^2 X + X_Gauss B (int (S + N)^2 - int S^2) / (int S + N)^2
    kurtosis, scatter             X' = s^2 X + (1 - s^2) X_Gauss
    peaks of the squared signal   X' = s X + (1 - s) X_Gauss        (and extremes of the short-time power)
    one half over the other       X' = (r X + (1 - r) (1 + X) / 2) / (r + (1 - r) (1 + X) / 2),
                                  r = s of end over beginning, s^1.5 (as of a skewness) of above over below 0
    coherence                     X' = r X + (1 - r) X_Gauss,  r the mean of (S / (S + N))^2 over the band

(the first by the products of the spectra of model and noise that its floor is made of; of white noise it is
the second). Of an encoder the floor alone counts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import LEAST_STD_DB
from gearsim_twin.compare.places import Place

__all__ = ["ChannelNuisance", "Nuisance", "apply", "behind"]

Vector = NDArray[np.float64]

_TINY = 1e-300
_FIRST_ORDER_KINDS = ("crest", "peak", "quiet", "loud")
# Ratios of two halves, and to which power of the model's share they are kept.
_HALVES = {"asymmetry": 1.5, "drift": 1.0}


@dataclass(frozen=True, slots=True)
class ChannelNuisance:
    """The measuring chain of one channel.

    Attributes
    ----------
    channel : str
    gain_db : float
    floor_hz, floor_db : tuple of float
        Knots of the floor: frequency, density in dB of the unit squared per Hz (of an encoder: per order).
        Beyond the outer knots the floor is level.
    corner_hz : float
        Of the low pass; infinite if there is none.
    """

    channel: str
    gain_db: float = 0.0
    floor_hz: tuple[float, ...] = (1.0,)
    floor_db: tuple[float, ...] = (-math.inf,)
    corner_hz: float = math.inf

    def gain(self, frequency_hz: Vector) -> Vector:
        """Power gain at frequencies."""
        return np.asarray(10 ** (0.1 * self.gain_db) / (1 + (frequency_hz / self.corner_hz) ** 4))

    def floor(self, frequency_hz: Vector) -> Vector:
        """Power density at frequencies."""
        if not math.isfinite(self.floor_db[0]):
            return np.zeros_like(frequency_hz)
        at = np.log(np.maximum(frequency_hz, 1e-9))
        return np.asarray(10 ** (0.1 * np.interp(at, np.log(self.floor_hz), self.floor_db)))


@dataclass(frozen=True, slots=True)
class Nuisance:
    """The measuring chains of all channels; those not listed are ideal."""

    channels: tuple[ChannelNuisance, ...] = ()

    def of(self, channel: str) -> ChannelNuisance:
        """That of one channel."""
        return next((c for c in self.channels if c.channel == channel), ChannelNuisance(channel))

    @property
    def gains_db(self) -> dict[str, float]:
        """Gain of every channel fitted."""
        return {c.channel: c.gain_db for c in self.channels}


def behind(first: Nuisance, second: Nuisance) -> Nuisance:
    """Two measuring chains one after the other, as one with the knots of the first."""
    found = []
    for chain in first.channels:
        more = second.of(chain.channel)
        hz = np.array(chain.floor_hz)
        power = more.gain(hz) * chain.floor(hz) + more.floor(hz)
        with np.errstate(divide="ignore"):
            floor_db = 10 * np.log10(power)
        fourth = chain.corner_hz**-4 + more.corner_hz**-4
        found.append(
            replace(
                chain,
                gain_db=chain.gain_db + more.gain_db,
                floor_db=tuple(floor_db.tolist()),
                corner_hz=fourth**-0.25 if fourth > 0 else math.inf,
            )
        )
    known = {chain.channel for chain in first.channels}
    return Nuisance((*found, *(each for each in second.channels if each.channel not in known)))


def apply(nuisance: Nuisance, simulated: Features) -> Features:
    """Simulated features as the measuring chain would show them."""
    old = simulated.levels
    new = {name: getattr(old, name).copy() for name in ("level_db", "std_db", "height_db")}
    for chain in nuisance.channels:
        rows = np.array([place.channel == chain.channel for place in simulated.places])
        power = rows & np.isfinite(old.frequency_hz) & np.isfinite(old.level_db)
        _shift_power(old, new, power, chain)
        _shift_rest(simulated, new, rows, chain)
    std = np.maximum(new["std_db"], LEAST_STD_DB)
    levels = replace(old, level_db=new["level_db"], std_db=std, height_db=new["height_db"])
    return Features(simulated.places, levels, simulated.speed_hz)


def _mixed(
    old: Levels, new: dict[str, Vector], rows: NDArray[np.bool_], factor: Vector, added: Vector
) -> None:
    """Levels of X' = factor X + added, and the same for what noise alone gives of them."""
    value = factor * 10 ** (0.1 * old.level_db[rows])
    noise = value * 10 ** (-0.1 * old.height_db[rows])
    total = np.maximum(value + added, _TINY)
    new["level_db"][rows] = 10 * np.log10(total)
    new["std_db"][rows] = old.std_db[rows] * value / total
    alone = np.where(np.isinf(old.height_db[rows]), 0.0, np.maximum(noise + added, _TINY))
    with np.errstate(divide="ignore"):
        new["height_db"][rows] = 10 * np.log10(total / alone)


def _shift_power(
    old: Levels, new: dict[str, Vector], rows: NDArray[np.bool_], chain: ChannelNuisance
) -> None:
    hz, width = old.frequency_hz[rows], old.bandwidth_hz[rows]
    _mixed(old, new, rows, chain.gain(hz), chain.floor(hz) * width)


def _shift_rest(
    simulated: Features, new: dict[str, Vector], rows: NDArray[np.bool_], chain: ChannelNuisance
) -> None:
    """Level of the whole channel, and what noise dilutes: modulations, coherence, shapes."""
    old = simulated.levels
    shares = {band: _Mixture.of(simulated, rows, chain, band) for band in _bands(simulated, rows)}
    for k in np.flatnonzero(rows & np.isfinite(old.level_db) & ~np.isfinite(old.frequency_hz)).tolist():
        place = simulated.places[k]
        one = np.zeros(rows.size, dtype=np.bool_)
        one[k] = True
        if place.kind == "rms":
            mixture = _Mixture.of(simulated, rows, chain, None)
            before = max(10 ** (0.1 * float(old.level_db[k])), _TINY)
            _mixed(old, new, one, np.array([mixture.model / before]), np.array([mixture.noise]))
        elif place.kind in _HALVES and place.band_hz in shares:
            _shift_ratio(old, new, k, shares[place.band_hz].share ** _HALVES[place.kind])
        elif math.isfinite(old.gauss_db[k]) and place.band_hz in shares:
            factor, rest = shares[place.band_hz].dilution(place)
            _mixed(old, new, one, np.array([factor]), np.array([rest * 10 ** (0.1 * old.gauss_db[k])]))


def _shift_ratio(old: Levels, new: dict[str, Vector], k: int, share: float) -> None:
    """Of a ratio of two halves, to which noise adds alike."""
    ratio = 10 ** (0.1 * float(old.level_db[k]))
    added = (1 - share) * (1 + ratio) / 2
    above, below = share * ratio + added, share + added
    new["level_db"][k] = 10 * math.log10(max(above, _TINY) / max(below, _TINY))
    # Derivative of the new level by the old one.
    slope = ratio * ((share + (1 - share) / 2) / above - (1 - share) / 2 / below)
    new["std_db"][k] = old.std_db[k] * abs(slope)


@dataclass(frozen=True, slots=True)
class _Mixture:
    """Power of model and noise in a band, and two means that depend on how they lie in it."""

    model: float
    noise: float
    concentration: float
    coherent: float

    @classmethod
    def of(
        cls,
        simulated: Features,
        rows: NDArray[np.bool_],
        chain: ChannelNuisance,
        band: tuple[float, float] | None,
    ) -> _Mixture:
        """Of a carrier band, or (None) of the whole channel; colours from the noise bands of the psd."""
        places, levels = simulated.places, simulated.levels
        level = next(
            float(levels.level_db[k])
            for k in np.flatnonzero(rows).tolist()
            if places[k].kind == "rms" and places[k].band_hz == band
        )
        inside = [
            k
            for k in np.flatnonzero(rows & np.isfinite(levels.level_db)).tolist()
            if places[k].domain == "psd" and (band is None or band[0] <= places[k].at < band[1])
        ]
        if not inside:
            hz = np.array([1.0 if band is None else math.sqrt(band[0] * band[1])])
            width = np.array([1.0 if band is None else band[1] - band[0]])
            density = 10 ** (0.1 * level) / width
        else:
            hz = levels.frequency_hz[inside]
            width = np.array([places[k].width for k in inside])
            power = 10 ** (0.1 * levels.level_db[inside]) * width
            for k in np.flatnonzero(rows & simulated.stands_out & np.isfinite(levels.frequency_hz)).tolist():
                if places[k].domain == "orders" and places[k].kind != "passage":
                    near = np.argmin(np.abs(np.log(hz / levels.frequency_hz[k])))
                    if abs(hz[near] - levels.frequency_hz[k]) <= 0.6 * width[near]:
                        power[near] += 10 ** (0.1 * levels.level_db[k])
            # Lines that no place has are spread like the rest.
            density = power / width * (10 ** (0.1 * level) / max(float(power.sum()), _TINY))
        model, noise = chain.gain(hz) * density, chain.floor(hz)
        both = np.maximum(model + noise, _TINY)
        total, extent = float(np.sum(both * width)), float(np.sum(width))
        crossed = extent * float(np.sum((both**2 - model**2) * width)) / max(total**2, _TINY)
        coherent = float(np.sum((model / both) ** 2 * width)) / extent
        return cls(float(np.sum(model * width)), float(np.sum(noise * width)), crossed, coherent)

    @property
    def share(self) -> float:
        """Of the model in the power."""
        return self.model / max(self.model + self.noise, _TINY)

    def dilution(self, place: Place) -> tuple[float, float]:
        """Factor of what the model has, and share of what Gaussian noise would have."""
        share = self.share
        if place.kind in _FIRST_ORDER_KINDS:
            return share, 1 - share
        if place.domain == "cyclic":
            return self.coherent, 1 - self.coherent
        return share**2, self.concentration if place.domain == "envelope" else 1 - share**2


def _bands(simulated: Features, rows: NDArray[np.bool_]) -> set[tuple[float, float] | None]:
    """Bands of a channel whose power is known; None for all frequencies."""
    return {simulated.places[k].band_hz for k in np.flatnonzero(rows) if simulated.places[k].kind == "rms"}
