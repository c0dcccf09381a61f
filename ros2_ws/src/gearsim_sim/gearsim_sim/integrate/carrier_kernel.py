"""One step of the cubic exponential scheme for a structure in its own real modes.

A casing on its mounts, with modal damping, falls apart into oscillators that only the forces of the bearings
join to the rest. Each obeys q'' + 2 zeta w q' + w^2 q = f, that is z' = lambda z + f with real f, upper pole
lambda, and q = Im(z) / w_d. Three things make a step several times cheaper than in `kernel`:

- f is real and q needs one part of z, so that one real row of shapes serves both as force and as motion;
- the sum over the old forces is divided by the pole (x delays by a step, E = e^{lambda h}):

      (c_0 + c_1 x + c_2 x^2 + c_3 x^3) / (1 - E x) = d_0 + d_1 x + d_2 x^2 + r / (1 - E x),

  exactly; w_{n+1} = E w_n + r f_{n+1} is all that a mode has to carry on, and z_n = w_n + d_0 f_n
  + d_1 f_{n-1} + d_2 f_{n-2};
- accelerations are worked out once for each mode, so that a site costs one product more.

The loop calls `carrier_motion`, then its force functions, then `carry_forces`, `carrier_accelerations` and
`carrier_advance`. What the structure carries may turn against it: then forces and motions of a pair of its
interfaces are turned on their way, see `model.carrier`. Sizes `nc` (modes, a multiple of LANES) and `ni`
(interfaces) are compile-time constants; the number of sites may vary. Layout, in units of doubles (modes are
padded with zeros):

    k: E 2nc | r 2nc | Im d_1 nc | Im d_2 nc | acceleration of z 2nc, of d_1 and d_2 2nc
       | shapes ni nc | shapes of sites ns nc
       | within a step: motion per force ni ni, by known forces ni, sites per force ns ni, by known forces ns
    s: E w 2nc | f now and before 2nc | known f nc | q without new forces nc | the same of q'' nc
       | now: forces ni, motion ni (seen from what it carries), damper against the frame ni
       | motion without new forces ni
       | forces, the last three 3 ni | motion of the structure, the last four 4 ni | of what it carries 4 ni
       | work space ni | accelerations ns
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.coefficients import cubic_weights, padded
from gearsim_sim.integrate.compiled import inlined
from gearsim_sim.integrate.kernel import times_state
from gearsim_sim.integrate.pieces import cosine_sine

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Complex = NDArray[np.complex128]
# Rows of modes before the shapes in `k`, and before the motion in `s`.
_CONSTANT_ROWS, _STATE_ROWS = 10, 7


class Oscillators(NamedTuple):
    """Modes of a structure, and where its interfaces and sites feel them."""

    omega: Array  # (m,) [rad/s], all above zero
    damping_ratios: Array  # (m,) of critical, below one
    shapes: Array  # (interfaces, m) of unit modal mass
    sites: Array  # (sites, m)
    known: Array  # (m,) constant modal forces


class Carrier(NamedTuple):
    """Constants of a carrying structure in the loop; `k` is empty without one."""

    k: Array
    places: Indices  # (ni,) interface of the loop that each of its own is
    bare: Indices  # interfaces of the loop among them at which no element acts but the linear ones
    turning: Indices  # (pairs, 2) turning pairs: place of x among its own interfaces, track
    numbers: Array  # (2, ni) linear stiffness and damping of the elements there
    site_index: Indices  # (ns,) output row that each site adds to
    force_index: Indices  # (ni,) output row of the force on the structure, or none at all
    per_slope: float  # 1 / (12 h)
    state_rows: Array  # (rows, 2 nc) outputs of q and q' at the output samples
    state_weights: Array  # (6 nc,) c_0, d_1, d_2 that these need, real parts, then imaginary parts
    poles: Array  # (2 nc,)
    known: Array  # (nc,) constant modal forces


def nothing_carried() -> Carrier:
    """That of a machine on the ground."""
    none = np.zeros(0, dtype=np.int64)
    empty = np.zeros(0)
    pairs = np.zeros((0, 2), dtype=np.int64)
    numbers, rows = np.zeros((2, 0)), np.zeros((0, 0))
    return Carrier(empty, none, none, pairs, numbers, none, none, 0.0, rows, empty, empty, empty)


class Weights(NamedTuple):
    """The scheme's numbers for each mode, over w_d so that q is an imaginary part; all (m,)."""

    rate: Complex  # lambda
    decay: Complex  # E
    first: Complex  # c_0
    gain: Complex  # r
    now: Complex  # d_0
    before: Complex  # d_1
    earlier: Complex  # d_2


def oscillator_weights(omega: Array, damping_ratios: Array, step_s: float) -> Weights:
    """Poles of the oscillators and the division of their weights by them."""
    own = omega * np.sqrt(1 - damping_ratios**2)
    rate = -damping_ratios * omega + 1j * own
    c = cubic_weights(rate, step_s) / own
    decay = np.exp(rate * step_s)
    earlier = -c[3] / decay
    before = (earlier - c[2]) / decay
    now = (before - c[1]) / decay
    return Weights(rate, decay, c[0], c[0] - now, now, before, earlier)


def pack_carrier(of: Oscillators, step_s: float) -> Array:
    """The array `k`."""
    modes, w = padded(of.omega.size), oscillator_weights(of.omega, of.damping_ratios, step_s)
    square = w.rate**2
    rows = [
        w.decay.real, w.decay.imag, w.gain.real, w.gain.imag, w.before.imag, w.earlier.imag,
        square.imag, square.real, (square * w.before).imag, (square * w.earlier).imag,
        *of.shapes, *of.sites,
    ]  # fmt: skip
    packed = np.zeros((len(rows), modes))
    packed[:, : of.omega.size] = rows
    motion = of.shapes * w.first.imag
    push = of.sites * ((square * w.first).imag + 1.0)  # q'' = Im(lambda^2 z) + f
    small = (motion @ of.shapes.T, motion @ of.known, push @ of.shapes.T, push @ of.known)
    return np.concatenate([packed.ravel(), *(np.ravel(one) for one in small)])


def pack_carrier_state(
    of: Oscillators, step_s: float, position: Array, forces: Array, seen: Array, carried: Array
) -> Array:
    """The array `s` for a start from rest.

    Parameters
    ----------
    position : ndarray, shape (m,)
        Modal coordinates.
    forces : ndarray, shape (interfaces,)
        On the structure, as they have been for long.
    seen : ndarray, shape (interfaces,)
        Motion of the structure in the axes of what it carries.
    carried : ndarray, shape (interfaces,)
        Motion of what it carries.
    """
    modes, w = padded(of.omega.size), oscillator_weights(of.omega, of.damping_ratios, step_s)
    force = of.shapes.T @ forces + of.known
    z = position * of.damping_ratios / np.sqrt(1 - of.damping_ratios**2) + 1j * position
    rest = w.decay * (z - (w.now + w.before + w.earlier) * force)
    ahead = rest + (w.before + w.earlier) * force
    moved = (w.rate**2 * ahead).imag
    rows = np.zeros((_STATE_ROWS, modes))
    rows[:, : of.omega.size] = [rest.real, rest.imag, force, force, of.known, ahead.imag, moved]
    parts = [rows, forces, seen, np.zeros_like(seen), of.shapes @ ahead.imag]
    parts += [np.tile(forces, 3), np.tile(seen, 4), np.tile(carried, 4), np.zeros_like(seen)]
    parts.append(of.sites @ moved)
    return np.concatenate([np.ravel(one) for one in parts])


@inlined
def turn(s: Array, at: int, carrier: Carrier, phases: Array, circle: Array, sense: float) -> None:
    """Turn the pairs among numbers of the interfaces, s[at:]: sense 1 into the structure's axes, -1 back."""
    for j in range(carrier.turning.shape[0]):
        x = at + carrier.turning[j, 0]
        c, sine = cosine_sine(phases[carrier.turning[j, 1]], circle)
        own = sense * sine
        first, second = s[x], s[x + 1]
        s[x] = c * first - own * second
        s[x + 1] = own * first + c * second


@inlined
def carrier_motion(
    s: Array, carrier: Carrier, q: Array, forces: Array, phases: Array, circle: Array, nc: int, ni: int
) -> None:
    """Take the motion of the structure from that of the interfaces, q, with extrapolated forces."""
    k = carrier.k
    comp = (_CONSTANT_ROWS + ni + (carrier.site_index.size & 0xFFFF)) * nc
    now = _STATE_ROWS * nc
    g = now + 4 * ni
    for i in range(ni):
        s[now + i] = 3.0 * (s[g + i] - s[g + ni + i]) + s[g + 2 * ni + i]
        s[now + ni + i] = s[now + 3 * ni + i] + k[comp + ni * ni + i]
    for j in range(ni):
        guess = s[now + j]
        for i in range(ni):
            s[now + ni + i] += k[comp + j * ni + i] * guess
    turn(s, now + ni, carrier, phases, circle, -1.0)
    for i in range(ni):
        q[carrier.places[i]] -= s[now + ni + i]
    for i in range(carrier.bare.size):
        forces[carrier.bare[i]] = 0.0


@inlined
def slope(s: Array, past: int, newest: float, i: int, ni: int, per_slope: float) -> float:
    """Rate of change of a motion i whose last four values stand `ni` apart from s[past] on; takes it in."""
    at = past + i
    first, second, third, fourth = s[at], s[at + ni], s[at + 2 * ni], s[at + 3 * ni]
    s[at] = newest
    s[at + ni] = first
    s[at + 2 * ni] = second
    s[at + 3 * ni] = third
    rate: float = (25.0 * newest - 48.0 * first + 36.0 * second - 16.0 * third + 3.0 * fourth) * per_slope
    return rate


@inlined
def carry_forces(
    s: Array, carrier: Carrier, q: Array, forces: Array, phases: Array, circle: Array, nc: int, ni: int
) -> None:
    """Forces on the structure; and to `forces` of what it carries, how its motion changes them.

    What it carries has the linear part of the elements between the two in its own equations, against the
    ground: there the ring's motion p is missing, k p + c p'. q is the motion between the two.
    """
    now = _STATE_ROWS * nc
    g = now + 4 * ni
    past = g + 3 * ni
    bent = past + 8 * ni
    for i in range(ni):
        j = carrier.places[i]
        s[bent + i] = q[j]
        s[now + i] = forces[j]
    for i in range(ni):
        p, x = s[now + ni + i], s[bent + i]
        stiffness, damping = carrier.numbers[0, i], carrier.numbers[1, i]
        own = damping * slope(s, past, p, i, ni, carrier.per_slope)
        other = damping * slope(s, past + 4 * ni, x + p, i, ni, carrier.per_slope)
        deviation = s[now + i]
        total = stiffness * x - deviation + other - own
        s[bent + i] = deviation + stiffness * p + own
        s[now + i] = total
        s[now + 2 * ni + i] = own
    turn(s, now, carrier, phases, circle, 1.0)
    for i in range(ni):
        s[g + 2 * ni + i] = s[g + ni + i]
        s[g + ni + i] = s[g + i]
        s[g + i] = s[now + i]
        forces[carrier.places[i]] = s[bent + i]


@inlined
def carrier_accelerations(s: Array, carrier: Carrier, accel: Array, column: int, nc: int, ni: int) -> None:
    """Accelerations of the structure's sites, and the forces on it if they are asked for."""
    k = carrier.k
    ns = carrier.site_index.size & 0xFFFF
    known = (_CONSTANT_ROWS + ni + ns) * nc + ni * ni + ni
    now = _STATE_ROWS * nc
    y = now + 16 * ni
    for i in range(ns):
        total = s[y + i] + k[known + ns * ni + i]
        for j in range(ni):
            total += k[known + i * ni + j] * s[now + j]
        accel[carrier.site_index[i], column] += total
    for i in range(carrier.force_index.size):
        accel[carrier.force_index[i], column] = s[now + i]


@inlined
def enter_forces(s: Array, k: Array, nc: int, ni: int) -> None:
    """Forces on the modes into s[5 nc:], four interfaces at a time."""
    now = _STATE_ROWS * nc
    for m in range(nc):
        s[5 * nc + m] = s[4 * nc + m]
    for j in range(ni // 4):
        i = 4 * j
        r = (_CONSTANT_ROWS + i) * nc
        g0, g1, g2, g3 = s[now + i], s[now + i + 1], s[now + i + 2], s[now + i + 3]
        for m in range(nc):
            s[5 * nc + m] += (k[r + m] * g0 + k[r + nc + m] * g1) + (
                k[r + 2 * nc + m] * g2 + k[r + 3 * nc + m] * g3
            )
    for i in range(ni // 4 * 4, ni - 1, 2):
        r = (_CONSTANT_ROWS + i) * nc
        g0, g1 = s[now + i], s[now + i + 1]
        for m in range(nc):
            s[5 * nc + m] += k[r + m] * g0 + k[r + nc + m] * g1
    for i in range(ni // 2 * 2, ni):
        r = (_CONSTANT_ROWS + i) * nc
        g0 = s[now + i]
        for m in range(nc):
            s[5 * nc + m] += k[r + m] * g0


@inlined
def carrier_advance(s: Array, carrier: Carrier, length: int, nc: int, ni: int) -> None:
    """All modes a step on, under the forces on the structure; `length` is nc, see `kernel.times_state`."""
    k = carrier.k
    ns = carrier.site_index.size & 0xFFFF
    now = _STATE_ROWS * nc
    enter_forces(s, k, nc, ni)
    for m in range(nc):
        f = s[5 * nc + m]
        before = s[2 * nc + m]
        wr = s[m] + k[2 * nc + m] * f
        wi = s[nc + m] + k[3 * nc + m] * f
        vr = k[m] * wr - k[nc + m] * wi
        vi = k[m] * wi + k[nc + m] * wr
        s[m] = vr
        s[nc + m] = vi
        s[2 * nc + m] = f
        s[3 * nc + m] = before
        s[5 * nc + m] = vi + k[4 * nc + m] * f + k[5 * nc + m] * before
        s[6 * nc + m] = k[6 * nc + m] * vr + k[7 * nc + m] * vi + k[8 * nc + m] * f + k[9 * nc + m] * before
    times_state(s, k, _CONSTANT_ROWS * nc, ni, length, nc, 5 * nc, now + 3 * ni)
    times_state(s, k, (_CONSTANT_ROWS + ni) * nc, ns, length, nc, 6 * nc, now + 16 * ni)


@inlined
def free_motion(nc: int, ni: int) -> int:
    """Where in `s` the motion at the interfaces without new forces begins."""
    at: int = _STATE_ROWS * nc + 3 * ni
    return at


@inlined
def known_forces_at(nc: int) -> int:
    """Where in `s` the known forces on the modes begin."""
    at: int = 4 * nc
    return at


@inlined
def structure_force(s: Array, i: int, nc: int) -> float:
    """The new force on the structure at an interface."""
    force: float = s[_STATE_ROWS * nc + i]
    return force


@inlined
def mode_without_force(s: Array, w: Array, m: int, nc: int) -> tuple[float, float]:
    """Real and imaginary part of a mode's z without its new force, before `carrier_advance`."""
    zr = s[m] + w[nc + m] * s[2 * nc + m] + w[2 * nc + m] * s[3 * nc + m]
    zi = s[nc + m] + w[4 * nc + m] * s[2 * nc + m] + w[5 * nc + m] * s[3 * nc + m]
    return zr, zi


@inlined
def ring_motion(s: Array, i: int, nc: int, ni: int) -> float:
    """Motion of the structure at an interface."""
    motion: float = s[_STATE_ROWS * nc + ni + i]
    return motion


@inlined
def damper_force(s: Array, i: int, nc: int, ni: int) -> float:
    """What the structure's motion does through the damper of an interface."""
    force: float = s[_STATE_ROWS * nc + 2 * ni + i]
    return force


@inlined
def carrier_state(s: Array, carrier: Carrier, row: int, nc: int, ni: int) -> float:
    """A linear output of coordinates and rates, before `carrier_advance`; for few rows at few steps."""
    k, w = carrier.k, carrier.state_weights
    total = 0.0
    for m in range(nc):
        f = s[4 * nc + m]
        for i in range(ni):
            f += k[(_CONSTANT_ROWS + i) * nc + m] * s[_STATE_ROWS * nc + i]
        zr, zi = mode_without_force(s, w, m, nc)
        zr += w[m] * f
        zi += w[3 * nc + m] * f
        rate = carrier.poles[m] * zi + carrier.poles[nc + m] * zr
        total += carrier.state_rows[row, m] * zi + carrier.state_rows[row, nc + m] * rate
    return total
