"""At which order a fault family really lies: bearings slip, and geometry is known to a tenth of a per cent.

A comb of harmonics is sought within the family's tolerance in the envelope spectra of each carrier band of
a channel (as the diagnosis does it, see `gearsim_dsp.comb`); where it is significant, the order is refined
in the spectra of consecutive windows, whose scatter tells how sure it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.comb import comb_grid, score_combs
from gearsim_dsp.noise_floor import LineTail, local_floor, search_false_alarm
from gearsim_twin.compare.frame import Family
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.windows import hann

__all__ = ["Found", "find", "places_of"]

_FALSE_ALARM = 1e-4
_PADDING = 4
_FLOOR_LINES, _FLOOR_SHARE = 160, 0.45
_LOOKS_PER_CELL = 0.5
_PEAK_RATIO = 4.0
_HARMONICS = 4
_SHAFT_HALF = 1.6
# What a parabola through the logarithms of padded Hann lines errs by, in bins of the window.
_INTERPOLATION_BINS = 0.004


@dataclass(frozen=True, slots=True)
class Found:
    """Where a family was found on a channel.

    `order` is NaN where the family is not significant anywhere; `std` belongs to it; `band` counts the
    frame's bands; `height_db` is the mean height of the harmonics over the floor.
    """

    order: float
    std: float
    band: int
    height_db: float


_NOT = Found(math.nan, math.inf, 0, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Padded:
    """Envelope spectra of one band, zero-padded: window by window, and their mean over the floor."""

    power: NDArray[np.float64]
    ratio: NDArray[np.float64]
    tail: NDArray[np.float64]
    step: float
    resolution: float


def find(material: Material, channel: str, family: Family) -> Found:
    """Search one family on one channel."""
    key = ("found", channel, family.label)
    kept = material._kept
    if key not in kept:
        kept[key] = _find(material, channel, family)
    return kept[key]  # type: ignore[return-value]


def places_of(material: Material, channel: str, family: Family, expected: float) -> float:
    """The order to read a family at: where it was found, else where it is expected."""
    found = find(material, channel, family)
    return found.order if math.isfinite(found.order) else expected


def _find(material: Material, channel: str, family: Family) -> Found:
    frame = material.frame
    best: tuple[float, int, float] = (-math.inf, 0, math.nan)
    trials = 1.0
    for band, band_hz in enumerate(frame.bands_hz):
        padded = _padded(material, channel, band_hz)
        if family.order * _HARMONICS / 2 > padded.ratio.size * padded.step:
            continue
        half = family.tolerance + frame.smear
        grid = comb_grid(
            family.order, half, padded.step, padded.ratio.size, family.sideband_order, padded.resolution
        )
        usable = _free_of_turns(material, padded)
        scores = score_combs(padded.tail[None, :], usable, grid)
        k = int(np.argmax(scores.score[0]))
        looks = 1.0 + _LOOKS_PER_CELL * 2 * half * family.order * 8 / padded.resolution
        trials = max(trials, looks)
        if scores.score[0, k] > best[0]:
            best = (float(scores.score[0, k]), band, float(grid.fundamentals[k]))
    count = trials * len(frame.bands_hz)
    if search_false_alarm(min(1.0, math.exp(-max(best[0], 0.0))), count) > _FALSE_ALARM:
        return _NOT
    return _refined(_padded(material, channel, frame.bands_hz[best[1]]), best[1], best[2])


def _padded(material: Material, channel: str, band_hz: tuple[float, float]) -> _Padded:
    key = ("padded", channel, band_hz)
    if key not in material._kept:
        windows, per_turn = material.envelope_windows(channel, band_hz)
        length = windows.shape[1]
        lines = sfft.rfft(windows * hann(length), _PADDING * length, axis=1)
        power = np.asarray(lines.real**2 + lines.imag**2) * (2.0 / (0.5 * length) ** 2)
        averages = material.envelope_spectra(channel, band_hz).averages
        mean = np.maximum(power.mean(axis=0), np.finfo(np.float64).tiny)
        block = min(_FLOOR_LINES, max(16, mean.size // 4))
        floor = local_floor(mean, block, averages, 3 * _PADDING)
        ratio = mean / floor
        tail = LineTail(averages, averages * _FLOOR_SHARE * block / 2)(ratio)
        resolution = per_turn / length
        material._kept[key] = _Padded(power, ratio, tail, resolution / _PADDING, resolution)
    return material._kept[key]  # type: ignore[return-value]


def _free_of_turns(material: Material, padded: _Padded) -> NDArray[np.bool_]:
    ratios = tuple(sorted({shaft.ratio for shaft in material.frame.machine.shafts}))
    return _free(ratios, padded.ratio.size, padded.step, padded.resolution)


@lru_cache(maxsize=16)
def _free(ratios: tuple[float, ...], lines: int, step: float, resolution: float) -> NDArray[np.bool_]:
    order = np.arange(lines) * step
    free = order > 2.5 * resolution
    for ratio in ratios:
        distance = np.abs(order - np.round(order / ratio) * ratio)
        free &= distance > min(_SHAFT_HALF * resolution, 0.25 * ratio)
    free.flags.writeable = False
    return np.asarray(free)


def _refined(padded: _Padded, band: int, order: float) -> Found:
    """The order from the interpolated peaks of the harmonics in each window, and how they scatter."""
    heights, each = [], []
    reach = max(1, round(0.6 * padded.resolution / padded.step))
    for row in padded.power:
        peaks = []
        for number in range(1, _HARMONICS + 1):
            centre = round(number * order / padded.step)
            low, high = centre - reach, centre + reach + 1
            if low < 2 or high >= row.size - 1:
                continue
            k = low + int(np.argmax(row[low:high]))
            ratio = float(padded.ratio[k])
            if k in (low, high - 1) or ratio < _PEAK_RATIO:
                continue
            left, middle, right = np.log(np.maximum(row[k - 1 : k + 2], 1e-300))
            shift = 0.5 * (right - left) / max(2 * middle - left - right, 1e-9)
            peaks.append((number, (k + float(shift)) * padded.step / number, ratio))
        if peaks:
            table = np.array(peaks)
            strong = table[:, 2] >= 0.25 * table[:, 2].max()
            weight = table[:, 0] ** 2 * table[:, 2] * strong
            each.append((float(np.sum(weight * table[:, 1]) / np.sum(weight)), float(np.sum(weight))))
            heights.append(10 * math.log10(float(table[:, 2].mean())))
    if len(each) < 2:
        return _NOT
    values = np.array([value for value, _ in each])
    weight_sum = float(np.mean([weight for _, weight in each]))
    # Cramer and Rao: var f = 6 / (pi T)^2 / SNR per window of a boxcar; Hann doubles it (Rife 1976).
    theory = 2 * 6 / (math.pi**2 * 2 * max(weight_sum, 1e-9)) * padded.resolution**2 / len(each)
    bias = _INTERPOLATION_BINS * padded.resolution / 2
    independent = 1 + (len(each) - 1) * 0.6
    # Elements slip at random; Cramer and Rao know of noise alone.
    variance = max(theory, float(np.var(values, ddof=1)) / independent) + bias**2
    return Found(float(values.mean()), math.sqrt(variance), band, float(np.mean(heights)))
