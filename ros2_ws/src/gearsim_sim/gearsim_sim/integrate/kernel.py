"""One step of the cubic exponential scheme, compiled: generic in the system, blind to what the forces are.

A loop calls, for each step and each independent part of its system, `predict` and `interface_motion`, then
its own force functions, then `correct` and `site_accelerations`. All numbers of a part live in two flat
arrays, `k` (constants) and `s` (state), so that the compiler sees that nothing overlaps. Sizes must be
compile-time constants of the calling loop (closure variables): `nm` modes (a multiple of LANES), `ni`
interfaces and `nq` of their motions; only the number of sites may vary. What does not change within a run
must not decide a branch in the loop: the compiler would copy the whole loop for it.
Layout, in units of doubles:

    k: decay 2nm | c0 2nm | c1 2nm | c2 2nm | c3 2nm | left ni 2nm
       | displacement rows ni 2nm | rate rows ni 2nm | their compliance 2ni ni
       | sites: rows ns 2nm, compliance ns ni
    s: z 2nm | predicted z 2nm | force known now 2nm | forces of the last three instants 3 x 2nm
       | rows 2ni | motions: displacements ni, rates ni | interface forces: now and the last two, 3 ni
       | site rows ns

Complex numbers are split: nm real parts, then nm imaginary parts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.coefficients import Propagator
from gearsim_sim.integrate.compiled import inlined

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


def pack_constants(propagator: Propagator) -> Array:
    """The array `k`; the propagator must have the rates of its interfaces."""
    nq, ni, nm2 = propagator.motions, propagator.interfaces, 2 * propagator.modes
    rows, compliance = propagator.rows.reshape(-1, nm2), propagator.compliance.reshape(-1, ni)
    parts = (
        propagator.decay,
        propagator.weights,
        propagator.left,
        rows[:nq],
        compliance[:nq],
        rows[nq:],
        compliance[nq:],
    )
    return np.concatenate([np.ravel(part) for part in parts])


def pack_state(propagator: Propagator, z: Array, known: Array, forces: Array) -> Array:
    """The array `s` for a start from rest: all forces have been as they are now."""
    nm2, ni = 2 * propagator.modes, propagator.interfaces
    modal = known + propagator.left.reshape(ni, nm2).T @ forces
    motions, sites = np.zeros(2 * propagator.motions), np.zeros(propagator.sites)
    return np.concatenate(
        [z, np.zeros(nm2), known, modal, modal, modal, motions, forces, forces, forces, sites]
    )


@inlined
def predict(s: Array, k: Array, nm: int) -> None:
    """Mode coordinates at the next instant without the new interface forces."""
    n2 = 2 * nm
    for m in range(nm):
        zr = s[m]
        zi = s[nm + m]
        real = k[m] * zr - k[nm + m] * zi
        imag = k[m] * zi + k[nm + m] * zr
        real += k[n2 + m] * s[2 * n2 + m] - k[n2 + nm + m] * s[2 * n2 + nm + m]
        imag += k[n2 + m] * s[2 * n2 + nm + m] + k[n2 + nm + m] * s[2 * n2 + m]
        real += k[2 * n2 + m] * s[3 * n2 + m] - k[2 * n2 + nm + m] * s[3 * n2 + nm + m]
        imag += k[2 * n2 + m] * s[3 * n2 + nm + m] + k[2 * n2 + nm + m] * s[3 * n2 + m]
        real += k[3 * n2 + m] * s[4 * n2 + m] - k[3 * n2 + nm + m] * s[4 * n2 + nm + m]
        imag += k[3 * n2 + m] * s[4 * n2 + nm + m] + k[3 * n2 + nm + m] * s[4 * n2 + m]
        real += k[4 * n2 + m] * s[5 * n2 + m] - k[4 * n2 + nm + m] * s[5 * n2 + nm + m]
        imag += k[4 * n2 + m] * s[5 * n2 + nm + m] + k[4 * n2 + nm + m] * s[5 * n2 + m]
        s[n2 + m] = real
        s[n2 + nm + m] = imag


@inlined
def times_state(s: Array, k: Array, rows: int, count: int, length: int, n2: int, out: int) -> None:
    """`count` rows of k (n2 long, from `rows` on) times the predicted mode coordinates, into s[out:].

    `length` is n2 once more, but must not be a compile-time constant: the compiler would unroll short
    rows into scalar code instead of filling vector registers. The masks tell it that a number is not
    negative. Four rows at a time hide the latency of the sums.
    """
    n = length & 0xFFFF
    blocks = (count & 0xFFFF) // 4
    for b in range(blocks):
        i = 4 * b
        t0 = 0.0
        t1 = 0.0
        t2 = 0.0
        t3 = 0.0
        for m in range(n):
            v = s[n2 + m]
            t0 += k[rows + i * n2 + m] * v
            t1 += k[rows + (i + 1) * n2 + m] * v
            t2 += k[rows + (i + 2) * n2 + m] * v
            t3 += k[rows + (i + 3) * n2 + m] * v
        s[out + i] = t0
        s[out + i + 1] = t1
        s[out + i + 2] = t2
        s[out + i + 3] = t3
    for i in range(4 * blocks, count):
        total = 0.0
        for m in range(n):
            total += k[rows + i * n2 + m] * s[n2 + m]
        s[out + i] = total


@inlined
def interface_motion(s: Array, k: Array, length: int, nm: int, ni: int, nq: int) -> int:
    """The motion of the interfaces at the next instant, with extrapolated forces.

    Returns where in `s` the motion starts: `ni` displacements, and behind them `ni` rates if `nq` is 2 ni
    and not ni. The new forces enter through the compliance of one step only, so their extrapolation by a
    parabola is plenty: it is wrong by far less than the scheme. `length` is 2 nm, see `times_state`.
    """
    n2 = 2 * nm
    rows = 5 * n2 + ni * n2
    comp = rows + 2 * ni * n2
    y = 6 * n2
    q = y + 2 * ni
    g = q + 2 * ni
    times_state(s, k, rows, nq, length, n2, y)
    for i in range(nq):
        total = s[y + i]
        for j in range(ni):
            guess = 3.0 * (s[g + j] - s[g + ni + j]) + s[g + 2 * ni + j]
            total += k[comp + i * ni + j] * guess
        s[q + i] = total
    return q


@inlined
def correct(s: Array, k: Array, forces: Array, at: int, nm: int, ni: int) -> None:
    """Take the new interface forces, forces[at : at + ni], into the mode coordinates and the history."""
    n2 = 2 * nm
    left = 5 * n2
    g = 6 * n2 + 4 * ni
    for m in range(nm):
        s[5 * n2 + m] = s[4 * n2 + m]
        s[5 * n2 + nm + m] = s[4 * n2 + nm + m]
        s[4 * n2 + m] = s[3 * n2 + m]
        s[4 * n2 + nm + m] = s[3 * n2 + nm + m]
        real = 0.0
        imag = 0.0
        for i in range(ni):
            real += k[left + i * n2 + m] * forces[at + i]
            imag += k[left + i * n2 + nm + m] * forces[at + i]
        s[m] = s[n2 + m] + (k[n2 + m] * real - k[n2 + nm + m] * imag)
        s[nm + m] = s[n2 + nm + m] + (k[n2 + m] * imag + k[n2 + nm + m] * real)
        s[3 * n2 + m] = s[2 * n2 + m] + real
        s[3 * n2 + nm + m] = s[2 * n2 + nm + m] + imag
    for i in range(ni):
        s[g + 2 * ni + i] = s[g + ni + i]
        s[g + ni + i] = s[g + i]
        s[g + i] = forces[at + i]


@inlined
def site_accelerations(
    s: Array, k: Array, length: int, known: Array, index: Indices, out: Array, column: int, nm: int, ni: int
) -> None:
    """Accelerations of the sites from the equation of motion, added to out[index, column].

    They follow from the predicted mode coordinates, the new interface forces and `known`, what the
    known inputs give.
    """
    n2 = 2 * nm
    ns = known.size & 0xFFFF
    rows = 5 * n2 + 3 * ni * n2 + 2 * ni * ni
    comp = rows + ns * n2
    g = 6 * n2 + 4 * ni
    y = g + 3 * ni
    times_state(s, k, rows, ns, length, n2, y)
    for i in range(ns):
        total = s[y + i] + known[i]
        for j in range(ni):
            total += k[comp + i * ni + j] * s[g + j]
        out[index[i], column] += total


@inlined
def state_row(s: Array, row: Array, length: int) -> float:
    """One linear output of the mode coordinates, such as the angle of an encoder; `length` is 2 nm."""
    total = 0.0
    for m in range(length & 0xFFFF):
        total += row[m] * s[m]
    return total
