"""Domain statistics: levels and shapes of bands, and how steady the level is over the record.

Kinds: rms (dB of the unit squared) and kurtosis of a band, and of the whole channel crest (peak over rms),
asymmetry (mean square above over below zero), drift (change of the short-time level over the record),
fluctuation (scatter of the short-time power, in dB of 0.2 dB), quiet and loud (its extremes over its mean).
Standard deviations are those of figures of parts of the record, left out in turn. Steadiness is told of
powers, not of levels, so that what noise makes of it follows in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, jackknife
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place

__all__ = ["measure", "places"]

_PARTS, _FEWEST_PARTS = 12, 6
_FIGURES = ("rms", "kurtosis", "crest", "asymmetry", "drift", "fluctuation", "quiet", "loud")
_BLOCKS = 40
_SCATTER_DB = 0.2
_LEAST_SHARE = 1e-4
_EXTREME, _MOST_STD_DB = 2.2, 10.0
_THEORY_PARTS = 4.0
_GAUSS_KURTOSIS_DB = 10 * math.log10(3.0)
_GAUSS_BAND_DB = 10 * math.log10(2.0)


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """The figures of every channel."""
    del materials
    found: list[Place] = []
    for channel in frame.channels:
        for kind in _FIGURES:
            found.append(Place("statistics", channel, kind, 0.0, "1", 1.0))
        for band in frame.bands_hz:
            middle = math.sqrt(band[0] * band[1])
            for kind in ("rms", "kurtosis"):
                found.append(Place("statistics", channel, kind, middle, "Hz", band[1] - band[0], "", band))
    return found


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """The figures with their standard deviations."""
    rows = [_figure(material, place) for place in wanted]
    level, std, gauss = np.array(rows, dtype=np.float64).reshape(-1, 3).T
    hz = np.array([p.at if p.kind == "rms" and p.band_hz is not None else np.nan for p in wanted])
    width = np.array([p.width if p.kind == "rms" and p.band_hz is not None else np.nan for p in wanted])
    return Levels.of(level, std, frequency_hz=hz, bandwidth_hz=width, gauss_db=gauss)


def _figure(material: Material, place: Place) -> tuple[float, float, float]:
    """Level, standard deviation, and the level of Gaussian noise (NaN where noise is no matter)."""
    if place.band_hz is not None:
        power, edges = _band_power(material, place.channel, place.band_hz)
        parts = _means(edges, power, power**2)
        if place.kind == "rms":
            return (*_of_parts(parts, lambda m: _db(m[0])), math.nan)
        return (*_of_parts(parts, lambda m: _db(m[1] / max(m[0] ** 2, 1e-300))), _GAUSS_BAND_DB)
    x = material.samples(place.channel)
    square = x * x
    edges = _edges(material, x.size, 0, 1.0, _PARTS)
    if place.kind == "rms":
        return (*_of_parts(_means(edges, square), lambda m: _db(m[0])), math.nan)
    if place.kind == "kurtosis":
        parts = _means(edges, square, square * square)
        return (*_of_parts(parts, lambda m: _db(m[1] / max(m[0] ** 2, 1e-300))), _GAUSS_KURTOSIS_DB)
    if place.kind == "asymmetry":
        parts = _means(edges, np.where(x > 0, square, 0.0), np.where(x < 0, square, 0.0))
        return (*_of_parts(parts, lambda m: _db(m[0]) - _db(m[1])), math.nan)
    if place.kind == "crest":
        return _crest(square, edges)
    return _steadiness(material, square, place.kind)


def _db(value: float) -> float:
    return 10 * math.log10(max(float(value), 1e-300))


def _edges(material: Material, count: int, first: float, stride: float, most: int) -> NDArray[np.intp]:
    """Where parts of a signal begin and the last one ends: up to `most`, of whole turns if there are six.

    Sample i of the signal is sample `first` + i * `stride` of the record.
    """
    even = np.asarray(np.linspace(0, count, most + 1), dtype=np.intp)
    if material.phase is None:
        return even
    turns = material.turns_at(first + stride * np.array([0.0, count - 1.0]))
    whole = math.floor(turns[1] - turns[0])
    if whole < _FEWEST_PARTS:
        return even
    each = -(-whole // most)
    marks = turns[0] + each * np.arange(whole // each + 1)
    at = (np.interp(marks, material.phase.turns, material.phase.samples) - first) / stride
    return np.asarray(np.clip(np.round(at), 0, count), dtype=np.intp)


def _means(edges: NDArray[np.intp], *signals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means over the parts of the record, shape (parts, signals)."""
    sums = [np.add.reduceat(s[: edges[-1]], edges[:-1]) for s in signals]
    return np.stack(sums, axis=1) / np.diff(edges)[:, None]


def _band_power(
    material: Material, channel: str, band: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    power, first, stride = material.band_power(channel, band)
    return power, _edges(material, power.size, first, stride, _PARTS)


def _of_parts(parts: NDArray[np.float64], figure: object) -> tuple[float, float]:
    value, pseudo = jackknife(parts, figure)  # type: ignore[arg-type]
    return value, max(float(pseudo.std(ddof=1)) / math.sqrt(parts.shape[0]), LEAST_STD_DB)


def _crest(square: NDArray[np.float64], edges: NDArray[np.intp]) -> tuple[float, float, float]:
    """Mean over the parts of the peak, over the rms of all."""
    peaks = np.maximum.reduceat(square[: edges[-1]], edges[:-1])
    each = 10 * np.log10(np.maximum(peaks, 1e-300) / max(float(square.mean()), 1e-300))
    # The largest of n Gaussian values is about sqrt(2 ln n) of them.
    gauss = 10 * math.log10(2 * math.log(max(square.size // _PARTS, 3)))
    return float(each.mean()), max(float(each.std(ddof=1)) / math.sqrt(each.size), LEAST_STD_DB), gauss


def _steadiness(material: Material, square: NDArray[np.float64], kind: str) -> tuple[float, float, float]:
    """Drift, scatter and extremes of the power of short blocks, each a turn of the shaft or longer."""
    edges = _edges(material, square.size, 0, 1.0, _BLOCKS)
    power = _means(edges, square)[:, 0]
    share = power / max(float(power.mean()), 1e-300)
    count = power.size
    time = 0.5 * (edges[1:] + edges[:-1]) / square.size
    time = time - time.mean()
    # A block of n samples of white noise has a power known to sqrt(2 / n) of it.
    chance = math.sqrt(2.0 * count / square.size)
    if kind == "drift":
        return (*_drift(time, 10 * np.log10(np.maximum(share, _LEAST_SHARE))), math.nan)
    rest = share - 1.0 - time * (np.sum(time * share) / np.sum(time**2))
    scatter = float(np.sqrt(np.sum(rest**2) / (count - 2)))
    if kind == "fluctuation":
        value = 1 + (DB * scatter / _SCATTER_DB) ** 2
        # The variance of a variance, with the kurtosis that the blocks have.
        kurtosis = float(np.mean(rest**4) / max(float(np.mean(rest**2)) ** 2, 1e-300))
        spread = math.sqrt(max(kurtosis - 1, 2.0) / count)
        std = max(DB * (1 - 1 / value) * spread, LEAST_STD_DB)
        return 10 * math.log10(value), std, 10 * math.log10(1 + (DB * chance / _SCATTER_DB) ** 2)
    # Extremes of some forty Gaussian values are 2.2 standard deviations off and scatter by 0.45 of one.
    side = -1.0 if kind == "quiet" else 1.0
    extreme = max(float(side * np.max(side * share)), _LEAST_SHARE)
    std = max(min(DB * 0.5 * scatter / extreme, _MOST_STD_DB), LEAST_STD_DB)
    return 10 * math.log10(extreme), std, 10 * math.log10(1 + side * _EXTREME * min(chance, 0.4))


def _drift(time: NDArray[np.float64], level: NDArray[np.float64]) -> tuple[float, float]:
    """Slope of levels over the record, and its standard deviation."""
    squares = float(np.sum(time**2))
    slope = float(np.sum(time * level)) / squares
    rest = level - level.mean() - slope * time
    scatter = math.sqrt(float(np.sum(rest**2)) / (level.size - 2))
    return slope, max(scatter / math.sqrt(squares), LEAST_STD_DB)
