"""The compiled time loop of an ensemble: `loop` for LANES variants of one machine at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache
from typing import Any

from gearsim_sim.integrate.compiled import compiled_exactly, inlined
from gearsim_sim.integrate.lane_kernel import (
    LaneState,
    LaneSystem,
    accelerations,
    advance,
    guess_forces,
    know,
    motion,
    outputs,
)
from gearsim_sim.integrate.lane_pieces import cosines_sines, polynomials
from gearsim_sim.integrate.vectors import floor, fma, load, splat, store
from gearsim_sim.model.lane_data import Array, Indices, LaneDrive, LaneElements, LaneMemory, LaneWork
from gearsim_sim.model.lane_elements import (
    ill_bearing_forces,
    ill_mesh_forces,
    lane_bearing_forces,
    lane_mesh_forces,
    rest_lanes,
)

MOTION_ROWS = 2  # before the outputs of the state: turns since the anchor, speed
_SAMPLES = 16
_TURNS = 0.5 / math.pi  # per radian


@inlined
def reference_motions(step: Any, drive: LaneDrive, step_s: float) -> Any:
    """Turns of the reference shafts since their segments' starts, speeds [Hz], their changes [Hz/s]."""
    per_step = load(drive.clock, 1)
    turns, slope, curvature = polynomials((step - load(drive.clock, 0)) * per_step, drive.turns)
    per_second = per_step * splat(1.0 / step_s)
    return turns, slope * per_second, curvature * per_second * per_second


@inlined
def lane_inputs(step: Any, change: Any, elements: LaneElements, drive: LaneDrive, inputs: Array) -> None:
    """Torques of motor and load and the weight; the motor gives all inertia its acceleration."""
    u = (step - load(drive.clock, 0)) * load(drive.clock, 1)
    torque, _, _ = polynomials(u, drive.load)
    numbers = elements.drive_numbers
    accelerating = load(numbers, 0) * change * splat(2.0 * math.pi)
    store(inputs, 0, fma(-load(numbers, 2), torque, accelerating) * load(numbers, 1))
    store(inputs, 1, torque)
    store(inputs, 2, load(numbers, 3))


@inlined
def move_lane_phases(drive: LaneDrive, passed: Any, phases: Array) -> None:
    """Angles of all tracks in turns, within [0, 1)."""
    for j in range(phases.shape[0]):
        turns = fma(load(drive.rates, j), passed, load(drive.anchor_phases, j))
        store(phases, j, turns - floor(turns))


@inlined
def rotate_lane_sites(elements: LaneElements, phases: Array, accel: Array, width: int, column: int) -> None:
    """Turn pairs of sites (x, y) into the direction of sensors that rotate against the model's frame."""
    rotations = elements.rotations
    for j in range(rotations.shape[0]):
        place = int(rotations[j, 0]) * width + column
        turns = fma(splat(rotations[j, 2]), load(phases, int(rotations[j, 1])), splat(rotations[j, 3]))
        c, s = cosines_sines(turns)
        store(accel, place, fma(c, load(accel, place), s * load(accel, place + width)))


@cache
def make_lane_loop(balls: int) -> Callable[..., int]:
    """The compiled loop for bearings of (padded) numbers of balls.

    numba compiles it once for lanes with matrices of their own and once for lanes that share them.
    """

    def run(
        system: LaneSystem, state: LaneState, elements: LaneElements, drive: LaneDrive, memory: LaneMemory,
        work: LaneWork, first: int, count: int, accel: Array, width: int, column: int, out: Array,
    ) -> int:  # fmt: skip
        """Advance from step `first` by `count` steps; returns the number of output samples passed.

        accel ([site] width; LANES) gets `count` columns from `column` on. `out` ([sample] MOTION_ROWS +
        outputs; LANES) gets the motion at the output samples.
        """
        parts, interfaces = system.layout.shape[0], work.lane_forces.size
        sites = accel.shape[0] // width
        anchor, _, _ = reference_motions(load(drive.clock, 2), drive, elements.step_s)
        changing = first + 1 if drive.steady == 1 else first + count
        rest_lanes(drive, memory, work)
        row = 0
        for i in range(count):
            step = first + i + 1
            now = splat(float(step))
            turns, speed, change = reference_motions(now, drive, elements.step_s)
            passed = turns - anchor
            move_lane_phases(drive, passed, work.phases)
            guess_forces(state, interfaces)
            if step <= changing:
                lane_inputs(now, change, elements, drive, work.inputs)
                for p in range(parts):
                    know(system, state, p, work.inputs)
            for p in range(parts):
                motion(system, state, p)
            lane_bearing_forces(step, state.motion, elements, drive, work, state.forces)
            lane_mesh_forces(state.motion, speed, elements, drive, work, state.forces)
            store(work.speeds, 0, speed)
            ill_bearing_forces(step, state.motion, elements, drive, memory, work, state.forces, balls)
            ill_mesh_forces(step, state.motion, elements, drive, work, state.forces)
            for j in range(sites):
                store(accel, j * width + column + i, splat(0.0))
            for p in range(parts):
                accelerations(system, state, p, accel, width, column + i)
            rotate_lane_sites(elements, work.phases, accel, width, column + i)
            if step % elements.oversampling == 0:
                store(out, row, passed)
                store(out, row + 1, speed)
                row += MOTION_ROWS
                for p in range(parts):
                    row = outputs(system, state, p, out, row)
            for p in range(parts):
                advance(system, state, p)
        return row

    return compiled_exactly(run, allocates=False)


@compiled_exactly
def spread_motion(
    out: Array, phases: Array, rates: Array, anchors: Indices, rows: Indices, turns: Indices, values: Array,
    at: int,
) -> Any:  # fmt: skip
    """Angles and speeds of the shafts, and the other outputs, of each lane; returns the column behind.

    Parameters
    ----------
    out : ndarray, shape ([sample] MOTION_ROWS + outputs, LANES)
        From the loop.
    phases, rates : ndarray, shape (shafts, LANES)
        Rest of their angles at the anchor, and their turns per turn of the reference shaft.
    anchors : ndarray, shape (shafts, lanes)
        Whole turns at the anchor.
    rows : ndarray, shape (outputs,)
        Where in `out` twists of the encoders, their rates and the other outputs are.
    turns : ndarray, shape (lanes, shafts, n)
        Takes whole turns.
    values : ndarray, shape (lanes, 2 shafts + other outputs, n)
        Takes fractions of turns, speeds, other outputs.
    at : int
        First column that is written.
    """
    per_sample, shafts = MOTION_ROWS + rows.size, anchors.shape[0]
    count = out.shape[0] // per_sample
    for first in range(0, count, _SAMPLES):  # few enough to stay in the cache for all lanes
        for lane in range(turns.shape[0]):
            for i in range(first, min(first + _SAMPLES, count)):
                row = i * per_sample
                for j in range(shafts):
                    twist, twisting = out[row + rows[j], lane], out[row + rows[shafts + j], lane]
                    angle = phases[j, lane] + rates[j, lane] * out[row, lane] + twist * _TURNS
                    whole = math.floor(angle)
                    turns[lane, j, at + i] = anchors[j, lane] + int(whole)
                    values[lane, j, at + i] = angle - whole
                    values[lane, shafts + j, at + i] = rates[j, lane] * out[row + 1, lane] + twisting * _TURNS
                for j in range(2 * shafts, rows.size):
                    values[lane, j, at + i] = out[row + rows[j], lane]
    return at + count
