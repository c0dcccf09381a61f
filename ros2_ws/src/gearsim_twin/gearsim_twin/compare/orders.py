"""Domain orders: lines of shafts, meshes, planets and carriers over the angle, and tones that belong to none.

Kinds: mesh, sideband, shaft, half, carrier, planet (at an order); tone (at an order, or in Hz); passage (see
`passage_places`). The level is that of the line's mean square, noise under it included, in dB of the record's
unit squared.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare import passage_places
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.known_orders import known_orders
from gearsim_twin.compare.levels import Levels, joined
from gearsim_twin.compare.lines import LineLevels, line_levels
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.tones import strongest

__all__ = ["measure", "places"]

_BUDGET, _FEWEST, _MOST = 130, 10, 42
_TONES = 10
_LEAST_TOP_ORDER = 40.0
_BINS = 5


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Known lines of the machine, as many as the number of channels allows, and the tones of the records."""
    found: list[Place] = []
    count = int(np.clip(_BUDGET // len(frame.channels), _FEWEST, _MOST))
    known = known_orders(frame.machine, _highest(frame), _apart(frame)) if frame.has_orders else ()
    kept = sorted(known[:count], key=lambda line: line.order)
    apart = {"Hz": 3.0 / frame.window_s, "order": _apart(frame)}
    each = max(3, min(_TONES, 40 // len(frame.channels)))
    for channel in frame.channels:
        for line in kept:
            width = (2 * frame.half_bins(line.order) + 1) / frame.window_turns
            found.append(Place("orders", channel, line.kind, line.order, "order", width, line.label))
        top = _top(frame) if frame.has_orders else 0.0
        for tone in strongest(materials, channel, top, each, apart):
            width = _BINS / (frame.window_s if tone.unit == "Hz" else frame.window_turns)
            found.append(Place("orders", channel, "tone", tone.at, tone.unit, width, tone.label))
    return [*found, *passage_places.places(frame, materials)]


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Levels of lines and tones, and of passages."""
    # Passages are the last of all places.
    lines = [place for place in wanted if place.kind != passage_places.KIND]
    found = _measured(material, lines)
    if len(lines) == len(wanted):
        return found
    return joined([found, passage_places.measure(material, wanted[len(lines) :])])


def _measured(material: Material, wanted: Sequence[Place]) -> Levels:
    at = np.array([place.at for place in wanted])
    level, std, height, clear = (np.full(at.size, np.nan) for _ in range(4))
    hz, bandwidth = np.full(at.size, np.nan), np.full(at.size, np.nan)
    in_orders = np.array([place.unit == "order" for place in wanted], dtype=np.bool_)
    # High multiples of a turn are read over time, at the record's own speed.
    over_angle = in_orders & (at <= (_top(material.frame) if material.frame.has_orders else np.inf))
    where = at * np.where(in_orders & ~over_angle, material.speed_hz, 1.0)
    for channel in dict.fromkeys(place.channel for place in wanted):
        for over_time in (False, True):
            rows = (over_angle != over_time) & np.array([p.channel == channel for p in wanted])
            if not rows.any():
                continue
            lines, step_hz, half = _lines(material, channel, over_time, where[rows])
            level[rows], std[rows] = lines.level_db, lines.std_db
            height[rows], clear[rows] = lines.height_db, lines.clear_db
            hz[rows] = where[rows] * (1.0 if over_time else material.speed_hz)
            bandwidth[rows] = (2 * half + 1) * step_hz
    return Levels.of(level, std, height_db=height, clear_db=clear, frequency_hz=hz, bandwidth_hz=bandwidth)


def _lines(
    material: Material, channel: str, over_time: bool, at: NDArray[np.float64]
) -> tuple[LineLevels, float, NDArray[np.intp]]:
    """Lines over time, at frequencies, or over the angle, at orders; step in Hz, half widths in bins."""
    frame = material.frame
    if over_time:
        spectra = material.time_spectra(channel)
        half = np.full(at.size, 2, dtype=np.intp)
        return line_levels(spectra, at, half), spectra.step, half
    spectra = material.order_spectra(channel, _top(frame))
    half = np.array([frame.half_bins(order) for order in at], dtype=np.intp)
    return line_levels(spectra, at, half), spectra.step * material.speed_hz, half


def _highest(frame: Frame) -> float:
    """The highest order that all records hold."""
    return 0.98 * frame.top_hz / frame.speed_hz


def _top(frame: Frame) -> float:
    """The highest order transformed."""
    known = known_orders(frame.machine, _highest(frame), _apart(frame)) if frame.has_orders else ()
    last = max((line.order for line in known), default=0.0)
    return float(min(max(1.1 * last, _LEAST_TOP_ORDER), _highest(frame)))


def _apart(frame: Frame) -> float:
    """Two lines closer than this share bins."""
    return _BINS / frame.window_turns
