"""Forces of bearings and meshes of all lanes.

Balls of one row are alike and evenly spaced, so they may be numbered from the one that is nearest to the
load: then the balls without contact are the same ones in all lanes, and are passed over.
"""

from __future__ import annotations

from typing import Any

from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.lane_pieces import cosines_sines, table_values
from gearsim_sim.integrate.vectors import any_positive, floor, fma, load, maximum, splat, sqrt, store
from gearsim_sim.model.bearing_fault_loop import place_spalls, rest_terms
from gearsim_sim.model.bearing_loop import bearing_forces
from gearsim_sim.model.lane_data import Array, LaneDrive, LaneElements, LaneMemory, LaneRows, LaneWork
from gearsim_sim.model.loop_data import BearingMemory, Bearings, Meshes
from gearsim_sim.model.mesh_loop import look_up, mesh_forces


@inlined
def turn_frames(elements: LaneElements, work: LaneWork) -> None:
    """Cosine and sine of the azimuth of the ball nearest to the load, and its number in the cage."""
    bearings = elements.bearings
    for b in range(bearings.places.shape[0]):
        count = float(bearings.balls_per_row[b])
        cage = load(work.phases, bearings.places[b, 2])
        shift = floor(fma(load(elements.directions, b) - cage, splat(count), splat(0.5)))
        c, s = cosines_sines(fma(shift, splat(1.0 / count), cage))
        store(work.frames, 3 * b, c)
        store(work.frames, 3 * b + 1, s)
        store(work.frames, 3 * b + 2, shift)


@inlined
def rows_of(lane: int, drive: LaneDrive, work: LaneWork) -> Any:
    """The fault rows of a lane, with its angles in `work.lane_phases`."""
    for j in range(work.lane_phases.size):
        work.lane_phases[j] = work.phases[j, lane]
        work.lane_rates[j] = drive.rates[j, lane]
    return LaneRows(
        drive.spalls[lane],
        drive.profiles[lane],
        drive.bearing_terms[lane],
        drive.mesh_mods[lane],
        drive.mesh_pulses[lane],
        drive.mesh_terms[lane],
        drive.samples,
        work.lane_rates,
    )


@inlined
def place_lane_spalls(step: int, elements: LaneElements, drive: LaneDrive, work: LaneWork) -> int:
    """Enter what pits take away into `work.missing`; returns how many `work.marks` say where."""
    bearings = elements.bearings
    balls = elements.cosines.size // max(bearings.places.shape[0], 1)
    marks = 0
    for k in range(drive.pitted.size):
        lane = drive.pitted[k]
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
    """Forces of all bearings beyond their linear part, with pits but no other faults."""
    turn_frames(elements, work)
    marks = place_lane_spalls(step, elements, drive, work)
    index = elements.bearings.places
    balls = elements.cosines.size // max(index.shape[0], 1)
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
def lane_mesh_forces(
    motion: Array, speed: Any, elements: LaneElements, drive: LaneDrive, work: LaneWork, forces: Array
) -> None:
    """Forces of all meshes beyond their linear part, without faults and pulses."""
    index, errors = elements.meshes.places, elements.meshes.errors
    count, columns = index.shape[0], elements.meshes.numbers.shape[1]
    numbers, places = elements.mesh_numbers, elements.table_places
    for i in range(count):
        k = i * columns
        turns = fma(load(work.phases, index[i, 1]), load(numbers, k + 2), load(numbers, k + 3))
        stiffness, _ = table_values(turns, elements.tables, load(places, 2 * i), load(places, 2 * i + 1))
        error, rate = splat(0.0), splat(0.0)
        for j in range(index[i, 4], index[i, 5]):
            track, at = errors[j, 0], 2 * (count + j)
            phase = load(work.phases, track)
            value, slope = table_values(phase, elements.tables, load(places, at), load(places, at + 1))
            error, rate = error + value, fma(load(drive.rates, track), slope, rate)
        damper = load(numbers, k + 1) * (speed * rate)
        varied = (stiffness - load(numbers, k)) * load(motion, index[i, 0])
        store(forces, index[i, 0], -(varied + fma(stiffness, error, damper)))


@inlined
def rest_lanes(drive: LaneDrive, memory: LaneMemory, work: LaneWork) -> None:
    """What `rest_terms` does at the start of a run, for lanes whose bearings are ill."""
    for k in range(drive.ill_bearings.size):
        lane = drive.ill_bearings[k]
        rest_terms(memory_of(memory, lane), work.now[lane])


@inlined
def memory_of(memory: LaneMemory, lane: int) -> Any:
    """The bearings' memory of a lane."""
    return BearingMemory(
        memory.missing[lane],
        memory.play[lane],
        memory.cosines[lane],
        memory.sines[lane],
        memory.film[lane],
        memory.cage[lane],
    )


@inlined
def take_motion(lane: int, motion: Array, work: LaneWork) -> None:
    """Displacements of the interfaces of a lane, and their rates if there are any."""
    count = work.lane_motion.size
    for j in range(count):
        work.lane_motion[j] = motion[j, lane]
    for j in range(motion.shape[0] - count):
        work.lane_motion_rates[j] = motion[count + j, lane]


@inlined
def ill_bearing_forces(
    step: int, motion: Array, elements: LaneElements, drive: LaneDrive, memory: LaneMemory,
    work: LaneWork, forces: Array, balls: int,
) -> None:  # fmt: skip
    """The single loop's forces of bearings, for the lanes whose faults want them."""
    common = elements.bearings
    for k in range(drive.ill_bearings.size):
        lane = drive.ill_bearings[k]
        rows = rows_of(lane, drive, work)
        take_motion(lane, motion, work)
        bearings = Bearings(
            common.places, elements.lane_bearings[lane], common.cosines, common.sines, common.azimuths,
            common.row_offsets, common.balls_per_row, common.rollers, common.spins,
        )  # fmt: skip
        bearing_forces(
            step, work.lane_motion, work.lane_phases, work.speeds[0, lane], rows, bearings, elements.circle,
            memory_of(memory, lane), work.now[lane], work.jumps, work.lane_forces, elements.step_s, balls,
        )  # fmt: skip
        for b in range(common.places.shape[0]):
            for axis in range(2):
                forces[common.places[b, axis], lane] = work.lane_forces[common.places[b, axis]]


@inlined
def ill_mesh_forces(
    step: int, motion: Array, elements: LaneElements, drive: LaneDrive, work: LaneWork, forces: Array
) -> None:
    """The single loop's forces of meshes, for the lanes whose faults want them."""
    for k in range(drive.ill_meshes.size):
        lane = drive.ill_meshes[k]
        rows = rows_of(lane, drive, work)
        take_motion(lane, motion, work)
        meshes = Meshes(
            elements.lane_index[lane], elements.lane_numbers[lane], elements.lane_errors[lane],
            elements.tables, elements.step_s,
        )  # fmt: skip
        look_up(work.lane_phases, work.speeds[0, lane], rows, meshes, work.lane_meshes)
        mesh_forces(
            step, work.lane_motion, work.lane_motion_rates, work.lane_phases, work.speeds[0, lane], rows,
            meshes, work.lane_meshes, work.lane_forces,
        )  # fmt: skip
        for i in range(meshes.places.shape[0]):
            forces[meshes.places[i, 0], lane] = work.lane_forces[meshes.places[i, 0]]
