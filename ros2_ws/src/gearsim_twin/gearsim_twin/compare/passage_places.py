"""Places of the domain orders at which passages of rolling elements are compared: runs of their harmonics.

Kind: passage, four neighbouring harmonics of a fault family with the sidebands next to them. The level is
that of their mean square together, noise under them included. How a resonance shares its lift out among
single harmonics hangs on a per cent of its frequency; four of them together are lifted alike. There are such
places only where noise does not explain the lines of a record (see `passages`) and a sound model's would
drown in it: where they do not, they hang on the clearance too much. Each side is read where its own lines
lie.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.compare.frame import Family, Frame
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import comb_levels
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.passages import (
    ANGLE_MARKS,
    Found,
    LongLines,
    best_comb,
    first_harmonic,
    found_all,
    long_lines,
    orders_of,
    probable,
)
from gearsim_twin.compare.places import Place

__all__ = ["KIND", "measure", "places"]

KIND = "passage"
_RUN = 4
_MOST_RUNS, _MOST_PLACES = 4, 8
_LEAST_NATS = 7.0  # of a single run, at a fundamental that is known
_FOUND_NATS = 3.0
_SAME_NOISE = 0.1
_HALF_BINS = 1  # orders are known to a sixth of a line, and what is further out is mostly noise


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Runs of harmonics that stand out of records, a few to a channel."""
    if not frame.has_orders or not frame.families:
        return []
    found: list[Place] = []
    for channel in frame.channels:
        known = [each for each in (_lines(material, channel) for material in materials) if each is not None]
        if known:
            found += _of_channel(frame, channel, known)
    return found


def _of_channel(frame: Frame, channel: str, known: list[LongLines]) -> list[Place]:
    """Runs that records show over their noise, and simulations, which have none, would not."""
    shortest = min(one.size for one in known)
    floor = np.max(np.stack([_on(one, known[0], shortest) for one in known]), axis=0)
    level = [float(np.median(one.spectra.floor)) for one in known]
    noisy, quiet = [], []
    for one, own in zip(known, level, strict=True):
        if own > _SAME_NOISE * max(level):
            noisy.append(one)
        else:
            at = np.arange(one.size) * one.spectra.step / known[0].spectra.step
            quiet.append(one.floored(np.interp(at, np.arange(floor.size), floor)))
    turns = sorted({shaft.ratio for shaft in frame.machine.shafts})
    found: list[tuple[float, Place]] = []
    for family, comb in found_all(noisy, frame.families, turns, len(frame.channels)):
        found += _runs(frame, channel, noisy, quiet, family, comb)
    return [place for _, place in sorted(found, key=lambda each: -each[0])[:_MOST_PLACES]]


def _on(one: LongLines, axis: LongLines, size: int) -> NDArray[np.float64]:
    """Floor of one spectrum at the lines of another."""
    at = np.arange(size) * axis.spectra.step / one.spectra.step
    return np.asarray(np.interp(at, np.arange(one.size), one.spectra.floor))


def _runs(
    frame: Frame,
    channel: str,
    pool: list[LongLines],
    quiet: list[LongLines],
    family: Family,
    comb: Found,
) -> list[tuple[float, Place]]:
    top = min(one.size * one.spectra.step for one in pool)
    last = math.floor(top / comb.order) - 1
    found = []
    for first in range(first_harmonic(frame.families, family, top), last - _RUN + 2, _RUN):
        nats = probable(pool, family, comb.order, first, _RUN)
        if nats > _LEAST_NATS and all(_hidden(one, family, first) for one in quiet):
            at, width = first * comb.order, (2 * _HALF_BINS + 1) * pool[0].spectra.step
            label = f"{first} x {family.label}"
            found.append((nats, Place("orders", channel, KIND, at, "order", width, label)))
    return sorted(found, key=lambda each: -each[0])[:_MOST_RUNS]


def _hidden(quiet: LongLines, family: Family, first: int) -> bool:
    """Whether noise of the records would hide a run of a simulation."""
    found = best_comb([quiet], family, first, runs=[(first, _RUN)])
    return found is None or found.nats < _FOUND_NATS


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Levels of runs, each read where the family lies on this side."""
    level, std, height, clear = (np.full(len(wanted), np.nan) for _ in range(4))
    hz, bandwidth = np.full(len(wanted), np.nan), np.full(len(wanted), np.nan)
    groups: dict[tuple[str, str], list[int]] = {}
    for k, place in enumerate(wanted):
        groups.setdefault((place.channel, _label(place)), []).append(k)
    for (channel, label), rows in groups.items():
        lines = _lines(material, channel)
        family = next((f for f in material.frame.families if f.label == label), None)
        if lines is None or family is None:
            continue
        runs = [_first(wanted[k]) for k in rows]
        order = _order(lines, family, runs, wanted[rows[0]].at / runs[0])
        for k, first in zip(rows, runs, strict=True):
            comb = [each for each in orders_of(family, order, first, _RUN) if _usable(lines, each)]
            half = np.array([_HALF_BINS], dtype=np.intp)
            found = comb_levels(lines.spectra, [comb], half)
            level[k], std[k] = found.level_db[0], found.std_db[0]
            height[k], clear[k] = found.height_db[0], found.clear_db[0]
            hz[k] = (first + 0.5 * (_RUN - 1)) * order * material.speed_hz
            bandwidth[k] = (2 * _HALF_BINS + 1) * max(len(comb), 1) * lines.spectra.step * material.speed_hz
    return Levels.of(level, std, height_db=height, clear_db=clear, frequency_hz=hz, bandwidth_hz=bandwidth)


def _order(lines: LongLines, family: Family, runs: list[int], expected: float) -> float:
    """Where a family lies in one record; where the records for training have it if that does not show."""
    found = best_comb([lines], family, runs[0], runs=[(first, _RUN) for first in runs])
    return expected if found is None or found.nats < _FOUND_NATS else found.order


def _usable(lines: LongLines, order: float) -> bool:
    k = round(order / lines.spectra.step)
    return 0 < k < lines.size and bool(lines.usable[k])


def _label(place: Place) -> str:
    return place.label.split(" x ", 1)[1]


def _first(place: Place) -> int:
    return int(place.label.split(" x ", 1)[0])


def _lines(material: Material, channel: str) -> LongLines | None:
    key = ("long lines", channel)
    if key not in material._kept:
        phase = material.phase
        material._kept[key] = (
            None
            if phase is None or material.view.source not in ANGLE_MARKS
            else long_lines(
                material.samples(channel),
                phase,
                material.rate_hz,
                material.frame.top_hz,
                material.frame.machine,
            )
        )
    return material._kept[key]  # type: ignore[return-value]
