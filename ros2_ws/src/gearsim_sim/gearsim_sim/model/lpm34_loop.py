"""The compiled time loop of the 34-DOF model: the same forces as in `lpm34`, fast.

The model falls into two parts that only the bearings join: all motion in x, and all motion in y with the
rotations. Each has its own modes. `Data` holds everything constant, `Drive` the present ramps and
phases. Angles are measured in turns since an anchor that the engine renews regularly, so that no digit
is lost in long runs; every quantity is a function of the integer step index, never of the split into
calls.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import compiled, inlined
from gearsim_sim.integrate.kernel import correct, interface_motion, predict, site_accelerations, state_row
from gearsim_sim.integrate.pieces import cosine_sine, fading_slope, ramp, table_value

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
BEARINGS = 4
X_INTERFACES = 4  # b1_x .. b4_x
Y_INTERFACES = 5  # b1_y .. b4_y, mesh
INTERFACES = X_INTERFACES + Y_INTERFACES
# Columns of a spall in `Drive.spalls`; inner_sense: 0 on the outer race, else the shaft's sense of turning.
SPALL_COLUMNS = (
    "bearing", "row", "inner_sense", "position_turns", "half_width_rad", "depth_m", "race_radius_m",
    "ball_radius_m", "severity_from", "severity_to", "start_step", "ramp_steps",
)  # fmt: skip


class Part(NamedTuple):
    """Constants of one of the two parts."""

    k: Array  # `kernel.pack_constants`
    length: int  # 2 nm, see `kernel.times_state`
    left_known: Array  # (3, 2 nm) modal force per known input
    site_known: Array  # (sites, 3) acceleration per known input
    site_index: NDArray[np.int64]  # (sites,) output row that each site adds to
    state_rows: Array  # (rows, 2 nm) outputs of the state at the output samples


class Data(NamedTuple):
    """Constants of the loop."""

    x: Part
    y: Part
    circle: Array  # cosine_sine's table
    stiffness: Array  # mesh stiffness table over the tooth phase
    pinion_error: Array  # tables over a turn
    gear_error: Array
    mesh: Array  # mean stiffness, damping, teeth of the pinion
    bearings: Array  # (4, 2): load factor, clearance
    cosines: Array  # (4, balls) of the azimuths in the cage's frame, 0 where there is no ball
    sines: Array
    row_offsets: Array  # (4, 2) azimuth of the first ball of each row in turns
    balls_per_row: NDArray[np.int64]  # (4,)
    nominal_stiffness: float
    inertia: float  # of the rigid rotation, at the input [kg m^2]
    speed_ratio: float
    gravity: float
    step_s: float
    oversampling: int


class Drive(NamedTuple):
    """What changes at events: ramps of speed and load, anchored phases, spalls."""

    speed: Array  # from, to [Hz], slope at the start [Hz per step]
    load: Array  # from, to [N m]
    start_step: int
    ramp_steps: float
    anchor_step: int
    anchor_phases: Array  # (2 + 4) input shaft, output shaft, four cages: turns in [0, 1) at the anchor
    rates: Array  # (2 + 4) turns per turn of the input shaft; cages with their sense
    spalls: Array  # (count, len(SPALL_COLUMNS))


@inlined
def turns_since_start(step: int, drive: Drive, h: float) -> float:
    """Turns of the input shaft since `drive.start_step`."""
    since = float(step - drive.start_step)
    _, _, integral = ramp(since, drive.ramp_steps)
    _, _, fading = fading_slope(since, drive.ramp_steps)
    rise = (drive.speed[1] - drive.speed[0]) * integral + drive.speed[2] * fading
    turns: float = h * (drive.speed[0] * since + rise)
    return turns


@inlined
def speed_now(step: int, drive: Drive) -> tuple[float, float]:
    """Speed of the input shaft [Hz] and its change per step."""
    since = float(step - drive.start_step)
    value, slope, _ = ramp(since, drive.ramp_steps)
    fading, fading_rate, _ = fading_slope(since, drive.ramp_steps)
    change = drive.speed[1] - drive.speed[0]
    speed = drive.speed[0] + change * value + drive.speed[2] * fading
    return speed, change * slope + drive.speed[2] * fading_rate


@inlined
def known_inputs(step: int, drive: Drive, data: Data) -> tuple[float, float]:
    """Torque of the motor and of the load."""
    rise, _, _ = ramp(float(step - drive.start_step), drive.ramp_steps)
    _, speed_change = speed_now(step, drive)
    load = drive.load[0] + (drive.load[1] - drive.load[0]) * rise
    motor = load * data.speed_ratio + data.inertia * 2.0 * math.pi * speed_change / data.step_s
    return motor, load


@inlined
def apply_known(
    motor: float, load: float, gravity: float, part: Part, s: Array, sites: Array, nm: int
) -> None:
    """Known inputs as modal forces of a part (in `s`) and as accelerations of its sites."""
    for m in range(2 * nm):
        known = part.left_known[0, m] * motor + part.left_known[1, m] * load
        s[4 * nm + m] = known + part.left_known[2, m] * gravity
    for i in range(sites.size):
        known = part.site_known[i, 0] * motor + part.site_known[i, 1] * load
        sites[i] = known + part.site_known[i, 2] * gravity


@inlined
def spall_ball(row: Array, step: int, cage_turns: float, shaft_turns: float, data: Data) -> tuple[int, float]:
    """The ball nearest to a spall, and how much the race is away under it."""
    bearing = int(row[0])
    rise, _, _ = ramp(float(step) - row[10], row[11])
    severity = row[8] + (row[9] - row[8]) * rise
    count = data.balls_per_row[bearing]
    middle = row[3] + row[2] * shaft_turns
    place = (middle - cage_turns - data.row_offsets[bearing, int(row[1])]) * count
    nearest = math.floor(place + 0.5)
    beta = row[4] - abs(place - nearest) * (2.0 * math.pi / count)
    ball = int(row[1]) * count + int(nearest) % count
    if beta <= 0.0 or severity == 0.0:
        return ball, 0.0
    radius = row[7]
    chord = row[6] * math.sin(beta)
    half = math.sin(0.5 * beta)
    sagitta = 2.0 * row[6] * half * half
    own = radius - math.sqrt(radius * radius - chord * chord)
    drop = own + sagitta if row[2] != 0.0 else own - sagitta
    return ball, severity * min(row[5], drop)


@inlined
def contact_force(
    x: float, y: float, c: float, s: float, bearing: int, data: Data, missing: Array, balls: int
) -> tuple[float, float]:
    """Force of the inner ring on the outer ring; c and s turn into the frame of the cage.

    `missing` is (4, balls).
    """
    along, across = x * c + y * s, y * c - x * s
    clearance = data.bearings[bearing, 1]
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = data.cosines[bearing, j], data.sines[bearing, j]
        gap = along * cj + across * sj - clearance - missing[bearing, j]
        gap = gap if gap > 0.0 else 0.0
        force = gap * math.sqrt(gap)
        fx += force * cj
        fy += force * sj
    factor = data.bearings[bearing, 0]
    return factor * (fx * c - fy * s), factor * (fx * s + fy * c)


@inlined
def mesh_deviation(q: float, pinion_turns: float, gear_turns: float, speed_hz: float, data: Data) -> float:
    """Force of the mesh beyond its linear part: variation of stiffness, and transmission error."""
    e1, slope1 = table_value(pinion_turns, data.pinion_error)
    e2, slope2 = table_value(gear_turns, data.gear_error)
    stiffness, _ = table_value(pinion_turns * data.mesh[2], data.stiffness)
    rate = speed_hz * (slope1 + data.speed_ratio * slope2)
    force: float = (stiffness - data.mesh[0]) * q + stiffness * (e1 + e2) + data.mesh[1] * rate
    return force


@inlined
def place_spalls(
    step: int, phases: Array, drive: Drive, data: Data, missing: Array, touched: Indices
) -> None:
    """Enter what spalls take away under their nearest balls into `missing`; `touched` says where."""
    for j in range(drive.spalls.shape[0]):
        bearing = int(drive.spalls[j, 0])
        shaft = phases[0] if bearing < 2 else phases[1]
        ball, depth = spall_ball(drive.spalls[j], step, phases[2 + bearing], shaft, data)
        touched[j, 0] = bearing
        touched[j, 1] = ball
        missing[bearing, ball] += depth


@inlined
def bearing_forces(
    sx: Array,
    qx: int,
    sy: Array,
    qy: int,
    phases: Array,
    data: Data,
    missing: Array,
    forces: Array,
    balls: int,
) -> None:
    """Forces of the four bearings beyond their linear part: first all in x, then all in y."""
    cage, c, s = -1.0, 1.0, 0.0
    for b in range(BEARINGS):
        if phases[2 + b] != cage:  # bearings of one kind on one shaft share their cage's angle
            cage = phases[2 + b]
            c, s = cosine_sine(cage, data.circle)
        x, y = sx[qx + b], sy[qy + b]
        fx, fy = contact_force(x, y, c, s, b, data, missing, balls)
        forces[b] = data.nominal_stiffness * x - fx
        forces[X_INTERFACES + b] = data.nominal_stiffness * y - fy


@inlined
def put_motion(sx: Array, sy: Array, data: Data, forces: Array, row: Array) -> None:
    """State rows of both parts and the interface forces, behind the first two entries of a row."""
    at = 2
    for j in range(data.x.state_rows.shape[0]):
        row[at + j] = state_row(sx, data.x.state_rows[j], data.x.length)
    at += data.x.state_rows.shape[0]
    for j in range(data.y.state_rows.shape[0]):
        row[at + j] = state_row(sy, data.y.state_rows[j], data.y.length)
    at += data.y.state_rows.shape[0]
    for j in range(INTERFACES):
        row[at + j] = forces[j]


def make_loop(x_modes: int, y_modes: int, balls: int) -> Callable[..., int]:
    """The compiled loop for these numbers of modes of the parts and of balls (padded)."""
    nx, ny = X_INTERFACES, Y_INTERFACES

    def run(
        sx: Array, sy: Array, data: Data, drive: Drive, missing: Array, first: int, count: int,
        accel: Array, column: int, motion: Array,
    ) -> int:  # fmt: skip
        """Advance from step `first` by `count` steps; returns the number of output samples passed.

        accel (sites, columns) gets `count` columns from `column` on. motion (samples, 2 + rows +
        INTERFACES) gets turns since the anchor, speed, state rows of both parts and interface forces,
        at the output samples.
        """
        forces = np.zeros(INTERFACES)
        x_known = np.zeros(data.x.site_index.size)
        y_known = np.zeros(data.y.site_index.size)
        phases = np.zeros(2 + BEARINGS)
        touched = np.zeros((drive.spalls.shape[0], 2), dtype=np.int64)
        motor, load = known_inputs(first, drive, data)
        apply_known(motor, load, data.gravity, data.x, sx, x_known, x_modes)
        apply_known(motor, load, data.gravity, data.y, sy, y_known, y_modes)
        anchor = turns_since_start(drive.anchor_step, drive, data.step_s)
        drive_end = drive.start_step + drive.ramp_steps
        samples = 0
        for i in range(count):
            step = first + i + 1
            if step <= drive_end + 1:
                motor, load = known_inputs(step, drive, data)
                apply_known(motor, load, data.gravity, data.x, sx, x_known, x_modes)
                apply_known(motor, load, data.gravity, data.y, sy, y_known, y_modes)
            speed, _ = speed_now(step, drive)
            passed = turns_since_start(step, drive, data.step_s) - anchor
            for j in range(2 + BEARINGS):
                turns = drive.anchor_phases[j] + drive.rates[j] * passed
                phases[j] = turns - math.floor(turns)
            predict(sx, data.x.k, x_modes)
            predict(sy, data.y.k, y_modes)
            qx = interface_motion(sx, data.x.k, data.x.length, x_modes, nx, nx)
            qy = interface_motion(sy, data.y.k, data.y.length, y_modes, ny, ny)
            place_spalls(step, phases, drive, data, missing, touched)
            bearing_forces(sx, qx, sy, qy, phases, data, missing, forces, balls)
            for j in range(touched.shape[0]):
                missing[touched[j, 0], touched[j, 1]] = 0.0
            forces[INTERFACES - 1] = -mesh_deviation(sy[qy + 4], phases[0], phases[1], speed, data)
            correct(sx, data.x.k, forces, 0, x_modes, nx, nx)
            correct(sy, data.y.k, forces, nx, y_modes, ny, ny)
            for j in range(accel.shape[0]):
                accel[j, column + i] = 0.0
            site_accelerations(
                sx, data.x.k, data.x.length, x_known, data.x.site_index, accel, column + i, x_modes, nx, nx
            )
            site_accelerations(
                sy, data.y.k, data.y.length, y_known, data.y.site_index, accel, column + i, y_modes, ny, ny
            )
            if step % data.oversampling == 0:
                motion[samples, 0] = passed
                motion[samples, 1] = speed
                put_motion(sx, sy, data, forces, motion[samples])
                samples += 1
        return samples

    return compiled(run)
