"""At which order a fault family really lies: bearings slip, and geometry is known to a tenth of a per cent.

A comb of harmonics is sought within the family's tolerance in the envelope spectra of each carrier band of
a channel (as the diagnosis does it, see `gearsim_dsp.comb`); where it is significant, the order is refined by
the phases of its lines in consecutive windows: how they advance on average, and how unevenly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.comb import comb_grid, score_combs
from gearsim_dsp.noise_floor import LineTail, local_floor, search_false_alarm
from gearsim_twin.compare.frame import Family, Frame
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.windows import hann

__all__ = ["Found", "find", "places_of"]

_FALSE_ALARM = 1e-4
_PADDING = 4
_FLOOR_LINES, _FLOOR_SHARE = 160, 0.45
_LOOKS_PER_CELL = 0.5
_PEAK_RATIO = 4.0
_NEARLY = 0.7
_SPREAD = 0.002
_LEAST_CAGE = 10.0
# A second family has a fifth of the modulation of the first, or may be made of differences between the lines
# of the first and those of the shafts: N turns less BPFO are BPFI.
_LESS = math.log(5.0)
_HARMONICS = 4
_SHAFT_HALF = 1.6
# Lines nearby pull the phase: at 40 dB by a hundredth of a turn over a way of several windows.
_INTERPOLATION_BINS = 0.002
_FEWEST_WINDOWS = 3
_OVERLAP = 2.5


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
    """Where one family is on one channel."""
    key = ("families", channel)
    kept = material._kept
    if key not in kept:
        kept[key] = _find_all(material, channel)
    return kept[key].get(family.label, _NOT)  # type: ignore[attr-defined, no-any-return]


def places_of(material: Material, channel: str, family: Family, expected: float) -> float:
    """The order to read a family at: where it was found, else where it is expected."""
    found = find(material, channel, family)
    return found.order if math.isfinite(found.order) else expected


@dataclass(frozen=True, slots=True)
class _Candidate:
    """The best comb of a family in one band."""

    family: Family
    score: float
    height: float
    band: int
    order: float


def _find_all(material: Material, channel: str) -> dict[str, Found]:
    """All families of a channel, the clearest first; the lines of one are no evidence for another."""
    found: dict[str, Found] = {}
    tallest = -math.inf
    left = list(material.frame.families)
    explained: list[float] = []
    while left:
        best = max((_best(material, channel, f, explained) for f in left), key=lambda c: c.score)
        if best.score <= 0:
            break
        left.remove(best.family)
        tallest = max(tallest, best.height)
        if best.height < tallest - _LESS:
            continue
        result = _refined(material, channel, best.band, best.order)
        off = abs(result.order / best.family.order - 1)
        if not off < best.family.tolerance + material.frame.smear:
            continue
        found[best.family.label] = result
        explained.append(result.order)
    return found


def _best(material: Material, channel: str, family: Family, explained: Sequence[float]) -> _Candidate:
    """The best comb of a family; its score is 0 where noise would show as much."""
    frame = material.frame
    seen: list[_Candidate] = []
    trials = float(len(frame.bands_hz))
    for band, band_hz in enumerate(frame.bands_hz):
        padded = _padded(material, channel, band_hz)
        if family.order * _HARMONICS / 2 > padded.ratio.size * padded.step:
            continue
        half = family.tolerance + frame.smear
        grid = comb_grid(
            family.order, half, padded.step, padded.ratio.size, family.sideband_order, padded.resolution
        )
        usable = _free_of_turns(material, padded) & ~_lines_of(frame, padded, explained)
        scores = score_combs(padded.tail[None, :], usable, grid)
        k = int(np.argmax(scores.score[0]))
        looks = 1.0 + _LOOKS_PER_CELL * 2 * half * family.order * 8 / padded.resolution
        score = float(scores.score[0, k])
        if search_false_alarm(min(1.0, math.exp(-max(score, 0.0))), looks * trials) > _FALSE_ALARM:
            continue
        comb = grid.harmonics[k]
        comb = comb[(comb >= 0) & usable[comb]]
        first = grid.harmonics[k, 0]
        if comb.size == 0 or (family.fault == "cage" and padded.ratio[first] < _LEAST_CAGE):
            continue
        height = float(np.mean(np.log(padded.ratio[comb])))
        seen.append(_Candidate(family, score, height, band, float(grid.fundamentals[k])))
    if not seen:
        return _Candidate(family, 0.0, 0.0, 0, math.nan)
    # Without noise a family is clear in every band, and the scores, which are capped, tell no more.
    top = max(c.score for c in seen)
    return max((c for c in seen if c.score >= _NEARLY * top), key=lambda c: c.height)


def _lines_of(frame: Frame, padded: _Padded, explained: Sequence[float]) -> NDArray[np.bool_]:
    """Lines of families that are found, with their sidebands of shafts and cages."""
    order = np.arange(padded.ratio.size) * padded.step
    lines = np.zeros(order.size, dtype=np.bool_)
    turns = {shaft.ratio for shaft in frame.machine.shafts}
    apart = turns | {2 * r for r in turns} | {f.order for f in frame.families if f.fault == "cage"}
    shifts = {0.0} | apart | {-s for s in apart}
    for fundamental in explained:
        for shift in shifts:
            number = np.maximum(1.0, np.round((order - shift) / fundamental))
            width = _SHAFT_HALF * padded.resolution + _SPREAD * order
            lines |= np.abs(order - shift - number * fundamental) < width
    return lines


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


def _refined(material: Material, channel: str, band: int, order: float) -> Found:
    """The order from how the phases of its clearest harmonics advance from window to window."""
    band_hz = material.frame.bands_hz[band]
    padded = _padded(material, channel, band_hz)
    windows, per_turn = material.envelope_windows(channel, band_hz)
    usable = _free_of_turns(material, padded)
    chosen, heights = [], []
    for number in range(1, _HARMONICS + 1):
        k = round(number * order / padded.step)
        if k + 1 < usable.size and usable[k]:
            ratio = float(padded.ratio[k - 1 : k + 2].max())
            heights.append(ratio)
            if ratio >= _PEAK_RATIO:
                chosen.append((number, ratio))
    # Elements slip at random: at high harmonics the phase walks by more than can be followed.
    chosen = [c for c in chosen if c[0] <= 2] or chosen
    if not chosen or windows.shape[0] < _FEWEST_WINDOWS:
        return _NOT
    length = windows.shape[1]
    hop = max(1, length // 2) / per_turn
    turns = np.arange(length) / per_turn
    weighted = windows * hann(length)
    steps, weights = [], []
    for number, ratio in chosen:
        line = weighted @ np.exp(-2j * np.pi * number * order * turns)
        line *= np.exp(-2j * np.pi * number * order * hop * np.arange(line.size))
        advance = np.diff(np.unwrap(np.angle(line))) / (2 * np.pi * number * hop)
        steps.append(advance)
        weights.append(number**2 * ratio)
    advance = np.average(np.stack(steps), axis=0, weights=weights)
    # White phase noise of variance 1 / (2 SNR) at both ends of the way; SNR is the ratio to the floor.
    way = hop * advance.size
    theory = 1.0 / sum(weights) / (2 * np.pi * way) ** 2
    # Windows overlap by half, so that a walking phase is smoothed and its steps are not independent.
    walk = _OVERLAP * float(np.var(advance, ddof=1)) / advance.size
    std = math.sqrt(max(theory, walk) + (_INTERPOLATION_BINS * padded.resolution) ** 2)
    height = 10 * math.log10(float(np.mean(heights)))
    return Found(order + float(advance.mean()), std, band, height)
