"""Forces of bearings and meshes of all lanes; what faults add comes from the functions of the single loop.

Balls of one row are alike and evenly spaced, so they may be numbered from the one that is nearest to the
load: then the balls without contact are the same ones in all lanes, and are passed over.
"""

from __future__ import annotations

from typing import Any

from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.lane_pieces import cosines_sines, table_values
from gearsim_sim.integrate.vectors import (
    LANES,
    any_positive,
    floor,
    fma,
    load,
    maximum,
    splat,
    sqrt,
    store,
)
from gearsim_sim.model.bearing_loop import place_spalls
from gearsim_sim.model.lane_data import Array, Indices, LaneDrive, LaneElements, LaneRows, LaneWork
from gearsim_sim.model.mesh_loop import add_mods


@inlined
def turn_frames(elements: LaneElements, work: LaneWork) -> None:
    """Cosine and sine of the azimuth of the ball nearest to the load, and its number in the cage."""
    bearings = elements.bearings
    for b in range(bearings.index.shape[0]):
        count = float(bearings.balls_per_row[b])
        cage = load(work.phases, bearings.index[b, 2])
        shift = floor(fma(load(elements.directions, b) - cage, splat(count), splat(0.5)))
        c, s = cosines_sines(fma(shift, splat(1.0 / count), cage))
        store(work.frames, 3 * b, c)
        store(work.frames, 3 * b + 1, s)
        store(work.frames, 3 * b + 2, shift)


@inlined
def rows_of(lane: int, drive: LaneDrive, work: LaneWork) -> Any:
    """The fault rows of a lane under the names of `Drive`, with its angles in `work.lane_phases`."""
    for j in range(work.lane_phases.size):
        work.lane_phases[j] = work.phases[j, lane]
    spalls = drive.spalls[lane, : drive.spall_counts[lane]]
    mods = drive.mesh_mods[lane, : drive.mod_counts[lane]]
    return LaneRows(spalls, mods, drive.samples, work.lane_rates)


@inlined
def place_lane_spalls(step: int, elements: LaneElements, drive: LaneDrive, work: LaneWork) -> int:
    """Enter what spalls take away into `work.missing`; returns how many `work.marks` say where."""
    bearings = elements.bearings
    balls = elements.cosines.size // bearings.index.shape[0]
    marks = 0
    for lane in range(LANES):
        if drive.spall_counts[lane] == 0:
            continue
        rows = rows_of(lane, drive, work)
        place_spalls(step, work.lane_phases, rows, bearings, work.lane_missing, work.touched)
        for j in range(rows.spalls.shape[0]):
            bearing, ball = work.touched[j, 0], work.touched[j, 1]
            depth = work.lane_missing[bearing, ball]
            if depth != 0.0:
                work.lane_missing[bearing, ball] = 0.0
                count = bearings.balls_per_row[bearing]
                first = ball // count * count
                shift = int(work.frames[3 * bearing + 2, lane])
                place = bearing * balls + first + (ball - first - shift) % count
                work.missing[place, lane] = depth
                work.marks[marks, 0] = place
                work.marks[marks, 1] = lane
                marks += 1
    return marks


@inlined
def lane_bearing_forces(
    step: int, motion: Array, elements: LaneElements, drive: LaneDrive, work: LaneWork, forces: Array
) -> None:
    """Forces of all bearings beyond their linear part."""
    turn_frames(elements, work)
    marks = place_lane_spalls(step, elements, drive, work) if work.marks.size > 0 else 0
    index: Indices = elements.bearings.index
    balls = elements.cosines.size // index.shape[0]
    for b in range(index.shape[0]):
        c, s = load(work.frames, 3 * b), load(work.frames, 3 * b + 1)
        x, y = load(motion, index[b, 0]), load(motion, index[b, 1])
        along, across = fma(x, c, y * s), fma(y, c, -(x * s))
        clearance = load(elements.bearing_numbers, 3 * b + 1)
        fx, fy = splat(0.0), splat(0.0)
        for j in range(b * balls, (b + 1) * balls):
            cj, sj = load(elements.cosines, j), load(elements.sines, j)
            gap = fma(along, cj, fma(across, sj, -clearance)) - load(work.missing, j)
            if any_positive(gap):
                gap = maximum(gap, splat(0.0))
                force = gap * sqrt(gap)
                fx, fy = fma(force, cj, fx), fma(force, sj, fy)
        factor, nominal = load(elements.bearing_numbers, 3 * b), load(elements.bearing_numbers, 3 * b + 2)
        store(forces, index[b, 0], fma(nominal, x, -(factor * fma(fx, c, -(fy * s)))))
        store(forces, index[b, 1], fma(nominal, y, -(factor * fma(fx, s, fy * c))))
    for j in range(marks):
        work.missing[work.marks[j, 0], work.marks[j, 1]] = 0.0


@inlined
def add_lane_mods(step: int, drive: LaneDrive, work: LaneWork) -> None:
    """What faults change of stiffness and transmission error."""
    for lane in range(LANES):
        if drive.mod_counts[lane] == 0:
            continue
        rows = rows_of(lane, drive, work)
        for j in range(work.lane_rates.size):
            work.lane_rates[j] = drive.rates[j, lane]
        for i in range(work.lane_meshes.size):
            work.lane_meshes[i // 3, i % 3] = work.meshes[i, lane]
        add_mods(step, work.lane_phases, rows, work.lane_meshes)
        for i in range(work.lane_meshes.size):
            work.meshes[i, lane] = work.lane_meshes[i // 3, i % 3]


@inlined
def lane_mesh_forces(
    step: int,
    motion: Array,
    speed: Any,
    elements: LaneElements,
    drive: LaneDrive,
    work: LaneWork,
    forces: Array,
) -> None:
    """Forces of all meshes beyond their linear part."""
    index, errors = elements.meshes.index, elements.meshes.errors
    count = index.shape[0]
    numbers, places = elements.mesh_numbers, elements.table_places
    for i in range(count):
        turns = fma(load(work.phases, index[i, 1]), load(numbers, 4 * i + 2), load(numbers, 4 * i + 3))
        stiffness, _ = table_values(turns, elements.tables, load(places, 2 * i), load(places, 2 * i + 1))
        error, rate = splat(0.0), splat(0.0)
        for j in range(index[i, 4], index[i, 5]):
            track, k = errors[j, 0], 2 * (count + j)
            phase = load(work.phases, track)
            value, slope = table_values(phase, elements.tables, load(places, k), load(places, k + 1))
            error, rate = error + value, fma(load(drive.rates, track), slope, rate)
        store(work.meshes, 3 * i, stiffness)
        store(work.meshes, 3 * i + 1, error)
        store(work.meshes, 3 * i + 2, rate)
    if drive.mod_counts[LANES] > 0:
        add_lane_mods(step, drive, work)
    for i in range(count):
        stiffness, error = load(work.meshes, 3 * i), load(work.meshes, 3 * i + 1)
        damper = load(numbers, 4 * i + 1) * (speed * load(work.meshes, 3 * i + 2))
        varied = (stiffness - load(numbers, 4 * i)) * load(motion, index[i, 0])
        store(forces, index[i, 0], -(varied + fma(stiffness, error, damper)))
