"""Sharp lines that belong to no shaft: supply, inverter, whirl, other machines, ball passes.

A line over time is a shaft's if it is as strong over the angle and lies at a multiple of a shaft's turn
there; what changes its frequency with the shaft is told from what does not by where the line is stronger.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from gearsim_dsp.noise_floor import LineTail
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.known_orders import nearest_turn
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.windows import WindowSpectra

__all__ = ["Tone", "peaks_of", "tones"]

_FALSE_ALARM = 1e-4
_FLOOR_WORTH = 14.0  # 64 bins of 1.5 each, a third of them for the trimming
_SHARP = 4.0  # a line's five bins hold four times what eight bins around them do
_SHARE = 0.5
_FAMILY_HARMONICS = 4
_SUPPLY_HZ = (50.0, 60.0)
_SUPPLY_MULTIPLES = 20


@dataclass(frozen=True, slots=True)
class Tone:
    """A line at `at` ("Hz" or "order"), its name, and its power over the noise floor in dB."""

    at: float
    unit: str
    label: str
    height_db: float


def peaks_of(spectra: WindowSpectra, least_line: int = 4) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Bins of sharp lines that noise would show once in 10^4 spectra, and their ratio to the floor."""
    mean = spectra.mean
    ratio = mean / np.maximum(spectra.floor, np.finfo(np.float64).tiny)
    averages = spectra.averages
    tail = LineTail(averages, averages * _FLOOR_WORTH)(ratio)
    peaks, _ = find_peaks(ratio, height=1.0, distance=3)
    peaks = peaks[(peaks >= max(least_line, 7)) & (peaks < ratio.size - 7)]
    peaks = peaks[tail[peaks] > math.log(ratio.size / _FALSE_ALARM)]
    around = np.array([*range(-6, -2), *range(3, 7)])
    line = mean[peaks[:, None] + np.arange(-2, 3)].sum(axis=1)
    beside = mean[peaks[:, None] + around].sum(axis=1)
    sharp = line > _SHARP * beside
    return peaks[sharp], ratio[peaks[sharp]]


def tones(material: Material, channel: str, top_order: float, count: int) -> list[Tone]:
    """The strongest `count` tones of a channel, strongest over the floor first."""
    frame = material.frame
    over_time = material.time_spectra(channel)
    found: list[Tone] = []
    over_angle = material.order_spectra(channel, top_order) if frame.has_orders else None
    bins, ratios = peaks_of(over_time)
    for k, ratio in zip(bins.tolist(), ratios.tolist(), strict=True):
        hz = _refined(over_time.mean, k) * over_time.step
        if hz > frame.top_hz:
            break
        if over_angle is not None and _is_turning(material, over_angle, over_time, hz, k):
            continue
        found.append(Tone(hz, "Hz", _name(frame, hz, material.speed_hz), 10 * math.log10(ratio)))
    if over_angle is not None:
        found += _in_orders(material, over_angle, over_time)
    return sorted(found, key=lambda tone: -tone.height_db)[:count]


def _is_turning(
    material: Material, over_angle: WindowSpectra, over_time: WindowSpectra, hz: float, k: int
) -> bool:
    """Whether a line over time is a shaft's."""
    order = hz / material.speed_hz
    near = 1.5 * over_angle.step + 0.7 * over_time.step / material.speed_hz + 2 * material.frame.smear * order
    if nearest_turn(material.frame.machine, order) > near:
        return False
    if (index := round(order / over_angle.step)) >= over_angle.power.shape[1] - 3:
        return True  # beyond the orders looked at nothing tells
    return _line(over_angle.mean, index, 3) >= _SHARE * _line(over_time.mean, k, 2)


def _in_orders(material: Material, over_angle: WindowSpectra, over_time: WindowSpectra) -> list[Tone]:
    """Lines that are sharper over the angle and lie at no multiple of a turn."""
    frame = material.frame
    found = []
    bins, ratios = peaks_of(over_angle)
    for k, ratio in zip(bins.tolist(), ratios.tolist(), strict=True):
        order = _refined(over_angle.mean, k) * over_angle.step
        if nearest_turn(frame.machine, order) < 2.5 * over_angle.step:
            continue
        index = round(order * material.speed_hz / over_time.step)
        inside = 3 <= index < over_time.power.shape[1] - 3
        if inside and _line(over_time.mean, index, 3) > 0.9 * _line(over_angle.mean, k, 2):
            continue  # as sharp over time: told there
        label = _name(frame, order * material.speed_hz, material.speed_hz)
        found.append(Tone(order, "order", label, 10 * math.log10(ratio)))
    return found


def _line(mean: NDArray[np.float64], k: int, half: int) -> float:
    return float(mean[max(k - half, 0) : k + half + 1].sum())


def _refined(mean: NDArray[np.float64], k: int) -> float:
    """Place of a line between bins: of a Hann window the logarithms of three bins are nearly a parabola."""
    left, middle, right = np.log(np.maximum(mean[k - 1 : k + 2], 1e-300))
    bend = 2 * middle - left - right
    return k + (0.5 * float(right - left) / float(bend) if bend > 0 else 0.0)


def _name(frame: Frame, hz: float, speed_hz: float) -> str:
    for supply in _SUPPLY_HZ:
        multiple = round(hz / supply)
        if 1 <= multiple <= _SUPPLY_MULTIPLES and abs(hz - multiple * supply) < 0.002 * hz:
            return f"tone at {multiple} x {supply:g} Hz of a supply"
    for family in frame.families:
        harmonic = round(hz / (speed_hz * family.order))
        off = abs(hz / (speed_hz * family.order) - harmonic)
        if 1 <= harmonic <= _FAMILY_HARMONICS and off < family.tolerance * harmonic:
            return f"{harmonic} x {family.label}"
    return "tone"


def strongest(lists: Sequence[list[Tone]], count: int, apart: dict[str, float]) -> list[Tone]:
    """The strongest tones of several records, those that coincide once."""
    kept: list[Tone] = []
    for tone in sorted((t for tones in lists for t in tones), key=lambda t: -t.height_db):
        if all(o.unit != tone.unit or abs(o.at - tone.at) > apart[tone.unit] for o in kept):
            kept.append(tone)
    return kept[:count]
