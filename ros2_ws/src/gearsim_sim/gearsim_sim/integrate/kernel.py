"""One step of the cubic exponential scheme, compiled: generic in the system, blind to what the forces are.

A loop calls, for each step and each independent part of its system, `interface_motion`, then its own force
functions, then `site_accelerations` and `advance` (or `correct` and `predict`, where something comes in
between); `enter_known` whenever the known forces have changed. All numbers of a part live in two flat
arrays, `k` (constants) and `s` (state), so that the compiler sees that nothing overlaps. Sizes must be
compile-time constants of the calling loop (closure variables): `nm` modes (a multiple of LANES), `ni`
interfaces and `nq` of their motions; only the number of sites may vary. What does not change within a run
must not decide a branch in the loop: the compiler would copy the whole loop for it.
Layout, in units of doubles:

    k: decay 2nm | w1 2nm | w2 2nm | w3 2nm | left ni 2nm
       | displacement rows ni 2nm | rate rows ni 2nm | their compliance 2ni ni
       | sites: rows ns 2nm, compliance ns ni
    s: z 2nm | p 2nm | force known now 2nm | force 2nm | u 2nm | v 2nm
       | rows 2ni | the same of the known force 2ni | motions: displacements ni, rates ni
       | interface forces: now and the last two, 3 ni | site rows ns | the same of the known force ns

Forces f on the modes are those that enter within a step: c_0 is in `left`, and w_j = c_j / c_0. Then

    z_{n+1} = p_{n+1} + f_{n+1},    p_{n+1} = decay z_n + w1 f_n + u_n,
    u_{n+1} = w2 f_n + v_n,         v_{n+1} = w3 f_n,

the transposed form of the sum over the last three forces: one pass over the modes, and no history is moved.
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
        propagator.ratios,
        propagator.within(propagator.left.reshape(ni, nm2)),
        rows[:nq],
        compliance[:nq],
        rows[nq:],
        compliance[nq:],
    )
    return np.concatenate([np.ravel(part) for part in parts])


def pack_state(propagator: Propagator, z: Array, known: Array, forces: Array) -> Array:
    """The array `s` for a start from rest: all forces have been as they are now.

    `known` is within a step, as `Propagator.within` gives it.
    """
    nm2, ni = 2 * propagator.modes, propagator.interfaces
    modal = known + propagator.within(propagator.left.reshape(ni, nm2)).T @ forces
    rows, sites = np.zeros(3 * propagator.motions), np.zeros(2 * propagator.sites)
    history = [times(propagator.decay, z), known, modal, np.zeros(2 * nm2)]
    state = np.concatenate([z, *history, rows, forces, forces, forces, sites])
    add_history(propagator, state, modal)
    return state


def add_history(propagator: Propagator, state: Array, modal: Array) -> None:
    """Let a force on the modes (within a step) have acted for long, beside what is in the state already."""
    nm2 = 2 * propagator.modes
    first, second, third = (times(one, modal) for one in propagator.ratios.reshape(3, nm2))
    for row, added in ((1, first + second + third), (4, second + third), (5, third)):
        state[row * nm2 : (row + 1) * nm2] += added


def times(first: Array, second: Array) -> Array:
    """Product of flat complex rows."""
    half = first.size // 2
    product = (first[:half] + 1j * first[half:]) * (second[:half] + 1j * second[half:])
    return np.concatenate([product.real, product.imag])


@inlined
def times_state(s: Array, k: Array, rows: int, count: int, length: int, n2: int, at: int, out: int) -> None:
    """`count` rows of k (n2 long, from `rows` on) times the vector s[at:], into s[out:].

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
            v = s[at + m]
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
            total += k[rows + i * n2 + m] * s[at + m]
        s[out + i] = total


@inlined
def interface_motion(s: Array, k: Array, length: int, nm: int, ni: int, nq: int) -> int:
    """The motion of the interfaces at the next instant, with extrapolated forces.

    Returns where in `s` the motion starts: `ni` displacements, and behind them `ni` rates if `nq` is 2 ni
    and not ni. The new forces enter through the compliance of one step only, so their extrapolation by a
    parabola is plenty: it is wrong by far less than the scheme. `length` is 2 nm, see `times_state`.
    """
    n2 = 2 * nm
    rows = 4 * n2 + ni * n2
    comp = rows + 2 * ni * n2
    y = 6 * n2
    q = y + 4 * ni
    g = q + 2 * ni
    times_state(s, k, rows, nq, length, n2, n2, y)
    for i in range(nq):
        total = s[y + i] + s[y + 2 * ni + i]
        for j in range(ni):
            guess = 3.0 * (s[g + j] - s[g + ni + j]) + s[g + 2 * ni + j]
            total += k[comp + i * ni + j] * guess
        s[q + i] = total
    return q


@inlined
def enter_known(s: Array, k: Array, length: int, ns: int, nm: int, ni: int, nq: int) -> None:
    """What the known force does to motions and sites within a step; to be called when it has changed."""
    n2 = 2 * nm
    rows = 4 * n2 + ni * n2
    y = 6 * n2
    sites = y + 9 * ni
    count = ns & 0xFFFF
    times_state(s, k, rows, nq, length, n2, 2 * n2, y + 2 * ni)
    times_state(s, k, rows + 2 * ni * n2 + 2 * ni * ni, count, length, n2, 2 * n2, sites + count)


@inlined
def remember_forces(s: Array, forces: Array, at: int, nm: int, ni: int) -> None:
    """Take the new interface forces, forces[at : at + ni], into their history."""
    g = 12 * nm + 6 * ni
    for i in range(ni):
        s[g + 2 * ni + i] = s[g + ni + i]
        s[g + ni + i] = s[g + i]
        s[g + i] = forces[at + i]


@inlined
def correct(s: Array, k: Array, forces: Array, at: int, nm: int, ni: int) -> None:
    """The mode coordinates and the force on them with the new interface forces."""
    n2 = 2 * nm
    left = 4 * n2
    for m in range(n2):
        force = s[2 * n2 + m]
        for i in range(ni):
            force += k[left + i * n2 + m] * forces[at + i]
        s[m] = s[n2 + m] + force
        s[3 * n2 + m] = force


@inlined
def predict(s: Array, k: Array, nm: int) -> None:
    """Mode coordinates at the next instant without its forces."""
    n2 = 2 * nm
    for m in range(nm):
        follow(s, k, m, nm, s[m], s[nm + m], s[3 * n2 + m], s[3 * n2 + nm + m])


@inlined
def advance(s: Array, k: Array, forces: Array, at: int, nm: int, ni: int) -> None:
    """`correct` and `predict` in one pass; the force on the modes is not kept."""
    n2 = 2 * nm
    left = 4 * n2
    for m in range(nm):
        fr = s[2 * n2 + m]
        fi = s[2 * n2 + nm + m]
        for i in range(ni):
            fr += k[left + i * n2 + m] * forces[at + i]
            fi += k[left + i * n2 + nm + m] * forces[at + i]
        zr = s[n2 + m] + fr
        zi = s[n2 + nm + m] + fi
        s[m] = zr
        s[nm + m] = zi
        follow(s, k, m, nm, zr, zi, fr, fi)


@inlined
def follow(s: Array, k: Array, m: int, nm: int, zr: float, zi: float, fr: float, fi: float) -> None:
    """p, u and v of a mode at the next instant."""
    n2 = 2 * nm
    real = s[4 * n2 + m] + (k[m] * zr - k[nm + m] * zi)
    imag = s[4 * n2 + nm + m] + (k[m] * zi + k[nm + m] * zr)
    s[n2 + m] = real + (k[n2 + m] * fr - k[n2 + nm + m] * fi)
    s[n2 + nm + m] = imag + (k[n2 + m] * fi + k[n2 + nm + m] * fr)
    s[4 * n2 + m] = s[5 * n2 + m] + (k[2 * n2 + m] * fr - k[2 * n2 + nm + m] * fi)
    s[4 * n2 + nm + m] = s[5 * n2 + nm + m] + (k[2 * n2 + m] * fi + k[2 * n2 + nm + m] * fr)
    s[5 * n2 + m] = k[3 * n2 + m] * fr - k[3 * n2 + nm + m] * fi
    s[5 * n2 + nm + m] = k[3 * n2 + m] * fi + k[3 * n2 + nm + m] * fr


@inlined
def site_accelerations(
    s: Array, k: Array, length: int, known: Array, index: Indices, out: Array, column: int, nm: int, ni: int
) -> None:
    """Accelerations of the sites from the equation of motion, added to out[index, column].

    They follow from p, the new interface forces and `known`, what the known inputs give directly.
    """
    n2 = 2 * nm
    ns = known.size & 0xFFFF
    rows = 4 * n2 + 3 * ni * n2 + 2 * ni * ni
    comp = rows + ns * n2
    g = 6 * n2 + 6 * ni
    y = g + 3 * ni
    times_state(s, k, rows, ns, length, n2, n2, y)
    for i in range(ns):
        total = s[y + i] + s[y + ns + i] + known[i]
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
