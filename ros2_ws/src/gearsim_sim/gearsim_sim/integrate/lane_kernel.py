"""One step of the cubic exponential scheme for several systems at once, compiled.

The scheme is that of `kernel`, its sums ordered for vectors whose lanes are systems. The modes are scaled
so that c0 is one, and what is known of the next instant is kept apart from the forces that are not:

    F = L g + known,   z = p + F,   p' = E z + c1 F + u1,   u1' = c2 F + u2,   u2' = c3 F

where p is z without the newest force, a dash marks the next instant, and u1 and u2 hold what past forces
will still give. So a step reads and writes each mode once and moves no history, and `advance` can take the
sums over the modes that the next step begins with: products of p with the rows of the interfaces'
motions and of the sites. A step is `guess_forces`, `motion`, the forces g, `accelerations`, `advance`.

Modes come in blocks of four, so that a force or a sum is loaded once for all four. All numbers lie in a
few arrays of shape (rows, LANES), or flat where all lanes share them; a row of `layout` says where those
of a part of the system begin.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.vectors import fma, load, splat, store

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
BLOCK = 4  # modes
PAIRS = 2 * BLOCK  # their real and imaginary parts
STATE_ROWS = 4 * PAIRS  # of a block: p, u1, u2, known force
# Columns of `layout`: numbers of blocks, interfaces, their motions (displacements, and rates or none), sites
# and outputs, then where things begin.
(
    BLOCKS, INTERFACES, MOTIONS, SITES, OUTPUTS, FIRST_BLOCK, FIRST_INTERFACE, FIRST_SITE, FIRST_SUM,
    STEP, COMPLIANCE, OUT_ROWS, OUT_COMPLIANCE, KNOWN, KNOWN_ROWS, COLUMNS,
) = range(16)  # fmt: skip


class LaneSystem(NamedTuple):
    """Constants of the linear systems of all lanes; [a][b] reads: for each a, for each b."""

    layout: Indices  # (parts, COLUMNS)
    step: Array  # [part][block]: [interface] L, [E, c1, c2, c3], [sum] rows; each PAIRS numbers
    compliance: Array  # [part][sum][interface]: interface motions, then sites
    out_rows: Array  # [part][output][block] PAIRS numbers
    out_compliance: Array  # [part][output][interface]
    known: Array  # [part][block][input] PAIRS numbers
    known_rows: Array  # [part][sum, then output][input]
    site_index: Indices  # [part][site] acceleration output that each site adds to


class LaneState(NamedTuple):
    """What moves."""

    modes: Array  # (blocks STATE_ROWS, LANES)
    forces: Array  # (3 interfaces, LANES) now and at the last two instants
    sums: Array  # (sums, LANES) of the next step
    known: Array  # (sums and outputs, LANES) what the known inputs add to them
    motion: Array  # (motions, LANES) displacements of the interfaces, then their rates or none


@inlined
def guess_forces(state: LaneState, count: int) -> None:
    """Extrapolate the forces by a parabola, into the rows that are about to be written."""
    for i in range(count):
        now, before = load(state.forces, i), load(state.forces, count + i)
        oldest = load(state.forces, 2 * count + i)
        store(state.forces, 2 * count + i, before)
        store(state.forces, count + i, now)
        store(state.forces, i, fma(splat(3.0), now - before, oldest))


@inlined
def with_forces(rows: Array, k: int, forces: Array, first: int, count: int, total: Any) -> Any:
    """`total` and the products of a compliance row with the forces."""
    for j in range(count):
        total = fma(load(rows, k + j), load(forces, first + j), total)
    return total


@inlined
def motion(system: LaneSystem, state: LaneState, part: int) -> None:
    """Displacements of a part's interfaces, and rates, from the sums and the guess of the forces."""
    at = system.layout[part]
    count, first = at[INTERFACES], at[FIRST_INTERFACE]
    for i in range(at[MOTIONS]):
        total = load(state.sums, at[FIRST_SUM] + i) + load(state.known, at[KNOWN_ROWS] + i)
        k = at[COMPLIANCE] + i * count
        total = with_forces(system.compliance, k, state.forces, first, count, total)
        # Rates lie behind the displacements of all parts.
        place = first + i if i < count else first + i - count + state.forces.shape[0] // 3
        store(state.motion, place, total)


@inlined
def accelerations(
    system: LaneSystem, state: LaneState, part: int, accel: Array, width: int, column: int
) -> None:
    """Add those of the sites of a part to column `column` of `accel` [site][width], with the new forces."""
    at = system.layout[part]
    count, first, motions = at[INTERFACES], at[FIRST_INTERFACE], at[MOTIONS]
    for i in range(at[SITES]):
        row = motions + i
        total = load(state.sums, at[FIRST_SUM] + row) + load(state.known, at[KNOWN_ROWS] + row)
        k = at[COMPLIANCE] + row * count
        total = with_forces(system.compliance, k, state.forces, first, count, total)
        place = system.site_index[at[FIRST_SITE] + i] * width + column
        store(accel, place, load(accel, place) + total)


@inlined
def outputs(system: LaneSystem, state: LaneState, part: int, out: Array, row: int) -> Any:
    """Linear outputs of the state with the new forces, into `out` from `row` on; returns the row behind."""
    at = system.layout[part]
    count, first = at[INTERFACES], at[FIRST_INTERFACE]
    for i in range(at[OUTPUTS]):
        total = load(state.known, at[KNOWN_ROWS] + at[MOTIONS] + at[SITES] + i)
        k = at[OUT_ROWS] + i * at[BLOCKS] * PAIRS
        for b in range(at[BLOCKS]):
            s = (at[FIRST_BLOCK] + b) * STATE_ROWS
            for m in range(PAIRS):
                total = fma(load(system.out_rows, k + b * PAIRS + m), load(state.modes, s + m), total)
        k = at[OUT_COMPLIANCE] + i * count
        total = with_forces(system.out_compliance, k, state.forces, first, count, total)
        store(out, row + i, total)
    return row + at[OUTPUTS]


@inlined
def know(system: LaneSystem, state: LaneState, part: int, inputs: Array) -> None:
    """Take in new values of the known inputs, to be called before `motion`."""
    at = system.layout[part]
    count = inputs.shape[0]
    for b in range(at[BLOCKS]):
        for m in range(PAIRS):
            k, total = at[KNOWN] + b * count * PAIRS + m, splat(0.0)
            for j in range(count):
                total = fma(load(system.known, k + j * PAIRS), load(inputs, j), total)
            store(state.modes, (at[FIRST_BLOCK] + b) * STATE_ROWS + 3 * PAIRS + m, total)
    rows = at[MOTIONS] + at[SITES] + at[OUTPUTS]
    for i in range(rows):
        k = (at[KNOWN_ROWS] + i) * count
        store(
            state.known, at[KNOWN_ROWS] + i, with_forces(system.known_rows, k, inputs, 0, count, splat(0.0))
        )


@inlined
def advance_mode(step: Array, k: int, modes: Array, s: int, force_r: Any, force_i: Any) -> Any:
    """One mode's p of the next instant; `force_r`, `force_i` is L g, k its E and s its p."""
    f_r, f_i = force_r + load(modes, s + 3 * PAIRS), force_i + load(modes, s + 3 * PAIRS + 1)
    z_r, z_i = load(modes, s) + f_r, load(modes, s + 1) + f_i
    a, b = load(step, k), load(step, k + 1)
    p_r = fma(a, z_r, fma(-b, z_i, load(modes, s + PAIRS)))
    p_i = fma(a, z_i, fma(b, z_r, load(modes, s + PAIRS + 1)))
    a, b = load(step, k + PAIRS), load(step, k + PAIRS + 1)
    p_r = fma(a, f_r, fma(-b, f_i, p_r))
    p_i = fma(a, f_i, fma(b, f_r, p_i))
    store(modes, s, p_r)
    store(modes, s + 1, p_i)
    a, b = load(step, k + 2 * PAIRS), load(step, k + 2 * PAIRS + 1)
    store(modes, s + PAIRS, fma(a, f_r, fma(-b, f_i, load(modes, s + 2 * PAIRS))))
    store(modes, s + PAIRS + 1, fma(a, f_i, fma(b, f_r, load(modes, s + 2 * PAIRS + 1))))
    a, b = load(step, k + 3 * PAIRS), load(step, k + 3 * PAIRS + 1)
    store(modes, s + 2 * PAIRS, fma(a, f_r, -(b * f_i)))
    store(modes, s + 2 * PAIRS + 1, fma(a, f_i, b * f_r))
    return p_r, p_i


@inlined
def advance(system: LaneSystem, state: LaneState, part: int) -> None:
    """All modes of a part to the next instant, and the sums that the next step begins with."""
    at = system.layout[part]
    count, first, step, modes = at[INTERFACES], at[FIRST_INTERFACE], system.step, state.modes
    rows, sums, k = at[MOTIONS] + at[SITES], at[FIRST_SUM], at[STEP]
    for i in range(rows):
        store(state.sums, sums + i, splat(0.0))
    for block in range(at[BLOCKS]):
        s = (at[FIRST_BLOCK] + block) * STATE_ROWS
        r0, r1, r2, r3 = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
        i0, i1, i2, i3 = splat(0.0), splat(0.0), splat(0.0), splat(0.0)
        for j in range(count):
            force = load(state.forces, first + j)
            r0, i0 = fma(load(step, k), force, r0), fma(load(step, k + 1), force, i0)
            r1, i1 = fma(load(step, k + 2), force, r1), fma(load(step, k + 3), force, i1)
            r2, i2 = fma(load(step, k + 4), force, r2), fma(load(step, k + 5), force, i2)
            r3, i3 = fma(load(step, k + 6), force, r3), fma(load(step, k + 7), force, i3)
            k += PAIRS
        r0, i0 = advance_mode(step, k, modes, s, r0, i0)
        r1, i1 = advance_mode(step, k + 2, modes, s + 2, r1, i1)
        r2, i2 = advance_mode(step, k + 4, modes, s + 4, r2, i2)
        r3, i3 = advance_mode(step, k + 6, modes, s + 6, r3, i3)
        k += 4 * PAIRS
        for i in range(rows):
            real = fma(load(step, k), r0, load(state.sums, sums + i))
            imag = load(step, k + 1) * i0
            real, imag = fma(load(step, k + 2), r1, real), fma(load(step, k + 3), i1, imag)
            real, imag = fma(load(step, k + 4), r2, real), fma(load(step, k + 5), i2, imag)
            real, imag = fma(load(step, k + 6), r3, real), fma(load(step, k + 7), i3, imag)
            store(state.sums, sums + i, real + imag)
            k += PAIRS
