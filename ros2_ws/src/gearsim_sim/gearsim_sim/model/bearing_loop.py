"""Forces of all rolling bearings in the compiled loop; the readable twin is `BearingSeat`.

Healthy bearings take the short way, `ball_forces`; which way a bearing takes is decided once per bearing and
step, never per ball. What faults do is entered beforehand, see `bearing_fault_loop`. Slipping cages and oil
films have a memory.
"""

from __future__ import annotations

import math

from gearsim_sim.integrate.compiled import apart, inlined
from gearsim_sim.integrate.pieces import cosine_sine
from gearsim_sim.model.bearing_fault_loop import (
    CAGE,
    CLEARANCE,
    DIRTY,
    FILM,
    MEAN_FORCE,
    PLAY,
    SLIPS,
    SQUEEZE,
    SQUEEZE_ROOT,
    enter_profiles,
    enter_spalls,
    enter_terms,
    place_spalls,
    severity,
    turn_balls,
)
from gearsim_sim.model.loop_data import Array, BearingMemory, Bearings, Drive

__all__ = ["bearing_forces", "place_spalls", "severity"]
_FORCE_MEMORY_S = 0.1  # over which the force is averaged that decides on the slip
_NEWTON = 3  # steps for an oil film; one settles a steady film, three one that is hit


@inlined
def ball_forces(
    along: float, across: float, clearance: float, b: int, bearings: Bearings, missing: Array, balls: int
) -> tuple[float, float]:
    """Sum of gap^1.5 over the balls in contact, in the frame of the cage.

    `balls` must be a compile-time constant, see `times_state`: so few are too few for a loop of free length
    to fill vector registers. Rows of arrays are not taken out: counting references to them would cost more.
    """
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = bearings.cosines[b, j], bearings.sines[b, j]
        gap = along * cj + across * sj - clearance - missing[b, j]
        gap = gap if gap > 0.0 else 0.0
        force = gap * math.sqrt(gap)
        fx += force * cj
        fy += force * sj
    return fx, fy


@inlined
def film_thickness(gap: float, before: float, factor: float, unit: float, damping: float) -> float:
    """Thickness of a ball's film after this step over that under 1 N, by an implicit step; see `oil_film`.

    c(h) (h - h_before) / step + k (gap + h)^n - Q_s(h) = 0 has one root, as the left side grows with h.
    `damping` is h c(h) over the step, `unit` the thickness under 1 N.
    """
    z = before
    for _ in range(_NEWTON):
        inverse = 1.0 / z
        square = inverse * inverse
        fifth = square * square * inverse
        carried = fifth * fifth * fifth
        elastic = gap + unit * z
        elastic = elastic if elastic > 0.0 else 0.0
        slope = factor * math.sqrt(elastic)
        rest = damping * (1.0 - before * inverse) + slope * elastic - carried
        growth = damping * before * square + 1.5 * slope * unit + 15.0 * carried * inverse
        z = limited(z, rest / growth)
    return z


@inlined
def ninth_root(x: float) -> float:
    """x^(1/9), to 1e-12 from 1e-12 to 1e-2, without a branch: for compressions of rollers in m.

    The eighth root of x in tens of micrometres is off by 20 % at most; four steps of Halley's method each
    leave 20/3 of the third power of the error.
    """
    t = x * 1e5 + 1e-30  # not zero, where no compression is left
    y = math.sqrt(math.sqrt(math.sqrt(t)))
    for _ in range(4):
        cube = y * y * y
        ninth = cube * cube * cube
        y *= (8.0 * ninth + 10.0 * t) / (10.0 * ninth + 8.0 * t)
    root: float = y * 0.2782559402207124  # (1e-5)^(1/9)
    return root


@inlined
def roller_film_thickness(gap: float, before: float, factor: float, unit: float, damping: float) -> float:
    """The same of a roller."""
    z = before
    for _ in range(_NEWTON):
        inverse = 1.0 / z
        square = inverse * inverse
        fifth = square * square * inverse
        carried = fifth * fifth
        elastic = gap + unit * z
        elastic = elastic if elastic > 0.0 else 0.0
        slope = factor * ninth_root(elastic)
        rest = damping * (1.0 - before * inverse) + slope * elastic - carried
        growth = damping * before * square + 10.0 / 9.0 * slope * unit + 10.0 * carried * inverse
        z = limited(z, rest / growth)
    return z


@inlined
def limited(z: float, down: float) -> float:
    """z - down, but at least z / 2 and at most 2 z."""
    least, most, there = 0.5 * z, 2.0 * z, z - down
    there = there if there > least else least
    return there if there < most else most


@apart
def film_ball_forces(
    along: float, across: float, clearance: float, b: int, factor: float, memory: BearingMemory, now: Array,
    step_s: float, balls: int,
) -> tuple[float, float]:  # fmt: skip
    """`ball_forces` with oil films, which move on by a step: a film of the thickness h adds to the gap."""
    unit, damping = now[b, FILM], now[b, SQUEEZE] / step_s
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = memory.cosines[b, j], memory.sines[b, j]
        gap = along * cj + across * sj - clearance - memory.missing[b, j]
        z = film_thickness(gap, memory.film[b, j], factor, unit, damping)
        memory.film[b, j] = z
        gap += unit * z
        gap = gap if gap > 0.0 else 0.0
        force = gap * math.sqrt(gap)
        fx += force * cj
        fy += force * sj
    return fx, fy


@apart
def film_roller_forces(
    along: float, across: float, clearance: float, b: int, factor: float, memory: BearingMemory, now: Array,
    step_s: float, balls: int,
) -> tuple[float, float]:  # fmt: skip
    """The same of rollers."""
    unit, squeeze = now[b, FILM], now[b, SQUEEZE_ROOT] / step_s
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = memory.cosines[b, j], memory.sines[b, j]
        gap = along * cj + across * sj - clearance - memory.missing[b, j]
        before = memory.film[b, j]
        z = roller_film_thickness(gap, before, factor, unit, squeeze / math.sqrt(unit * before))
        memory.film[b, j] = z
        gap += unit * z
        gap = gap if gap > 0.0 else 0.0
        force = gap * ninth_root(gap)
        fx += force * cj
        fy += force * sj
    return fx, fy


@apart
def roller_forces(
    along: float, across: float, clearance: float, b: int, memory: BearingMemory, balls: int
) -> tuple[float, float]:
    """Sum of gap^(10/9) over the rollers in contact, in the frame of the cage."""
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = memory.cosines[b, j], memory.sines[b, j]
        gap = along * cj + across * sj - clearance - memory.missing[b, j]
        gap = gap if gap > 0.0 else 0.0
        force = gap * ninth_root(gap)
        fx += force * cj
        fy += force * sj
    return fx, fy


@apart
def other_forces(
    along: float, across: float, clearance: float, b: int, bearings: Bearings, memory: BearingMemory,
    now: Array, step_s: float, balls: int,
) -> tuple[float, float]:  # fmt: skip
    """The same for rollers, for balls out of the middle of their pockets, and with oil films."""
    if now[b, PLAY] != 0.0:
        turn_balls(b, bearings, memory)
    factor = bearings.numbers[b, 0]
    if bearings.rollers[b] != 0 and now[b, FILM] > 0.0:
        return film_roller_forces(along, across, clearance, b, factor, memory, now, step_s, balls)
    if bearings.rollers[b] != 0:
        return roller_forces(along, across, clearance, b, memory, balls)
    if now[b, FILM] > 0.0:
        return film_ball_forces(along, across, clearance, b, factor, memory, now, step_s, balls)
    fx = 0.0
    fy = 0.0
    for j in range(balls):
        cj, sj = memory.cosines[b, j], memory.sines[b, j]
        gap = along * cj + across * sj - clearance - memory.missing[b, j]
        gap = gap if gap > 0.0 else 0.0
        force = gap * math.sqrt(gap)
        fx += force * cj
        fy += force * sj
    return fx, fy


@apart
def jump_forces(
    found: int, q: Array, phases: Array, bearings: Bearings, circle: Array, memory: BearingMemory, now: Array,
    jumps: Array, forces: Array,
) -> None:  # fmt: skip
    """What rectangular pits change in the forces: the force without the pit, part by part that with it."""
    for i in range(found):
        b, ball = int(jumps[i, 0]), int(jumps[i, 1])
        c, s = cosine_sine(phases[bearings.places[b, 2]] + now[b, CAGE], circle)
        own_c, own_s = bearings.cosines[b, ball], bearings.sines[b, ball]
        if now[b, PLAY] != 0.0:
            own_c, own_s = memory.cosines[b, ball], memory.sines[b, ball]
        ux, uy = own_c * c - own_s * s, own_c * s + own_s * c
        ix, iy = bearings.places[b, 0], bearings.places[b, 1]
        gap = q[ix] * ux + q[iy] * uy - bearings.numbers[b, 1] - now[b, CLEARANCE] - memory.missing[b, ball]
        if now[b, FILM] > 0.0:
            gap += now[b, FILM] * memory.film[b, ball]
        exponent = 1.5 if bearings.rollers[b] == 0 else 10.0 / 9.0
        pit = max(gap - jumps[i, 2], 0.0) ** exponent - max(gap, 0.0) ** exponent
        change = bearings.numbers[b, 0] * jumps[i, 3] * pit
        forces[ix] -= change * ux
        forces[iy] -= change * uy


@inlined
def bearing_forces(
    step: int, q: Array, phases: Array, speed: float, drive: Drive, bearings: Bearings, circle: Array,
    memory: BearingMemory, now: Array, jumps: Array, forces: Array, step_s: float, balls: int,
) -> None:  # fmt: skip
    """Forces of the bearings beyond their linear part, into `forces`.

    `memory.missing` is zero before and after. `balls` is a compile-time constant.
    """
    if drive.bearing_terms.shape[0] > 0:
        enter_terms(step, speed, step_s, drive, bearings, memory, now)
    found = 0
    if drive.spalls.shape[0] > 0:
        found = enter_spalls(step, speed * step_s, phases, drive, bearings, memory, now, jumps)
    if drive.profiles.shape[0] > 0:
        enter_profiles(step, phases, drive, bearings, memory, now)
    cage, c, s = -1.0, 1.0, 0.0
    for b in range(bearings.places.shape[0]):
        angle = phases[bearings.places[b, 2]] + now[b, CAGE]
        if angle != cage:  # bearings of one kind on one shaft share their cage's angle
            cage = angle
            c, s = cosine_sine(cage, circle)
        ix, iy = bearings.places[b, 0], bearings.places[b, 1]
        x, y = q[ix], q[iy]
        along, across = x * c + y * s, y * c - x * s
        clearance = bearings.numbers[b, 1] + now[b, CLEARANCE]
        if bearings.rollers[b] != 0 or now[b, PLAY] != 0.0 or now[b, FILM] > 0.0:
            fx, fy = other_forces(along, across, clearance, b, bearings, memory, now, step_s, balls)
        else:
            fx, fy = ball_forces(along, across, clearance, b, bearings, memory.missing, balls)
        factor = bearings.numbers[b, 0]
        forces[ix] = bearings.numbers[b, 2] * x - factor * (fx * c - fy * s)
        forces[iy] = bearings.numbers[b, 2] * y - factor * (fx * s + fy * c)
        if now[b, SLIPS] != 0.0:
            size = factor * math.sqrt(fx * fx + fy * fy)
            memory.cage[b, MEAN_FORCE] += (size - memory.cage[b, MEAN_FORCE]) * (step_s / _FORCE_MEMORY_S)
    if found > 0:
        jump_forces(found, q, phases, bearings, circle, memory, now, jumps, forces)
    for b in range(bearings.places.shape[0]):
        if now[b, DIRTY] != 0.0:
            now[b, DIRTY] = 0.0
            for j in range(balls):
                memory.missing[b, j] = 0.0
