"""Sharp lines that belong to no shaft: supply, inverter, whirl, other machines, ball passes.

A line over time is a shaft's if it is as strong over the angle and lies at a multiple of a shaft's turn
there. Low multiples and those near a mesh are compared anyway; others are told here with the shaft's name.
What changes its frequency with the shaft is told from what does not by where the line is stronger. Speeds
differ from record to record, so a shaft's line has its place in orders, wherever it is read.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from gearsim_dsp.angle.tracked_orders import all_mesh_orders
from gearsim_dsp.noise_floor import LineTail
from gearsim_dsp.spectra import good_length
from gearsim_io.nameplate import Machine
from gearsim_twin.compare.families import find
from gearsim_twin.compare.known_orders import nearest_turn
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.windows import WindowSpectra

__all__ = ["Tone", "peaks_of", "strongest", "tones"]

_FALSE_ALARM = 1e-4
_FLOOR_WORTH = 14.0  # 64 bins of 1.5 each, a third of them for the trimming
_SHARP = 4.0  # a line's five bins hold four times what five such as those around them do
_SHARE = 0.5
_LEAST_HEIGHT_DB = 6.0  # what the loudest of all bins of averaged noise hardly reaches
_FAMILY_HARMONICS = 3
_SHAFT_HARMONICS, _MESH_TURNS = 10, 5
_NEAR_SHARE = 0.03
_SUPPLY_HZ = (50.0, 60.0)
_SUPPLY_MULTIPLES = 20
_LINE_BINS = 6.0  # nearer lines run into one another


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
    peaks = peaks[(peaks >= least_line) & (peaks < ratio.size - 7)]
    peaks = peaks[tail[peaks] > math.log(ratio.size / _FALSE_ALARM)]
    around = np.array([*range(-6, -2), *range(3, 7)])
    line = mean[peaks[:, None] + np.arange(-2, 3)].sum(axis=1)
    # Below the first bins lies what is left of the mean.
    index = peaks[:, None] + around
    beside = np.nanmedian(np.where(index < 2, np.nan, mean[index]), axis=1)
    sharp = line > _SHARP * 5 * beside
    return peaks[sharp], ratio[peaks[sharp]]


def tones(material: Material, channel: str, top_order: float) -> list[Tone]:
    """All tones of a channel."""
    frame = material.frame
    over_time = material.time_spectra(channel)
    found: list[Tone] = []
    over_angle = material.order_spectra(channel, top_order) if frame.has_orders else None
    bins, ratios = peaks_of(over_time)
    for k, ratio in zip(bins.tolist(), ratios.tolist(), strict=True):
        hz = _refined(over_time.mean, k) * over_time.step
        if hz > frame.top_hz:
            break
        turn = None if over_angle is None else _turn(material, channel, top_order, hz, k)
        if turn is not None and _is_expected(frame.machine, hz / material.speed_hz):
            continue
        name = _name(material, channel, hz, 1.5 * over_time.step)
        if name is None:
            continue
        height_db = 10 * math.log10(ratio)
        if turn is None or "supply" in name:
            found.append(Tone(hz, "Hz", name if turn is None else f"{turn[1]} or {name}", height_db))
        else:
            found.append(Tone(turn[0], "order", turn[1], height_db))
    if over_angle is not None:
        found += _in_orders(material, channel, over_angle, over_time)
    return found


def _turn(material: Material, channel: str, top_order: float, hz: float, k: int) -> tuple[float, str] | None:
    """The multiple of a shaft that a line over time is, if it is one, and its name; `k` is its bin."""
    machine = material.frame.machine
    over_time = material.time_spectra(channel)
    step_hz = over_time.step
    slowest_hz = min(shaft.ratio for shaft in machine.shafts) * material.speed_hz
    if slowest_hz < _LINE_BINS * step_hz:
        # Multiples of a slow turn run into one another there, and their tops are no line's place.
        hz, step_hz = _placed(material, channel, hz, 2 * step_hz)
    order = hz / material.speed_hz
    # Between bins a line is placed to better than half of one.
    near = 0.5 * step_hz / material.speed_hz + 2 * material.frame.smear * order
    multiples = [(round(order / s.ratio), s) for s in machine.shafts]
    # Of a multiple of several turns the fastest one tells most.
    hits = [(n, s) for n, s in multiples if n and abs(order - n * s.ratio) <= near]
    if not hits:
        return None
    number, shaft = max(hits, key=lambda hit: hit[1].ratio)
    over_angle = material.order_spectra(channel, top_order)
    index = round(number * shaft.ratio / over_angle.step)
    inside = number * shaft.ratio <= top_order and index < over_angle.power.shape[1] - 3
    if inside and _line(over_angle.mean, index, 2) < _SHARE * _line(over_time.mean, k, 2):
        return None
    return number * shaft.ratio, f"{number} x {shaft.name}"


def _placed(material: Material, channel: str, hz: float, within_hz: float) -> tuple[float, float]:
    """Where the highest line near a frequency lies in the spectrum of the whole record, and its bins."""
    step_hz = material.rate_hz / good_length(material.samples(channel).size)
    lines = np.abs(material.lines(channel)) ** 2
    first = max(2, math.ceil((hz - within_hz) / step_hz))
    last = min(math.floor((hz + within_hz) / step_hz), lines.size - 3)
    if last < first:
        return hz, step_hz
    return _refined(lines, first + int(np.argmax(lines[first : last + 1]))) * step_hz, step_hz


def _is_expected(machine: Machine, order: float) -> bool:
    """Low harmonics of the shafts, and whatever lies within a few turns of a mesh harmonic."""
    most = max(shaft.ratio for shaft in machine.shafts)
    if order < (_SHAFT_HARMONICS + 0.5) * most:
        return True
    widest = (_MESH_TURNS + 0.5) * most
    return any(abs(order - max(1, round(order / m)) * m) < widest for m in all_mesh_orders(machine))


def _in_orders(
    material: Material, channel: str, over_angle: WindowSpectra, over_time: WindowSpectra
) -> list[Tone]:
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
        name = _name(material, channel, order * material.speed_hz, 1.5 * over_angle.step * material.speed_hz)
        if name is not None:
            found.append(Tone(order, "order", name, 10 * math.log10(ratio)))
    return found


def _line(mean: NDArray[np.float64], k: int, half: int) -> float:
    return float(mean[max(k - half, 0) : k + half + 1].sum())


def _refined(mean: NDArray[np.float64], k: int) -> float:
    """Place of a line between bins: of a Hann window the logarithms of three bins are nearly a parabola."""
    left, middle, right = np.log(np.maximum(mean[k - 1 : k + 2], 1e-300))
    bend = 2 * middle - left - right
    return k + (0.5 * float(right - left) / float(bend) if bend > 0 else 0.0)


def _name(material: Material, channel: str, hz: float, near_hz: float) -> str | None:
    """What a line is; None for what belongs to a family that is found, beyond its first harmonics.

    Impacts of a bearing bring a line at each of their harmonics, with sidebands of the shafts.
    """
    for supply in _SUPPLY_HZ:
        multiple = round(hz / supply)
        # A line is placed to a fifth of that distance; a public supply holds its frequency to 0.1 %.
        if 1 <= multiple <= _SUPPLY_MULTIPLES and abs(hz - multiple * supply) < max(0.2 * near_hz, 1e-3 * hz):
            return f"tone at {multiple} x {supply:g} Hz of a supply"
    frame = material.frame
    turns = {0.0, *(shaft.ratio for shaft in frame.machine.shafts)}
    for family in frame.families if frame.has_orders else ():
        found = find(material, channel, family)
        if not math.isfinite(found.order):
            continue
        for shift in turns | {-turn for turn in turns}:
            order = hz / material.speed_hz - shift
            number = max(1, round(order / found.order))
            # At high harmonics the doubt of the order exceeds their distance: there nothing is told by it.
            near = min(near_hz / material.speed_hz + 2 * number * found.std, _NEAR_SHARE * found.order)
            if abs(order - number * found.order) < near:
                own = shift == 0.0 and number <= _FAMILY_HARMONICS
                return f"{number} x {family.label}" if own else None
    return "tone"


def strongest(
    materials: Sequence[Material], channel: str, top_order: float, count: int, apart: dict[str, float]
) -> list[Tone]:
    """The strongest tones of several records, those that coincide once.

    A tone is measured by the loudest noise of all records: what a simulation without noise shows far below
    that of a measurement can never be compared.
    """
    found = []
    for material in materials:
        for tone in tones(material, channel, top_order):
            over = tone.height_db + _floor_db(material, channel, tone, top_order)
            over -= max(_floor_db(other, channel, tone, top_order) for other in materials)
            if over >= _LEAST_HEIGHT_DB:
                found.append(replace(tone, height_db=over))
    kept: list[Tone] = []
    for tone in sorted(found, key=lambda t: -t.height_db):
        if all(o.unit != tone.unit or abs(o.at - tone.at) > apart[tone.unit] for o in kept):
            kept.append(tone)
    return kept[:count]


def _floor_db(material: Material, channel: str, tone: Tone, top_order: float) -> float:
    """Noise per bin at a tone's place."""
    at = tone.at
    over_time = tone.unit == "Hz" or tone.at > top_order
    if over_time and tone.unit == "order":
        at *= material.speed_hz
    spectra = material.time_spectra(channel) if over_time else material.order_spectra(channel, top_order)
    index = min(round(at / spectra.step), spectra.floor.size - 1)
    return 10 * math.log10(max(float(spectra.floor[index]), 1e-300))
