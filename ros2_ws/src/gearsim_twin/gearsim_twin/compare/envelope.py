"""Domain envelope: squared envelope spectra of carrier bands, at fault families, turns, and strange lines.

Kinds: line (a harmonic of a family), lines (its first three together, where there are many channels),
sideband (around the first two, where nothing else is near), shaft, tone (belongs to nothing), floor (between
the lines), ratio (the order at which a family is found, in per cent off the nameplate's). Levels are those of
the modulation's mean square, relative to the squared mean of the envelope: gain and colour do not matter.
Families are read where they are found on each side, so that a slip changes the ratio alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.planet_kinematics import planetary_orders
from gearsim_twin.compare.families import Found, find, places_of
from gearsim_twin.compare.frame import Family, Frame
from gearsim_twin.compare.known_orders import nearest_turn
from gearsim_twin.compare.levels import Levels, joined, nothing
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, comb_levels, united_variance
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.tones import peaks_of

__all__ = ["measure", "places"]

_BUDGET = 150
_HARMONICS = 3
_TONES = 3
_LEAST_RATIO = 4.0
_TURNS = 4
_BIN_VARIANCE = 1.944
_FEWEST_FLOOR_BINS = 8
_BETWEEN = 5.5  # bins from one multiple to the next: two and a half are a line's on either side
_FLOOR_SHARE = 0.9  # of a band's width, in which its envelope has a floor
_HALVINGS = 30


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Places of all channels and bands, in as much detail as their number allows."""
    if not frame.has_orders:
        return []
    each = _BUDGET // (len(frame.channels) * len(frame.bands_hz))
    turns = _turns(frame)[: max(1, min(_TURNS, each // 4))]
    left = each - len(turns) - 1
    fine = sum(_HARMONICS + bool(_sidebands(frame, f)) for f in frame.families) <= left
    found: list[Place] = []
    for channel in frame.channels:
        for band in frame.bands_hz:
            for family in frame.families:
                found += _of_family(frame, channel, band, family, fine)
            for order, label in turns:
                found.append(
                    Place("envelope", channel, "shaft", order, "order", _width(frame, order), label, band)
                )
            if _parts_turns(frame):
                top = frame.highest_envelope_order
                found.append(Place("envelope", channel, "floor", top / 2, "order", top, "", band))
        found += _tones(frame, channel, materials)
        for family in frame.families:
            expected = _expected(family, channel, materials)
            width = 100 * 2.0 / frame.window_turns / (2 * family.order)
            found.append(Place("envelope", channel, "ratio", expected, "order", width, family.label))
    return found


def _parts_turns(frame: Frame) -> bool:
    """Whether there is anything between the multiples of the slowest shaft but what leaks from them."""
    slowest = min((abs(shaft.ratio) for shaft in frame.machine.shafts), default=1.0)
    return slowest * frame.window_turns >= _BETWEEN


def _expected(family: Family, channel: str, materials: Sequence[Material]) -> float:
    """Where the measured records have the family, else where the nameplate has it."""
    orders = [find(m, channel, family).order for m in materials]
    known = [order for order in orders if math.isfinite(order)]
    return float(np.median(known)) if known else family.order


def _of_family(
    frame: Frame, channel: str, band: tuple[float, float], family: Family, fine: bool
) -> list[Place]:
    width = _width(frame, family.order)
    if not fine:
        return [Place("envelope", channel, "lines", family.order, "order", width, family.label, band)]
    found = []
    for k in range(1, _HARMONICS + 1):
        if k * family.order < frame.highest_envelope_order:
            label = _named(frame, k * family.order, f"{k} x {family.label}")
            found.append(Place("envelope", channel, "line", k * family.order, "order", width, label, band))
    if _sidebands(frame, family):
        name = f"sidebands of {family.label}"
        found.append(Place("envelope", channel, "sideband", family.order, "order", width, name, band))
    return found


def _named(frame: Frame, order: float, name: str) -> str:
    """What a bearing's line may be where windows are too short to tell it from multiples of a slow turn.

    Gears and planets have lines there in any machine, bearings where they are damaged: these come second.
    """
    if _parts_turns(frame):
        return name
    near = [
        (shaft.ratio, f"{round(order / shaft.ratio)} x {shaft.name}")
        for shaft in frame.machine.shafts
        if abs(order - round(order / shaft.ratio) * shaft.ratio) < 0.5 * _width(frame, order)
    ]
    # Of a multiple of several turns the fastest one tells most.
    return f"{max(near)[1]} or {name}" if near else name


def _width(frame: Frame, order: float) -> float:
    return (2 * frame.half_bins(order) + 1) / frame.window_turns


def _turns(frame: Frame) -> list[tuple[float, str]]:
    """Turns of shafts and planets that a bad tooth or a bent shaft would modulate with."""
    machine = frame.machine
    listed = [(shaft.ratio, f"1 x {shaft.name}") for shaft in machine.shafts]
    for stage in machine.planetary_stages:
        orders = planetary_orders(machine, stage)
        listed += [(orders.planet_pass, f"planet pass of {stage.name}")]
        listed += [(2 * orders.planet_spin, f"2 x planet spin of {stage.name}")]
    listed += [(2 * shaft.ratio, f"2 x {shaft.name}") for shaft in machine.shafts]
    kept: list[tuple[float, str]] = []
    for order, label in listed:
        if all(abs(order - other) > _width(frame, order) for other, _ in kept) and order > _width(
            frame, order
        ):
            kept.append((order, label))
    return kept


def _tones(frame: Frame, channel: str, materials: Sequence[Material]) -> list[Place]:
    """The clearest lines that belong to no family, no sideband of one, and no turn of a shaft."""
    seen: list[tuple[float, float, tuple[float, float]]] = []
    for band in frame.bands_hz:
        spectra = [material.envelope_spectra(channel, band) for material in materials]
        power = [float(material.envelope(channel, band).values.mean()) for material in materials]
        for own, mine in zip(spectra, power, strict=True):
            # What a quiet simulation modulates is diluted by the noise of the loudest record.
            share = mine / max(*power, 1e-300)
            bins, _ = peaks_of(own)
            for k in bins.tolist():
                order = k * own.step
                floor = max(float(s.floor[min(round(order / s.step), s.floor.size - 1)]) for s in spectra)
                ratio = share**2 * float(own.mean[k]) / max(floor, 1e-300)
                if ratio > _LEAST_RATIO and not _is_known(frame, order, 2.5 * own.step):
                    seen.append((ratio, order, band))
    kept: list[tuple[float, tuple[float, float]]] = []
    for _, order, band in sorted(seen, reverse=True):
        if all(abs(order - other) > _width(frame, order) for other, _ in kept):
            kept.append((order, band))
    return [
        Place("envelope", channel, "tone", order, "order", _width(frame, order), "modulation", band)
        for order, band in kept[:_TONES]
    ]


def _is_known(frame: Frame, order: float, near: float) -> bool:
    if nearest_turn(frame.machine, order) < near:
        return True
    for family in frame.families:
        shifts = {0.0, family.sideband_order, -family.sideband_order, 1.0, -1.0}
        for shift in shifts:
            k = max(1, round((order - shift) / family.order))
            if abs(order - shift - k * family.order) < near + k * family.order * family.tolerance:
                return True
    return False


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Levels of modulations, floors and found orders."""
    frame = material.frame
    parts: list[Levels] = []
    index: list[int] = []
    expected = {(p.channel, p.label): p.at for p in wanted if p.kind == "ratio"}
    groups: dict[tuple[str, tuple[float, float] | None], list[int]] = {}
    for k, place in enumerate(wanted):
        groups.setdefault((place.channel, place.band_hz), []).append(k)
    for (channel, band), rows in groups.items():
        chosen = [wanted[k] for k in rows]
        index += rows
        if band is None:
            parts.append(_ratios(material, channel, chosen))
        elif material.phase is None:
            parts.append(nothing(len(chosen)))
        else:
            parts.append(_in_band(material, chosen, band, expected))
    return _in_order(joined(parts), np.argsort(index)) if frame.has_orders else nothing(len(wanted))


def _in_order(levels: Levels, order: NDArray[np.intp]) -> Levels:
    return Levels(
        *(np.ascontiguousarray(getattr(levels, name)[order]) for name in Levels.__dataclass_fields__)
    )


def _in_band(
    material: Material,
    chosen: Sequence[Place],
    band: tuple[float, float],
    expected: dict[tuple[str, str], float],
) -> Levels:
    frame = material.frame
    spectra = material.envelope_spectra(chosen[0].channel, band)
    combs = [_comb(material, place, expected) for place in chosen]
    half = np.array(
        [frame.half_bins(place.at) if comb else 2 for place, comb in zip(chosen, combs, strict=True)]
    )
    lines = comb_levels(spectra, combs, half)
    level, std = lines.level_db.copy(), lines.std_db.copy()
    height, clear = lines.height_db.copy(), lines.clear_db.copy()
    width_hz = band[1] - band[0]
    step_hz = spectra.step * material.speed_hz
    bins = np.array([(2 * h + 1) * max(len(c), 1) for h, c in zip(half, combs, strict=True)])
    at_hz = np.array([place.at for place in chosen]) * material.speed_hz
    # Of Gaussian noise the squared envelope over its mean has the one-sided density 2 / B (1 - f / B).
    density = 2 / width_hz * np.clip(1 - at_hz / width_hz, 0.05, 1.0)
    gauss = 10 * np.log10(bins * step_hz * density)
    for k, place in enumerate(chosen):
        if place.kind == "floor":
            level[k], std[k], gauss[k] = _floor(material, place.channel, band)
            height[k], clear[k] = np.inf, 0.0
    return Levels.of(level, std, height_db=height, clear_db=clear, gauss_db=gauss)


def _comb(material: Material, place: Place, expected: dict[tuple[str, str], float]) -> tuple[float, ...]:
    """Orders of the lines of a place on this side; none for a floor."""
    if place.kind == "floor":
        return ()
    if place.kind in ("shaft", "tone"):
        return (place.at,)
    family = next(f for f in material.frame.families if place.label.endswith(f.label))
    order = places_of(material, place.channel, family, expected[place.channel, family.label])
    if place.kind == "line":
        return (order * round(place.at / family.order),)
    if place.kind == "lines":
        return tuple(order * k for k in range(1, _HARMONICS + 1))
    return tuple(order * k + side for k, side in _sidebands(material.frame, family))


def _sidebands(frame: Frame, family: Family) -> list[tuple[int, float]]:
    """(harmonic, offset) of sidebands that are next to no turn and to no harmonic of another family.

    Of many bearings 2 BSF - FTF is nearly BPFO.
    """
    others = [f for f in frame.families if f is not family]
    found = []
    for k, side in itertools.product((1, 2), (-family.sideband_order, family.sideband_order)):
        order = k * family.order + side
        clear = all(
            abs(order - n * f.order) > _width(frame, order) + n * f.order * f.tolerance
            for f in others
            for n in range(1, _HARMONICS + 2)
        )
        near = nearest_turn(frame.machine, order) < 0.6 * _width(frame, order)
        if family.sideband_order > 0 and clear and not near and order < frame.highest_envelope_order:
            found.append((k, side))
    return found


def _floor(material: Material, channel: str, band: tuple[float, float]) -> tuple[float, float, float]:
    """Mean level of bins between turns and families, its standard deviation, and that of Gaussian noise."""
    spectra = material.envelope_spectra(channel, band)
    # Two components of a band are apart by no more than its width.
    width = (band[1] - band[0]) / (spectra.step * material.speed_hz)
    bins = _between(material.frame, spectra.step, min(spectra.mean.size, int(_FLOOR_SHARE * width)))
    if bins.size < _FEWEST_FLOOR_BINS:
        return math.nan, math.inf, math.nan
    # Medians: strange lines and the skirts of lines that slip do not move them. Of noise (exponential) the
    # median is ln 2 of the mean, and that of n values has the relative variance 1 / (n ln^2 2).
    each = np.median(spectra.power[:, bins], axis=1) / math.log(2)
    value = max(float(each.mean()), 1e-300)
    theory = value**2 * _BIN_VARIANCE / (bins.size * math.log(2) ** 2) / spectra.averages
    variance = united_variance(theory, each, spectra.averages)
    gauss = 1.5 * 2 / width * _median_share(1 - bins / width) / math.log(2)
    return 10 * math.log10(value), max(DB * math.sqrt(variance) / value, LEAST_STD_DB), 10 * math.log10(gauss)


def _median_share(means: NDArray[np.float64]) -> float:
    """Median of exponential values with these means, by bisection."""
    low, high = 0.0, float(means.max())
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        below = float(np.mean(1 - np.exp(-middle / means))) < 0.5
        low, high = (middle, high) if below else (low, middle)
    return 0.5 * (low + high)


def _between(frame: Frame, step: float, lines: int) -> NDArray[np.intp]:
    """Bins of an envelope spectrum that are next to no turn of a shaft and to no low harmonic of a family."""
    order = np.arange(min(round(frame.highest_envelope_order / step), lines)) * step
    free = order > 4 * step
    for ratio in {shaft.ratio for shaft in frame.machine.shafts}:
        near = np.abs(order - np.round(order / ratio) * ratio)
        free &= near > min(2.5 * step, 0.3 * ratio)
    for family in frame.families:
        for k in range(1, _HARMONICS + 1):
            for shift in (0.0, family.sideband_order, -family.sideband_order):
                centre = k * family.order
                free &= np.abs(order - centre - shift) > 2.5 * step + family.tolerance * centre
    return np.flatnonzero(free)


def _ratios(material: Material, channel: str, chosen: Sequence[Place]) -> Levels:
    """Found over expected order of the nameplate, in per cent."""
    level, std, height = (np.full(len(chosen), value) for value in (np.nan, np.inf, np.nan))
    for k, place in enumerate(chosen):
        family = next(f for f in material.frame.families if f.label == place.label)
        found: Found = (
            find(material, channel, family) if material.phase is not None else Found(math.nan, 1, 0, 0)
        )
        if math.isfinite(found.order):
            level[k] = 100 * math.log(found.order / family.order)
            # What is not known of the speed is not known of the order: half an interval is 1.96 deviations.
            doubt = material.view.speed.relative_error / 1.96
            std[k] = 100 * math.hypot(found.std / found.order, doubt)
            height[k] = found.height_db
    return Levels.of(level, std, height_db=height)
