"""Domain transient: what an impact looks like when many are laid over one another, and the turn of a shaft.

Kinds: decay (duration of the averaged burst of a family, dB of 1 ms), centre (its centre frequency, dB of
1 kHz), spacing (time from its first to a second impact, dB of 1 ms), and peak (of the envelope averaged over
the turns of a shaft, over its mean); and what single teeth do (`turns`). A family is looked at where it is
found, in the carrier band where it is clearest; each of its periods is shifted so that the loudest moments
coincide, as elements slip at random. Standard deviations: eight groups of periods, left out in turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.ndimage import uniform_filter1d
from scipy.signal import find_peaks

from gearsim_twin.compare.families import find
from gearsim_twin.compare.frame import Family, Frame
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import LEAST_STD_DB, jackknife
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.turns import KINDS, figure_of, turn_places

__all__ = ["measure", "places"]

_BUDGET = 56
_GROUPS = 8
_FEWEST_EVENTS = 3 * _GROUPS
_MOST_EVENTS = 600
_SMOOTH_S = 2.5e-4
_BEFORE, _AFTER = 0.1, 0.75
_SECOND_SHARE = 0.35
_CLEAR_PEAK_DB = 2.0
_IMPACTS = ("decay", "centre", "spacing")
_RAW_FAULTS = ("outer_race", "inner_race", "rolling_element")


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Impacts of the bearings' families and turns of the shafts, as many as the budget allows."""
    if not frame.has_orders:
        return []
    families = [f for f in frame.families if f.fault in _RAW_FAULTS]
    ratios = list(dict.fromkeys(round(shaft.ratio, 9) for shaft in frame.machine.shafts))[:3]
    each = _BUDGET // len(frame.channels)
    found: list[Place] = []
    for channel in frame.channels:
        mine = [
            Place("transient", channel, kind, f.order, "order", f.order * f.tolerance, f.label, band)
            for f in families
            for band in (_band(frame, channel, f, materials),)
            for kind in _IMPACTS
        ]
        for ratio in ratios:
            names = ", ".join(s.name for s in frame.machine.shafts if round(s.ratio, 9) == ratio)
            mine += [
                Place("transient", channel, "peak", ratio, "order", ratio, names, band)
                for band in frame.bands_hz
            ]
        found += mine[: max(each, len(_IMPACTS))]
    return found + turn_places(frame, materials)


def _band(frame: Frame, channel: str, family: Family, materials: Sequence[Material]) -> tuple[float, float]:
    """The band where the records have the family loudest; if none has it, the one below the highest."""
    loudness = np.zeros(len(frame.bands_hz))
    for material in materials:
        found = find(material, channel, family)
        if math.isfinite(found.order):
            loudness += [_loudness(material, channel, band, found.order) for band in frame.bands_hz]
    usual = max(0, len(frame.bands_hz) - 2)
    return frame.bands_hz[int(np.argmax(loudness)) if loudness.any() else usual]


def _loudness(material: Material, channel: str, band: tuple[float, float], order: float) -> float:
    """Power that a family modulates in a band."""
    spectra = material.envelope_spectra(channel, band)
    bins = [round(k * order / spectra.step) for k in (1, 2, 3)]
    excess = sum(max(float(spectra.mean[b] - spectra.floor[b]), 0.0) for b in bins if b < spectra.floor.size)
    return math.sqrt(excess) * float(material.envelope(channel, band).values.mean())


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Figures of averaged bursts and turns; places of families that are not found say nothing."""
    level, std, gauss = (np.full(len(wanted), value) for value in (np.nan, np.inf, np.nan))
    height, clear = np.full(len(wanted), np.inf), np.zeros(len(wanted))
    hz, bandwidth = np.full(len(wanted), np.nan), np.full(len(wanted), np.nan)
    for k, place in enumerate(wanted):
        if material.phase is None:
            continue
        if place.kind in KINDS:
            level[k], std[k], height[k], clear[k] = figure_of(material, place)
            if place.band_hz is not None and place.kind != "knock":
                hz[k], bandwidth[k] = math.sqrt(place.band_hz[0] * place.band_hz[1]), 0.0
        elif place.kind == "peak":
            level[k], std[k], height[k] = _turn_peak(material, place)
            gauss[k], clear[k] = 0.0, _CLEAR_PEAK_DB
        else:
            family = next(f for f in material.frame.families if f.label == place.label)
            assert place.band_hz is not None
            burst = _burst(material, place.channel, place.band_hz, family)
            level[k], std[k] = burst[_IMPACTS.index(place.kind)]
    return Levels.of(
        level,
        std,
        height_db=height,
        clear_db=clear,
        frequency_hz=hz,
        bandwidth_hz=bandwidth,
        gauss_db=gauss,
    )


def _turn_peak(material: Material, place: Place) -> tuple[float, float, float]:
    """Peak over mean of the averaged squared envelope, from groups of turns.

    The third value is how far it lies over the mean, relative to the highest peak that the scatter of the
    groups would give by chance: sqrt(2 ln n) standard deviations of n values.
    """
    assert place.band_hz is not None
    envelope = material.envelope(place.channel, place.band_hz)
    turns = material.turns_at(envelope.times) * place.at
    per_turn = int(np.clip(math.ceil(2 * material.frame.highest_envelope_order / place.at), 16, 2048))
    first, last = math.ceil(turns[0]), math.floor(turns[-1])
    whole = (last - first) // _GROUPS * _GROUPS
    if whole < 2 * _GROUPS:
        return math.nan, math.inf, math.nan
    grid = first + np.arange(whole * per_turn) / per_turn
    folded = np.interp(grid, turns, envelope.values).reshape(_GROUPS, -1, per_turn).mean(axis=1)

    def figure(mean: NDArray[np.float64]) -> float:
        return 10 * math.log10(max(float(mean.max()), 1e-300) / max(float(mean.mean()), 1e-300))

    value, pseudo = jackknife(folded, figure)
    mean = folded.mean(axis=0)
    scatter = math.sqrt(float(folded.var(axis=0, ddof=1).mean()) / _GROUPS * 2 * math.log(per_turn))
    height = 10 * math.log10(max(float(mean.max() - mean.mean()), 1e-300) / max(scatter, 1e-300))
    return value, max(float(pseudo.std(ddof=1)) / math.sqrt(_GROUPS), LEAST_STD_DB), height


@dataclass(frozen=True, slots=True, eq=False)
class _Events:
    """Periods of a family: analytic signal of the band, one row each, the loudest moment in one column."""

    rows: NDArray[np.complex128]
    zero: int
    period: int
    rate_hz: float
    low_hz: float


def _burst(
    material: Material, channel: str, band: tuple[float, float], family: Family
) -> tuple[tuple[float, float], ...]:
    """(level, standard deviation) of decay, centre and spacing."""
    key = ("burst", channel, band, family.label)
    if key not in material._kept:
        events = _events(material, channel, band, family)
        nothing = ((math.nan, math.inf),) * len(_IMPACTS)
        material._kept[key] = nothing if events is None else _figures(events)
    return material._kept[key]  # type: ignore[return-value]


def _events(material: Material, channel: str, band: tuple[float, float], family: Family) -> _Events | None:
    found = find(material, channel, family)
    if not math.isfinite(found.order):
        return None
    z, stride = material.analytic(channel, band)
    rate_hz = material.rate_hz / stride
    smooth = uniform_filter1d(z.real**2 + z.imag**2, max(3, round(_SMOOTH_S * rate_hz)))
    cycles = material.turns_at(stride * np.arange(z.size, dtype=np.float64)) * found.order
    period = max(8, round(z.size / float(cycles[-1] - cycles[0])))
    # The phase at which the folded envelope is loudest.
    bins = 64
    place = np.mod(cycles * bins, bins).astype(np.intp) % bins
    fold = np.bincount(place, smooth, bins) / np.maximum(np.bincount(place, minlength=bins), 1)
    loudest = (int(np.argmax(fold)) + 0.5) / bins
    numbers = np.arange(math.ceil(cycles[0]) + 1, math.floor(cycles[-1]) - 1)[:_MOST_EVENTS]
    if numbers.size < _FEWEST_EVENTS:
        return None
    centres = np.searchsorted(cycles, numbers + loudest)
    reach = period // 4
    near = centres[:, None] + np.arange(-reach, reach + 1)
    before, after = math.ceil(_BEFORE * period), math.ceil(_AFTER * period)
    near = near[(near[:, 0] - before >= 0) & (near[:, -1] + after < z.size)]
    if near.shape[0] < _FEWEST_EVENTS:
        return None
    tops = near[np.arange(near.shape[0]), np.argmax(smooth[near], axis=1)]
    rows = z[tops[:, None] + np.arange(-before, after)]
    return _Events(rows, before, period, rate_hz, band[0])


def _figures(events: _Events) -> tuple[tuple[float, float], ...]:
    count = events.rows.shape[0] // _GROUPS * _GROUPS
    grouped = events.rows[:count].reshape(_GROUPS, -1, events.rows.shape[1])
    power = (grouped.real**2 + grouped.imag**2).mean(axis=1)
    shape = uniform_filter1d(power, max(3, round(_SMOOTH_S * events.rate_hz)), axis=1)
    decay = jackknife(shape, lambda mean: _duration_db(mean, events))
    spacing = jackknife(shape, lambda mean: _second_db(mean, events))
    half = events.rows.shape[1] // 2
    spectra = [
        np.abs(sfft.fft(part * np.hanning(part.shape[-1]), axis=-1)) ** 2 for part in _halves(grouped, half)
    ]
    pair = np.stack([part.mean(axis=1) for part in spectra], axis=1)
    centre = jackknife(pair, lambda mean: _centre_db(mean, events))
    return tuple(_with_std(value, pseudo) for value, pseudo in (decay, centre, spacing))


def _halves(grouped: NDArray[np.complex128], half: int) -> tuple[NDArray[np.complex128], ...]:
    """The stretch around the impact and one without it, of one length."""
    return grouped[:, :, :half], grouped[:, :, -half:]


def _with_std(value: float, pseudo: NDArray[np.float64]) -> tuple[float, float]:
    if not (math.isfinite(value) and np.all(np.isfinite(pseudo))):
        return math.nan, math.inf
    return value, max(float(pseudo.std(ddof=1)) / math.sqrt(pseudo.size), LEAST_STD_DB)


def _excess(mean: NDArray[np.float64]) -> NDArray[np.float64]:
    """The averaged burst over what is there all the time."""
    return np.asarray(np.maximum(mean - np.quantile(mean, 0.3), 0.0))


def _duration_db(mean: NDArray[np.float64], events: _Events) -> float:
    """(sum a)^2 / sum a^2: of an exponential decay twice its time constant."""
    a = _excess(mean)
    square = float(np.sum(a**2))
    if square <= 0:
        return math.nan
    return 10 * math.log10(float(np.sum(a)) ** 2 / square / events.rate_hz * 1e3)


def _second_db(mean: NDArray[np.float64], events: _Events) -> float:
    """Time between the two highest tops, where the second has a third of the first."""
    a = _excess(mean)
    apart = max(2, round(2 * _SMOOTH_S * events.rate_hz))
    peaks, shape = find_peaks(
        a, height=_SECOND_SHARE * float(a.max()), distance=apart, prominence=0.2 * a.max()
    )
    if peaks.size < 2:
        return math.nan
    first, second = peaks[np.argsort(shape["peak_heights"])[-2:]]
    return 10 * math.log10(abs(int(second) - int(first)) / events.rate_hz * 1e3)


def _centre_db(pair: NDArray[np.float64], events: _Events) -> float:
    """Centroid of the power around the impact that is not there without it."""
    more = np.maximum(pair[0] - pair[1], 0.0)
    total = float(more.sum())
    if total <= 0:
        return math.nan
    hz = events.low_hz + np.arange(more.size) * (events.rate_hz / more.size)
    return 10 * math.log10(float(np.sum(more * hz)) / total / 1e3)
