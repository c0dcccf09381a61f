"""What of a machine depends on angles alone, looked up at half steps: teeth, surfaces, cages, known forces.

The elements tell their shapes (`gearsim_sim.model`); here they become tables of a turn, read by straight
lines between dense points.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from blind.compiled import compiled
from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.contributions import ERROR, STIFFNESS, MeshMod
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce
from gearsim_sim.model.spall import ON_RACE, Spall
from gearsim_sim.model.surface import table_lookup

Array = NDArray[np.float64]
# Points of a table of a turn: 200 and more on each period of the highest order that any series has (813).
_POINTS = 1 << 18
_ZONE_POINTS = 4096


@compiled
def add_periodic(turns: Array, factor: float, table: Array, out: Array) -> None:
    """out += factor * table at the fraction of `turns`."""
    size = table.size - 1
    for i in range(turns.size):
        place = (turns[i] - math.floor(turns[i])) * size
        at = min(int(place), size - 1)
        out[i] += factor * (table[at] + (place - at) * (table[at + 1] - table[at]))


@compiled
def add_zone(turns: Array, span: float, table: Array, out: Array) -> None:
    """The same of a table that covers `span` of a turn and is zero beyond."""
    size = table.size - 1
    for i in range(turns.size):
        place = (turns[i] - math.floor(turns[i])) / span
        if place < 1.0:
            place *= size
            at = min(int(place), size - 1)
            out[i] += table[at] + (place - at) * (table[at + 1] - table[at])


def series_tables(series: PeriodicSeries) -> tuple[Array, Array]:
    """Values of a series over a turn and its derivative, (points + 1,) each."""
    spectrum = np.zeros(_POINTS // 2 + 1, dtype=np.complex128)
    np.add.at(spectrum, series.orders, 0.5 * (series.cosine - 1j * series.sine))
    spectrum[0] = series.mean
    slope = spectrum * 2j * np.pi * np.arange(spectrum.size)
    value, rate = (np.fft.irfft(one, _POINTS) * _POINTS for one in (spectrum, slope))
    return np.append(value, value[0]), np.append(rate, rate[0])


@dataclass(frozen=True, eq=False)
class ToothFunction:
    """A periodic part of a mesh; `cycles` tooth phases or turns per turn of the track."""

    mesh: int
    what: int
    track: int
    cycles: float
    offset: float
    tables: tuple[Array, Array]


@dataclass(frozen=True, eq=False)
class Zone:
    """What a surface lacks under the balls of one bearing."""

    bearing: int
    balls: range
    track: int
    sense: float
    start_turns: float
    span_turns: float
    on_ball: bool
    table: Array


def tooth_functions(plant: Plant, added: tuple[Any, ...]) -> tuple[ToothFunction, ...]:
    """Stiffness and errors of all meshes, and what faults add to them."""
    found = []
    for index, mesh in enumerate(plant.meshes):
        if mesh.pulse[2]:
            raise NotImplementedError("rectangular mesh stiffness")
        own = series_tables(mesh.stiffness)
        found.append(ToothFunction(index, STIFFNESS, mesh.track, mesh.cycles, mesh.phase_offset, own))
        for one in mesh.errors:
            found.append(ToothFunction(index, ERROR, one.track, 1.0, 0.0, series_tables(one.series)))
    for one in added:
        if isinstance(one, MeshMod):
            found.append(ToothFunction(one.mesh, one.what, one.track, 1.0, 0.0, series_tables(one.series)))
    return tuple(found)


def zones(plant: Plant, added: tuple[Any, ...]) -> tuple[Zone, ...]:
    """Pits and profiles of all bearings."""
    found = []
    for one in added:
        if isinstance(one, Spall):
            law = plant.bearings[one.bearing].law
            half = one.half_width_rad
            table = np.array([one.drop(u) for u in np.linspace(-half, half, _ZONE_POINTS)])
            first = one.row * law.balls_per_row
            race = one.ball == ON_RACE
            balls = range(first, first + law.balls_per_row) if race else range(one.ball, one.ball + 1)
            sign = -1.0 if race else 1.0  # a race's pit begins half a width before its middle
            start = (one.position_rad + sign * half) / (2 * math.pi)
            zone = (one.ring.track, one.ring.sense, start, half / math.pi, not race, table)
            found.append(Zone(one.bearing, balls, *zone))
        elif isinstance(one, SurfaceProfile):
            balls = range(one.first_ball, one.first_ball + one.balls)
            table = np.asarray(table_lookup(one.values, np.linspace(0.0, 1.0, 4 * one.values.size)))
            zone = (one.ring.track, one.ring.sense, one.start_turns, one.span_turns, one.on_ball, table)
            found.append(Zone(one.bearing, balls, *zone))
    return tuple(found)


def mesh_functions(functions: tuple[ToothFunction, ...], meshes: int, phases: Array, hz: Array) -> Array:
    """(times, meshes, 3): stiffness, error, its rate; `phases` and `hz` are (tracks, times)."""
    rows = np.zeros((meshes, 3, phases.shape[1]))
    work = np.zeros(phases.shape[1])
    for one in functions:
        turns = one.cycles * phases[one.track] + one.offset
        value, slope = one.tables
        if one.what == STIFFNESS:
            add_periodic(turns, 1.0, value, rows[one.mesh, 0])
            continue
        add_periodic(turns, 1.0, value, rows[one.mesh, 1])
        work[:] = 0.0
        add_periodic(turns, one.cycles, slope, work)
        rows[one.mesh, 2] += work * hz[one.track]
    return np.ascontiguousarray(rows.transpose(2, 0, 1))


def missing(plant: Plant, found: tuple[Zone, ...], phases: Array, widened_m: Array) -> Array:
    """(times, bearings, balls): what surfaces lack, and what is added to clearances."""
    most = max((seat.law.ball_count for seat in plant.bearings), default=0)
    rows = np.zeros((len(plant.bearings), most, phases.shape[1]))
    rows += widened_m[:, None, None]
    for one in found:
        seat = plant.bearings[one.bearing]
        turned = one.start_turns + one.sense * phases[one.track]
        for ball in one.balls:
            azimuth = float(seat.law.azimuths_rad[ball]) / (2 * math.pi)
            place = turned if one.on_ball else phases[seat.cage] + azimuth - turned
            add_zone(np.ascontiguousarray(place), one.span_turns, one.table, rows[one.bearing, ball])
    return np.ascontiguousarray(rows.transpose(2, 0, 1))


def rotating_force(one: RotatingForce, seconds: Array, phases: Array, hz: Array) -> Array:
    """A known force over time [N]; changes of speed are slow, so its part with their rate is left out."""
    turns = seconds if one.track == TIME_TRACK else phases[one.track]
    angle = 2 * np.pi * one.order * turns
    wave = one.cosine * np.cos(angle) + one.sine * np.sin(angle)
    return np.asarray(wave * (one.constant + one.square * (2 * np.pi * hz[0]) ** 2))
