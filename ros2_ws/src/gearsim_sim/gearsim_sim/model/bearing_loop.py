"""Forces of all rolling bearings in the compiled loop; the readable twin is `BearingSeat`."""

from __future__ import annotations

import math

from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.pieces import cosine_sine, ramp
from gearsim_sim.model.loop_data import Array, Bearings, Drive, Indices

_OWN = 4  # first column behind those of the severity


@inlined
def severity(row: Array, step: int) -> float:
    """Severity of a row of a table at a step."""
    rise, _, _ = ramp(float(step) - row[2], row[3])
    value: float = row[0] + (row[1] - row[0]) * rise
    return value


@inlined
def spall_ball(row: Array, step: int, phases: Array, bearings: Bearings) -> tuple[int, float]:
    """The ball nearest to a spall, and how much the race is away under it."""
    bearing = int(row[_OWN])
    now = severity(row, step)
    count = bearings.balls_per_row[bearing]
    middle = row[_OWN + 5] + row[_OWN + 3] * phases[int(row[_OWN + 2])]
    cage = phases[bearings.index[bearing, 2]]
    place = (middle - cage - bearings.row_offsets[bearing, int(row[_OWN + 1])]) * count
    nearest = math.floor(place + 0.5)
    beta = row[_OWN + 6] - abs(place - nearest) * (2.0 * math.pi / count)
    ball = int(row[_OWN + 1]) * count + int(nearest) % count
    if beta <= 0.0 or now == 0.0:
        return ball, 0.0
    race, radius = row[_OWN + 8], row[_OWN + 9]
    chord = race * math.sin(beta)
    half = math.sin(0.5 * beta)
    sagitta = 2.0 * race * half * half
    own = radius - math.sqrt(radius * radius - chord * chord)
    drop = own + sagitta if row[_OWN + 4] != 0.0 else own - sagitta
    return ball, now * min(row[_OWN + 7], drop)


@inlined
def contact_force(
    x: float, y: float, c: float, s: float, bearing: int, bearings: Bearings, missing: Array, balls: int
) -> tuple[float, float]:
    """Force of the inner ring on the outer ring; c and s turn into the frame of the cage.

    `missing` is (bearings, balls); `balls` must be a compile-time constant, see `times_state`: so few are
    too few for a loop of free length to fill vector registers.
    """
    along, across = x * c + y * s, y * c - x * s
    clearance = bearings.numbers[bearing, 1]
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = bearings.cosines[bearing, j], bearings.sines[bearing, j]
        gap = along * cj + across * sj - clearance - missing[bearing, j]
        gap = gap if gap > 0.0 else 0.0
        force = gap * math.sqrt(gap)
        fx += force * cj
        fy += force * sj
    factor = bearings.numbers[bearing, 0]
    return factor * (fx * c - fy * s), factor * (fx * s + fy * c)


@inlined
def place_spalls(
    step: int, phases: Array, drive: Drive, bearings: Bearings, missing: Array, touched: Indices
) -> None:
    """Enter what spalls take away under their nearest balls into `missing`; `touched` says where."""
    for j in range(drive.spalls.shape[0]):
        bearing = int(drive.spalls[j, _OWN])
        ball, depth = spall_ball(drive.spalls[j], step, phases, bearings)
        touched[j, 0] = bearing
        touched[j, 1] = ball
        missing[bearing, ball] += depth


@inlined
def bearing_forces(
    step: int, q: Array, rates: Array, phases: Array, drive: Drive, bearings: Bearings, circle: Array,  # noqa: ARG001
    missing: Array, touched: Indices, forces: Array, balls: int,
) -> None:  # fmt: skip
    """Forces of the bearings beyond their linear part, into `forces`; `missing` is zero before and after.

    `rates` of the interfaces are zero unless `drive.need_rates`.
    """
    place_spalls(step, phases, drive, bearings, missing, touched)
    cage, c, s = -1.0, 1.0, 0.0
    for b in range(bearings.index.shape[0]):
        angle = phases[bearings.index[b, 2]]
        if angle != cage:  # bearings of one kind on one shaft share their cage's angle
            cage = angle
            c, s = cosine_sine(cage, circle)
        ix, iy = bearings.index[b, 0], bearings.index[b, 1]
        fx, fy = contact_force(q[ix], q[iy], c, s, b, bearings, missing, balls)
        forces[ix] = bearings.numbers[b, 2] * q[ix] - fx
        forces[iy] = bearings.numbers[b, 2] * q[iy] - fy
    for j in range(touched.shape[0]):
        missing[touched[j, 0], touched[j, 1]] = 0.0
