"""Domain psd: power spectral density of what is left between the lines, in fractions of an octave.

Bins next to harmonics of the masked shafts and to tones are left out. The level is in dB of the record's
unit squared per Hz. Of n bins of Hann windows the mean of noise has the relative variance 1.944 / n per
independent window (sum of the squared covariances 1, 2/3, 1/6 of neighbouring bins).
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, united_variance
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.windows import HANN_SUM

__all__ = ["free_bins", "measure", "places"]

_BUDGET = 130
_FINEST = 6
_FEWEST_BINS = 4
_BIN_VARIANCE = 1.944
_LINE_HALF = 2.6  # bins
_TINY = 1e-300


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Bands of a sixth of an octave, wider where there are many channels, from a few bins up."""
    del materials
    low = 2 * _FEWEST_BINS / frame.window_s
    octaves = math.log2(frame.top_hz / low)
    per_octave = max(1, min(_FINEST, int(_BUDGET / len(frame.channels) / octaves)))
    count = max(1, math.floor(octaves * per_octave))
    edges = frame.top_hz * 2.0 ** (-np.arange(count, -1, -1) / per_octave)
    edges = edges[np.concatenate(([True], np.diff(edges) * frame.window_s >= _FEWEST_BINS))]
    found = []
    for channel in frame.channels:
        for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            found.append(Place("psd", channel, "band", math.sqrt(a * b), "Hz", b - a))
    return found


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Mean densities of the bands and their scatter from window to window."""
    level, std = np.full(len(wanted), np.nan), np.full(len(wanted), np.inf)
    hz = np.array([place.at for place in wanted])
    for channel in dict.fromkeys(place.channel for place in wanted):
        spectra = material.time_spectra(channel)
        free = free_bins(material, channel)
        density = np.where(free, spectra.power, 0.0) / (HANN_SUM * spectra.step)
        sums = _running(density)
        counts = _running(free.astype(np.float64))
        for k, place in enumerate(wanted):
            if place.channel != channel:
                continue
            low, high = _edges(place, spectra.step, free.shape[1])
            bins = counts[:, high] - counts[:, low]
            if bins.min() < 1:
                continue
            each = (sums[:, high] - sums[:, low]) / bins
            mean = max(float(each.mean()), _TINY)
            theory = mean**2 * _BIN_VARIANCE / float(bins.mean()) / spectra.averages
            variance = united_variance(theory, each, spectra.averages)
            level[k] = 10 * math.log10(mean)
            std[k] = max(DB * math.sqrt(variance) / mean, LEAST_STD_DB)
    return Levels.of(level, std, frequency_hz=hz, bandwidth_hz=np.ones(hz.size))


def free_bins(material: Material, channel: str) -> NDArray[np.bool_]:
    """Bins of each window of the time spectra that are next to no line, shape (windows, lines)."""
    spectra = material.time_spectra(channel)
    lines = spectra.power.shape[1]
    hz = np.arange(lines) * spectra.step
    free = np.ones((spectra.windows, lines), dtype=np.bool_)
    free[:, :3] = False
    width = _LINE_HALF * spectra.step
    own = [(at, unit) for name, at, unit in material.frame.tones if name == channel]
    for at, unit in own:
        if unit == "Hz":
            free &= np.abs(hz - at) > width
    if material.phase is None:
        return free
    # The middle half of a Hann window holds nearly all of its weight.
    length = (lines - 1) * 2
    starts = np.arange(spectra.windows) * max(1, length // 2)
    quarters = np.stack([material.turns_at(starts + share * length) for share in (0.25, 0.5, 0.75)])
    halves = np.diff(quarters, axis=0) / (0.25 * length) * material.rate_hz
    spread = np.maximum(np.abs(np.diff(halves, axis=0))[0] / halves.mean(axis=0), material.frame.smear)
    for window, (speed, doubt) in enumerate(zip(halves.mean(axis=0), spread, strict=True)):
        beside = width + doubt * hz
        for ratio in material.frame.masked_orders:
            turn = ratio * speed
            distance = np.abs(hz - np.round(hz / turn) * turn)
            # Where lines run into one another nothing lies between them.
            free[window] &= (distance > beside) | (beside > 0.3 * turn)
        for at, unit in own:
            if unit == "order":
                free[window] &= np.abs(hz - at * speed) > beside
    return free


def _running(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sums over the first 0, 1, 2 ... columns of each row."""
    out = np.zeros((rows.shape[0], rows.shape[1] + 1))
    np.cumsum(rows, axis=1, out=out[:, 1:])
    return out


def _edges(place: Place, step: float, lines: int) -> tuple[int, int]:
    """First bin of a band and the one after its last."""
    ratio = 0.5 * place.width / place.at
    low = place.at * (math.sqrt(1 + ratio**2) - ratio)
    return min(math.ceil(low / step), lines - 1), min(math.ceil((low + place.width) / step), lines)
