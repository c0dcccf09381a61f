"""Domain torsional: order spectra of encoders, of transmission errors, and how the speed wanders.

Kinds: line (in dB of rad^2, the mean square of the shaft's angle, or of the driving shaft's for a
transmission error), floor (per order), wander (variance of the speed over tenths of a second, in dB of
1 %^2). The channel is the encoder's shaft, "driving/driven" for a transmission error, and the reference shaft
for the speed.
Absent without encoders; `wander` needs an angle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.encoder import angular_deviation, encoder_phase, transmission_error
from gearsim_dsp.speed import Phase
from gearsim_io.nameplate import GearMesh
from gearsim_io.record import EdgeTrain
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.known_orders import known_orders
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.lines import DB, LEAST_STD_DB, line_levels, united_variance
from gearsim_twin.compare.material import Material
from gearsim_twin.compare.places import Place
from gearsim_twin.compare.windows import HANN_SUM, WindowSpectra

__all__ = ["measure", "places"]

_BUDGET, _MOST = 48, 20
_SAMPLES_PER_ORDER = 2.6
_LINES_PER_CYCLE = 2.6
_SMOOTH_TURNS = 4.0
_HALF_BINS = 2
_BIN_VARIANCE = 1.944
_LEAST_WANDER_PERCENT = 0.02
_COURSE_S = 0.1
# A course of the speed is seldom more than a few swings long.
_WANDER_STD_DB = 2.0


def places(frame: Frame, materials: Sequence[Material]) -> list[Place]:
    """Known lines of every shaft that has an encoder, and of every pair of gears between two of them."""
    if not frame.has_orders:
        return []
    found: list[Place] = []
    shafts = _shafts(frame, materials)
    channels = [*shafts, *(f"{m.driving_shaft}/{m.driven_shaft}" for m in _pairs(frame, shafts))]
    count = int(np.clip(_BUDGET // max(len(channels), 1), 6, _MOST))
    apart = 5 / frame.window_turns
    for channel in channels:
        top = min(_top(frame, m, channel) for m in materials)
        known = [k for k in known_orders(frame.machine, top, apart) if k.kind != "half" or k.order > apart]
        for line in sorted(known[:count], key=lambda entry: entry.order):
            found.append(Place("torsional", channel, "line", line.order, "order", apart, line.label))
        found.append(Place("torsional", channel, "floor", 0.5 * top, "order", top))
    if all(m.view.phase is not None for m in materials):
        reference = frame.machine.reference_shaft
        found.append(Place("torsional", reference, "wander", 0.0, "1", 1.0, "speed"))
    return found


def _shafts(frame: Frame, materials: Sequence[Material]) -> list[str]:
    """Shafts with an encoder in all records, one edge or more per turn."""
    listed = {shaft.name for shaft in frame.machine.shafts}
    shared = set.intersection(*(set(_encoders(m)) for m in materials)) if materials else set()
    return sorted(shared & listed)


def _encoders(material: Material) -> dict[str, EdgeTrain]:
    return {train.shaft: train for train in material.view.record.encoders if train.samples.size > 2}


def _pairs(frame: Frame, shafts: Sequence[str]) -> list[GearMesh]:
    meshes = frame.machine.gear_meshes
    return [m for m in meshes if m.driving_shaft in shafts and m.driven_shaft in shafts]


def _top(frame: Frame, material: Material, channel: str) -> float:
    """Highest order (of the reference shaft) that the lines of the encoders resolve."""
    encoders = _encoders(material)
    return min(
        encoders[name].lines_per_revolution / _LINES_PER_CYCLE * frame.machine.shaft(name).ratio
        for name in channel.split("/")
    )


def measure(material: Material, wanted: Sequence[Place]) -> Levels:
    """Levels of the lines, the floors between them, and the wandering of the speed."""
    level, std, height, clear = (np.full(len(wanted), np.nan) for _ in range(4))
    at, bandwidth = np.full(len(wanted), np.nan), np.full(len(wanted), np.nan)
    for channel in dict.fromkeys(place.channel for place in wanted):
        rows = [k for k, p in enumerate(wanted) if p.channel == channel and p.kind in ("line", "floor")]
        spectra = _spectra(material, wanted, channel) if rows else None
        for k in rows if spectra is not None else ():
            assert spectra is not None
            at[k] = wanted[k].at
            if wanted[k].kind == "floor":
                level[k], std[k], bandwidth[k] = *_floor(spectra), 1.0
                height[k], clear[k] = np.inf, 0.0
                continue
            line = line_levels(spectra, np.array([wanted[k].at]), _HALF_BINS)
            level[k], std[k] = line.level_db[0], line.std_db[0]
            height[k], clear[k] = line.height_db[0], line.clear_db[0]
            bandwidth[k] = (2 * _HALF_BINS + 1) * spectra.step
    for k, place in enumerate(wanted):
        if place.kind == "wander" and material.view.phase is not None:
            level[k], std[k], height[k], clear[k] = *_wander(material), np.inf, 0.0
    return Levels.of(level, std, height_db=height, clear_db=clear, frequency_hz=at, bandwidth_hz=bandwidth)


def _spectra(material: Material, wanted: Sequence[Place], channel: str) -> WindowSpectra | None:
    """Order spectra of an encoder or a pair of them; None where the record does not have them or they do
    not turn as they should.
    """
    machine = material.frame.machine
    names = channel.split("/")
    encoders = _encoders(material)
    if not all(name in encoders for name in names):
        return None
    ratio = machine.shaft(names[0]).ratio
    top = max(2 * p.at for p in wanted if p.channel == channel and p.kind == "floor")
    per_turn = int(sfft.next_fast_len(math.ceil(_SAMPLES_PER_ORDER * top / ratio), real=True))
    phases = [_phase(material, encoders[name]) for name in names]
    try:
        if len(names) == 1:
            signal = angular_deviation(phases[0], per_turn, smooth_turns=_SMOOTH_TURNS)
        else:
            mesh = next(
                m for m in machine.gear_meshes if (m.driving_shaft, m.driven_shaft) == (names[0], names[1])
            )
            teeth = (mesh.driving_teeth, mesh.driven_teeth)
            error = transmission_error(phases[0], phases[1], *teeth, samples_per_turn=per_turn)
            signal = error.signal
    except ValueError:  # too few turns, or shafts that do not turn as their teeth say
        return None
    windows = material.angle_spectra(signal.values, per_turn, ratio)
    return windows if windows.windows >= 2 else None


def _phase(material: Material, edges: EdgeTrain) -> Phase:
    key = ("encoder", edges.shaft)
    if key not in material._kept:
        material._kept[key] = encoder_phase(edges, material.view.record.sample_count)
    return material._kept[key]  # type: ignore[return-value]


def _floor(spectra: WindowSpectra) -> tuple[float, float]:
    """Density between the lines per order, and its standard deviation in dB."""
    between = spectra.mean < 4.0 * spectra.floor
    between[:5] = False
    each = spectra.power[:, between].mean(axis=1) / (HANN_SUM * spectra.step)
    value = max(float(each.mean()), 1e-300)
    theory = value**2 * _BIN_VARIANCE / max(int(np.count_nonzero(between)), 1) / spectra.averages
    variance = united_variance(theory, each, spectra.averages)
    return 10 * math.log10(value), max(DB * math.sqrt(variance) / value, LEAST_STD_DB)


def _wander(material: Material) -> tuple[float, float]:
    speed: NDArray[np.float64] = material.view.speed_course(_COURSE_S)[1]
    percent = 100 * (speed / speed.mean() - 1)
    value = float(np.mean(percent**2)) + _LEAST_WANDER_PERCENT**2
    share = 1 - _LEAST_WANDER_PERCENT**2 / value
    return 10 * math.log10(value), max(0.1, _WANDER_STD_DB * share)
