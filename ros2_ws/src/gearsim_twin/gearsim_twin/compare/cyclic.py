"""Domain cyclic: squared cyclic coherence of carrier bands at fault families and at turns of the shafts.

    g(a, f) = sum X(f) X*(f - a) / sqrt(sum |X(f)|^2 sum |X(f - a)|^2)

over the lines of a cell, window by window; |g|^2 is averaged over windows and the cells of a band, and summed
over three neighbouring shifts, so that it does not matter where between two lines the cyclic frequency lies.
Every cell counts the same however loud it is: what the envelope of a band owes to one resonance is seen
here in all of them. Of n independent lines noise has |g|^2 = 1 / n on average (see `gearsim_dsp.cyclic`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.spectra import good_length
from gearsim_twin.compare.families import places_of
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.levels import Levels, nothing
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, united_variance
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.windows import cut, hann

__all__ = ["measure", "places"]

_BUDGET = 60
_SHIFTS = (-1, 0, 1)
_CELL_HZ, _MOST_CELLS = 200.0, 64
_FEWEST_LINES = 24
_BIN_VARIANCE = 1.944
_LEAST_BINS_APART = 4
_CLEAR_SIGMA = 3.0


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Families, then turns of shafts, in every band of every channel, as many as the budget allows."""
    del materials
    if not frame.has_orders:
        return []
    alphas = [(f.order, f.label) for f in frame.families]
    for ratio in dict.fromkeys(round(shaft.ratio, 9) for shaft in frame.machine.shafts):
        names = ", ".join(s.name for s in frame.machine.shafts if round(s.ratio, 9) == ratio)
        alphas.append((ratio, f"turn of {names}"))
    # Closer to zero a cyclic frequency is not told from the window itself.
    alphas = [(a, label) for a, label in alphas if a * frame.speed_hz * frame.window_s > _LEAST_BINS_APART]
    each = max(1, _BUDGET // (len(frame.channels) * len(frame.bands_hz)))
    width = len(_SHIFTS) / (frame.window_s * frame.speed_hz)
    return [
        Place("cyclic", channel, "coherence", order, "order", width, label, band)
        for channel in frame.channels
        for band in frame.bands_hz
        for order, label in alphas[:each]
    ]


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Mean squared coherence of each band."""
    if material.phase is None:
        return nothing(len(wanted))
    out = np.full((5, len(wanted)), np.nan)
    groups: dict[tuple[str, float, str], list[int]] = {}
    for k, place in enumerate(wanted):
        groups.setdefault((place.channel, place.at, place.label), []).append(k)
    for (channel, at, label), rows in groups.items():
        family = next((f for f in material.frame.families if f.label == label), None)
        order = at if family is None else places_of(material, channel, family, at)
        lines, step_hz = _lines(material, channel)
        cells = _cells(lines, order * material.speed_hz / step_hz, step_hz, material.frame.top_hz)
        for k in rows:
            band = wanted[k].band_hz
            assert band is not None
            out[:, k] = _in_band(cells, band, _cell_lines(step_hz, material.frame.top_hz), step_hz)
    level, std, height, clear, gauss = out
    return Levels.of(level, std, height_db=height, clear_db=clear, gauss_db=gauss)


def _lines(material: Material, channel: str) -> tuple[NDArray[np.complex64], float]:
    """Complex spectra of the windows over time, and the distance of their lines."""
    key = ("cyclic lines", channel)
    if key not in material._kept:
        x = material.samples(channel)
        length = good_length(min(x.size, max(64, round(material.frame.window_s * material.rate_hz))))
        scale = float(np.sqrt(np.mean(x**2))) or 1.0
        windows = (cut(x, length) * (hann(length) / scale)).astype(np.float32)
        material._kept[key] = (sfft.rfft(windows, axis=1), material.rate_hz / length)
    return material._kept[key]  # type: ignore[return-value]


def _cell_lines(step_hz: float, top_hz: float) -> int:
    return max(_FEWEST_LINES, round(max(_CELL_HZ, top_hz / _MOST_CELLS) / step_hz))


def _cells(lines: NDArray[np.complex64], shift: float, step_hz: float, top_hz: float) -> NDArray[np.float64]:
    """|g|^2 summed over the shifts, shape (windows, cells); cell c begins at line c * width."""
    width = _cell_lines(step_hz, top_hz)
    count = lines.shape[1] // width
    total = np.zeros((lines.shape[0], count))
    power = _sums((lines.real**2 + lines.imag**2), width, count)
    for offset in _SHIFTS:
        k = round(shift) + offset
        lower = np.zeros_like(lines)
        lower[:, k:] = lines[:, :-k]
        product = _sums(lines * np.conj(lower), width, count)
        below = _sums(lower.real**2 + lower.imag**2, width, count)
        total += np.abs(product) ** 2 / np.maximum(power * below, 1e-30)
    return total


def _sums(values: NDArray[Any], width: int, count: int) -> NDArray[Any]:
    return np.asarray(values[:, : width * count].reshape(values.shape[0], count, width).sum(axis=2))


def _in_band(
    cells: NDArray[np.float64], band: tuple[float, float], width: int, step_hz: float
) -> tuple[float, float, float, float, float]:
    """Level, standard deviation, height, clear height and level of noise."""
    low = max(1, math.ceil(band[0] / (width * step_hz)))
    high = min(cells.shape[1], max(low + 1, math.floor(band[1] / (width * step_hz))))
    if low >= high:
        return math.nan, math.inf, math.nan, math.nan, math.nan
    part = cells[:, low:high]
    each = part.mean(axis=1)
    value = max(float(each.mean()), 1e-12)
    noise = len(_SHIFTS) * _BIN_VARIANCE / width
    windows = cells.shape[0]
    independent = windows / (1 + (windows - 1) / (18 * windows))
    # Shifts next to one another share two thirds of their amplitude: their sum varies like two of them.
    looks = 1.5 * part.shape[1] * independent
    theory = value * noise / looks + value**2 * noise / looks
    variance = united_variance(theory, each, independent)
    return (
        10 * math.log10(value),
        max(DB * math.sqrt(variance) / value, LEAST_STD_DB),
        10 * math.log10(value / noise),
        _CLEAR_SIGMA * DB / math.sqrt(looks),
        10 * math.log10(noise),
    )
