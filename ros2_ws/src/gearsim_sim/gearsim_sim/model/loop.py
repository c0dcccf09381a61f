"""The compiled time loop: any plant, one step after the other.

Angles are measured in turns since an anchor that the engine renews regularly, so that no digit is lost in
long runs; every quantity is a function of the integer step index, never of the split into calls.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

import numpy as np

from gearsim_sim.integrate.carrier_kernel import (
    Carrier,
    carrier_accelerations,
    carrier_advance,
    carrier_motion,
    carrier_state,
    carry_forces,
    damper_force,
    ring_motion,
)
from gearsim_sim.integrate.compiled import compiled, embedded
from gearsim_sim.integrate.kernel import (
    advance,
    correct,
    enter_known,
    interface_motion,
    predict,
    remember_forces,
    site_accelerations,
    state_row,
)
from gearsim_sim.integrate.pieces import cosine_sine
from gearsim_sim.model.bearing_fault_loop import JUMP_COLUMNS, NOW_COLUMNS, rest_terms
from gearsim_sim.model.bearing_loop import bearing_forces
from gearsim_sim.model.forcing_loop import apply_known, known_inputs, reference_motion
from gearsim_sim.model.joint_loop import carried_places, guess_forces, joint_forces, push_carried
from gearsim_sim.model.known_loop import ANGLE, SPEED, known_forces
from gearsim_sim.model.loop_data import Array, BearingMemory, Data, Drive, Part
from gearsim_sim.model.mesh_loop import WORK_ROWS, look_up, mesh_forces
from gearsim_sim.model.mesh_nodes import NODE_ROWS, between_nodes, next_node
from gearsim_sim.model.side_data import Side

# Columns of `motion` before the state rows of both parts: turns since the anchor, speed.
MOTION_COLUMNS = 2


class Work(NamedTuple):
    """Work space of the loop, which allocates nothing itself."""

    q: Array  # (interfaces,) displacements
    rates: Array
    forces: Array
    known0: Array  # (sites of the part,) accelerations by known inputs
    known1: Array
    inputs: Array  # (known inputs,)
    phases: Array  # (tracks,)
    now: Array  # (bearings, NOW_COLUMNS)
    jumps: Array  # (spalls, JUMP_COLUMNS)
    meshes: Array  # (WORK_ROWS, meshes)
    nodes: Array  # (NODE_ROWS, meshes)


def make_work(data: Data, drive: Drive, interfaces: int) -> Work:
    """Work space for these numbers of things, all zero."""
    return Work(
        q=np.zeros(interfaces),
        rates=np.zeros(interfaces),
        forces=np.zeros(interfaces),
        known0=np.zeros(data.first.site_index.size),
        known1=np.zeros(data.second.site_index.size),
        inputs=np.zeros(data.first.left_known.shape[0]),
        phases=np.zeros(drive.rates.size),
        now=np.zeros((data.bearings.places.shape[0], NOW_COLUMNS)),
        jumps=np.zeros((drive.spalls.shape[0], JUMP_COLUMNS)),
        meshes=np.zeros((WORK_ROWS, data.meshes.places.shape[0])),
        nodes=np.zeros((NODE_ROWS, data.meshes.places.shape[0])),
    )


@embedded
def move_phases(drive: Drive, passed: float, phases: Array) -> None:
    """Angles of all tracks in turns, within [0, 1)."""
    for j in range(phases.size & 0xFFFF):
        turns = drive.anchor_phases[j] + drive.rates[j] * passed
        phases[j] = turns - np.floor(turns)  # math.floor makes an integer, which fills no vector registers


@embedded
def put_states(s: Array, part: Part, row: Array, at: int) -> int:
    """State rows of a part into an output row; returns the place behind them."""
    for j in range(part.state_rows.shape[0]):
        row[at + j] = state_row(s, part.state_rows[j], part.length)
    behind: int = at + part.state_rows.shape[0]
    return behind


@embedded
def put_carrier_states(s: Array, carrier: Carrier, row: Array, at: int, nc: int, ni: int) -> int:
    """State rows of the carrying structure into an output row; returns the place behind them."""
    for j in range(carrier.state_rows.shape[0]):
        row[at + j] = carrier_state(s, carrier, j, nc, ni)
    behind: int = at + carrier.state_rows.shape[0]
    return behind


@embedded
def put_carrier_motion(
    s: Array, carrier: Carrier, row: Array, at: int, interfaces: int, nc: int, ni: int
) -> None:
    """The structure's motion behind the `interfaces` forces of an output row, which lose their dampers."""
    for j in range(ni):
        row[at + carrier.places[j]] -= damper_force(s, j, nc, ni)
        row[at + interfaces + j] = ring_motion(s, j, nc, ni)


@embedded
def rotate_sites(phases: Array, data: Data, accel: Array, column: int) -> None:
    """Turn pairs of rows (x, y) into the direction of sensors that rotate against the model's frame."""
    for j in range(data.rotations.shape[0]):
        row = int(data.rotations[j, 0])
        turns = data.rotations[j, 2] * phases[int(data.rotations[j, 1])] + data.rotations[j, 3]
        c, s = cosine_sine(turns, data.circle)
        accel[row, column] = c * accel[row, column] + s * accel[row + 1, column]


@cache
def make_loop(
    first_modes: int,
    first_interfaces: int,
    second_modes: int,
    second_interfaces: int,
    balls: int,
    with_rates: bool,
    with_side: bool = False,
    carrier_modes: int = 0,
    carrier_interfaces: int = 0,
) -> Callable[..., int]:
    """The compiled loop for parts of these (padded) numbers of modes and interfaces, and of balls.

    The numbers of the second part may be 0. Rates of the interfaces cost time and are zero unless asked for;
    forces beside the machine's own elements (`Side`) are not looked at unless asked for. The last two are
    those of a structure that carries the bearings, which stand on the ground without.
    """
    n0, n1 = first_modes, second_modes
    i0, i1 = first_interfaces, second_interfaces
    rated = 1 if with_rates else 0
    sided = with_side  # branches on constants are dropped before anything in them is compiled
    nc, ic = carrier_modes, carrier_interfaces
    carried = nc > 0
    q0_count, q1_count = (1 + rated) * i0, (1 + rated) * i1

    def run(
        s0: Array, s1: Array, sc: Array, data: Data, drive: Drive, side: Side, memory: BearingMemory,
        work: Work, first: int, count: int, stride: int, accel: Array, column: int, motion: Array,
    ) -> int:  # fmt: skip
        """Advance from step `first` by `count` steps; returns the number of output samples passed.

        Mesh functions are looked up every `stride` steps, see `mesh_nodes`; at every step where forces beside
        the machine's own elements turn its shafts.

        accel (site rows, columns) gets `count` columns from `column` on. `motion` (samples,
        MOTION_COLUMNS + state rows of both parts and of the structure + interfaces + motion of the structure)
        gets a row at each output sample.
        """
        q, rates, forces, phases = work.q, work.rates, work.forces, work.phases
        known0, known1, inputs = work.known0, work.known1, work.inputs
        now, jumps, meshes, nodes = work.now, work.jumps, work.meshes, work.nodes
        sites0, sites1 = known0.size, known1.size
        swings = side.swings if sided else 0
        rest_terms(memory, now)
        per_step = 1.0 / drive.length_steps
        per_second = per_step / data.step_s
        anchor, _, _ = reference_motion(drive.anchor_step, drive, per_step, per_second)
        # The known inputs are worked out at each step, or at the first one only if they stay as they are.
        changing = first + 1 if drive.steady == 1 else first + count
        samples = 0
        before = first // stride * stride - stride
        while before < first + count:
            behind = before + stride
            for _ in range(1 - swings):
                turns, speed, _ = reference_motion(behind, drive, per_step, per_second)
                move_phases(drive, turns - anchor, phases)
                next_node(phases, speed * data.step_s, drive, data.meshes, nodes)
            for step in range(max(first, before) + 1, min(first + count, behind) + 1):
                i = step - first - 1
                turns, speed, change = reference_motion(step, drive, per_step, per_second)
                passed = turns - anchor
                if sided:
                    passed += side.drift[ANGLE]
                    speed += side.drift[SPEED]
                move_phases(drive, passed, phases)
                fresh = step <= changing
                if fresh:
                    known_inputs(step, change, drive, data, inputs)
                    apply_known(inputs, data.first, s0, known0, n0)
                    apply_known(inputs, data.second, s1, known1, n1)
                if sided:
                    known_forces(
                        step, fresh, speed, change, phases, drive, data, side, s0, s1, 2 * n0, 2 * n1
                    )
                    fresh = True
                if fresh:
                    enter_known(s0, data.first.k, data.first.length, sites0, n0, i0, q0_count)
                    enter_known(s1, data.second.k, data.second.length, sites1, n1, i1, q1_count)
                q0 = interface_motion(s0, data.first.k, data.first.length, n0, i0, q0_count)
                q1 = interface_motion(s1, data.second.k, data.second.length, n1, i1, q1_count)
                for j in range(i0):
                    q[j] = s0[q0 + j]
                for j in range(i1):
                    q[i0 + j] = s1[q1 + j]
                for j in range(rated * i0):
                    rates[j] = s0[q0 + i0 + j]
                for j in range(rated * i1):
                    rates[i0 + j] = s1[q1 + i1 + j]
                if sided:
                    guess_forces(side, q, rates, sc, nc, ic)
                if carried:
                    carrier_motion(sc, data.carrier, q, forces, phases, data.circle, nc, ic)
                bearing_forces(
                    step, q, phases, speed, drive, data.bearings, data.circle, memory, now, jumps, forces,
                    data.step_s, balls,
                )  # fmt: skip
                for _ in range(swings):
                    look_up(phases, speed, drive, data.meshes, meshes)
                for _ in range(1 - swings):
                    between_nodes(step - before, stride, data.step_s, nodes, meshes)
                mesh_forces(step, q, rates, phases, speed, drive, data.meshes, meshes, forces)
                if carried:
                    carry_forces(sc, data.carrier, q, forces, phases, data.circle, nc, ic)
                remember_forces(s0, forces, 0, n0, i0)
                remember_forces(s1, forces, i0, n1, i1)
                for j in range(accel.shape[0]):
                    accel[j, column + i] = 0.0
                site_accelerations(
                    s0, data.first.k, data.first.length, known0, data.first.site_index, accel, column + i,
                    n0, i0,
                )  # fmt: skip
                site_accelerations(
                    s1, data.second.k, data.second.length, known1, data.second.site_index, accel, column + i,
                    n1, i1,
                )  # fmt: skip
                if carried:
                    carrier_accelerations(sc, data.carrier, accel, column + i, nc, ic)
                if not sided:
                    advance(s0, data.first.k, forces, 0, n0, i0)
                    advance(s1, data.second.k, forces, i0, n1, i1)
                if sided:
                    correct(s0, data.first.k, forces, 0, n0, i0)
                    correct(s1, data.second.k, forces, i0, n1, i1)
                    if carried:
                        carried_places(side, sc, data.carrier, nc, ic)
                    joint_forces(step, side, forces, s0, s1, 2 * n0, 2 * n1, accel, column + i)
                    if carried:
                        push_carried(side, sc, data.carrier, nc)
                    predict(s0, data.first.k, n0)
                    predict(s1, data.second.k, n1)
                rotate_sites(phases, data, accel, column + i)
                if step % data.oversampling == 0:
                    row = motion[samples]
                    row[0] = passed
                    row[1] = speed
                    at = put_states(s0, data.first, row, MOTION_COLUMNS)
                    at = put_states(s1, data.second, row, at)
                    if carried:
                        at = put_carrier_states(sc, data.carrier, row, at, nc, ic)
                    for j in range(i0 + i1):
                        row[at + j] = forces[j]
                    if carried:
                        put_carrier_motion(sc, data.carrier, row, at, i0 + i1, nc, ic)
                    samples += 1
                if carried:
                    carrier_advance(sc, data.carrier, data.carrier.poles.size // 2, nc, ic)
            before = behind
        return samples

    return compiled(run, allocates=False)
