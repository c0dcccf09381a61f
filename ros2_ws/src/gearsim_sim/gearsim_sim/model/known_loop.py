"""Known forces beside motor, load and weight in the compiled loop: ripple, unbalance, bow, misalignment.

The readable twin is `RotatingForce`. Torques among them are not balanced by the motor, nor is the
fluctuation of the load: the rigid rotation gives way to them,

    J (delta'' + 2 zeta w delta' + w^2 delta) = torque,

w being far below all ripple (`CONTROL_HZ`): the speed controller of any drive, without which angles would
wander off. It is solved as the modes are, with a cubic in time.
"""

from __future__ import annotations

import math

from gearsim_sim.integrate.compiled import apart, embedded
from gearsim_sim.integrate.pieces import cosine_sine, polynomial
from gearsim_sim.model.joint_loop import KNOWN, remember, severity_of
from gearsim_sim.model.loop_data import SEVERITY_COLUMNS, Array, Data, Drive
from gearsim_sim.model.side_data import CONTROL_HZ, Side

_OWN = SEVERITY_COLUMNS
_TURN = 2.0 * math.pi
_CONTROL = _TURN * CONTROL_HZ
_ROOT_HALF = math.sqrt(0.5)
# Places in Side.drift: xi, three drives, then angle and speed of the rigid rotation beyond its course, in
# turns and Hz: the angle as predicted for the next step.
ANGLE, SPEED = 5, 6


@embedded
def rotating_force(
    row: Array, step: int, speed_hz: float, change: float, phases: Array, rates: Array, data: Data
) -> float:
    """A row of the table at a step; `change` is that of the speed [Hz/s]."""
    track, order = int(row[_OWN + 1]), row[_OWN + 2]
    if track < 0:
        turns = order * (step * data.step_s)
        frequency = order
    else:
        turns = order * phases[track]
        frequency = abs(order * rates[track] * speed_hz)
    c, s = cosine_sine(turns - math.floor(turns), data.circle)
    w = _TURN * speed_hz
    force = (row[_OWN + 3] * c + row[_OWN + 4] * s) * (row[_OWN + 5] + row[_OWN + 6] * w * w)
    force += (row[_OWN + 3] * s - row[_OWN + 4] * c) * row[_OWN + 7] * _TURN * change
    corner = row[_OWN + 8]
    if corner > 0.0:
        x = (frequency / corner) ** 4
        force *= x / (1.0 + x)
    value: float = severity_of(row, step) * force
    return value


@apart
def known_forces(
    step: int, fresh: bool, speed_hz: float, change: float, phases: Array, drive: Drive, data: Data,
    side: Side, s0: Array, s1: Array, n0: int, n1: int,
) -> None:  # fmt: skip
    """Add known forces to the known modal forces of both parts; let the rigid rotation follow torques.

    `fresh`: the known modal forces have just been worked out anew. `n0` and `n1` are 2 nm of the parts.
    """
    restore_base(fresh, side, s0, s1, n0, n1)
    now = side.now
    for d in range(now.shape[1]):
        now[KNOWN, d] = 0.0
    for j in range(side.forcings.shape[0]):
        row = side.forcings[j]
        now[KNOWN, int(row[_OWN])] += rotating_force(row, step, speed_hz, change, phases, drive.rates, data)
    fluctuation, _, _ = polynomial(float(step - drive.start_step) / drive.length_steps, drive.fluctuation)
    torque = data.torque_ratios[1] * fluctuation
    for d in range(now.shape[1]):
        force = now[KNOWN, d]
        torque += side.rigid[d] * force
        for m in range(n0):
            s0[2 * n0 + m] += side.step[d, m] * force
        for m in range(n1):
            s1[2 * n1 + m] += side.step[d, n0 + m] * force
    follow(side, torque / data.inertia, data.step_s)


@embedded
def restore_base(fresh: bool, side: Side, s0: Array, s1: Array, n0: int, n1: int) -> None:
    """Known modal forces of motor, load and weight: keep them, or put back those that were kept."""
    if fresh:
        for m in range(n0):
            side.base[m] = s0[2 * n0 + m]
        for m in range(n1):
            side.base[n0 + m] = s1[2 * n1 + m]
    else:
        for m in range(n0):
            s0[2 * n0 + m] = side.base[m]
        for m in range(n1):
            s1[2 * n1 + m] = side.base[n0 + m]


@embedded
def follow(side: Side, push: float, step_s: float) -> None:
    """The rigid rotation's way beyond its course after a step under torque / inertia."""
    drift, pole = side.drift, side.drift_pole
    real = pole[0] * drift[0] - pole[1] * drift[1] + pole[2] * push
    imag = pole[0] * drift[1] + pole[1] * drift[0] + pole[3] * push
    for i in range(3):
        real += pole[4 + 2 * i] * drift[2 + i]
        imag += pole[5 + 2 * i] * drift[2 + i]
    drift[0] = real
    drift[1] = imag
    remember(drift, 2, push)
    own = _CONTROL * _ROOT_HALF
    speed = (own * real - own * imag) / own / _TURN
    drift[ANGLE] = imag / own / _TURN + step_s * speed
    drift[SPEED] = speed
