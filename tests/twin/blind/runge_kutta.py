"""The generator's integrator: classical Runge-Kutta of fourth order on displacements and rates.

The product's engine propagates modes by exponentials with forces kept from earlier steps. Here nothing is
remembered: the forces are worked out four times a step, at its ends and in its middle, from what `prescribed`
says of angles at half steps. y = (x, x'), interfaces q = W^T x, and

    x'' = -M^-1 (K x + C x') + M^-1 W g(q, q', t) + M^-1 F f(t).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from blind.compiled import compiled

Array = NDArray[np.float64]
Indices = NDArray[np.int64]


class Constants(NamedTuple):
    """Of a machine; n degrees of freedom, I interfaces."""

    linear: Array  # (n, 2 n): -M^-1 (K, C)
    motion: Array  # (2 I, 2 n): from y to q and q'
    enter: Array  # (n, I): M^-1 W
    sites: Array  # (rows, n)
    bearing_places: Indices  # (bearings, 3): interfaces in x and y, number of balls
    bearing_numbers: Array  # (bearings, 4): load factor, exponent, clearance, linear stiffness
    azimuths: Array  # (bearings, balls) [rad]
    mesh_places: Indices  # (meshes,) interface
    mesh_numbers: Array  # (meshes, 4): mean stiffness, damping, backlash, lead gap
    feet: Array  # (feet, 2 n + 6): M^-1 direction | direction | stiffness, damping, share, opens, gap, round


class Prescribed(NamedTuple):
    """What depends on time alone, at half steps: 2 N + 1 of them for N steps."""

    cages: Array  # (half steps, bearings) [rad]
    missing: Array  # (half steps, bearings, balls) [m], or no half steps if nothing is missing
    meshes: Array  # (half steps, meshes, 3): stiffness, error, rate of the error
    known: Array  # (half steps, n): M^-1 F f


@compiled
def contact(gap: float, exponent: float) -> float:
    """gap^exponent for what is pressed together."""
    if gap <= 0.0:
        return 0.0
    if exponent == 1.5:
        return gap * math.sqrt(gap)
    return gap**exponent


@compiled
def flank(depth: float, stiffness: float, gap: float) -> tuple[float, float]:
    """Part of the face that touches, and force, of flanks with a wedge-shaped gap between them."""
    if depth <= 0.0:
        return 0.0, 0.0
    if depth < gap:
        return depth / gap, 0.5 * stiffness * depth * depth / gap
    return 1.0, stiffness * (depth - 0.5 * gap)


@compiled
def tooth_force(d: float, rate: float, stiffness: float, damping: float, play: float, gap: float) -> float:
    """Force of teeth that can part; dampers never pull."""
    if play == 0.0 and gap == 0.0:
        return stiffness * d + damping * rate
    sense = 1.0 if d > 0.0 else -1.0
    depth = d if d > 0.0 else -d - play
    touching, elastic = flank(depth, stiffness, gap)
    damper = damping * touching * sense * rate
    if play > 0.0:
        damper = max(-elastic, min(elastic, damper))
    return sense * (elastic + damper)


@compiled
def corner(x: float, width: float) -> tuple[float, float]:
    """max(x, 0) rounded over +-width, and its slope."""
    if x <= -width:
        return 0.0, 0.0
    if x >= width:
        return x, 1.0
    t = x + width
    return t * t / (4.0 * width), t / (2.0 * width)


@compiled
def foot_force(row: Array, at: int, lift: float, rate: float) -> float:
    """What a loose foot does beyond a tight one."""
    first, opened = corner(lift - row[at + 3], row[at + 5])
    last, stopped = corner(lift - row[at + 3] - row[at + 4], row[at + 5])
    force: float = row[at + 2] * (row[at] * (first - last) + row[at + 1] * (opened - stopped) * rate)
    return force


@compiled
def acceleration(h: int, y: Array, machine: Constants, given: Prescribed, q: Array, out: Array) -> None:
    """x'' at a half step into `out`; `q` is work space (2 I)."""
    n, count = machine.linear.shape[0], machine.enter.shape[1]
    for i in range(2 * count):
        total = 0.0
        for j in range(2 * n):
            total += machine.motion[i, j] * y[j]
        q[i] = total
    for i in range(n):
        total = given.known[h, i]
        for j in range(2 * n):
            total += machine.linear[i, j] * y[j]
        out[i] = total
    for b in range(machine.bearing_places.shape[0]):
        ix, iy, balls = machine.bearing_places[b]
        factor, exponent, clearance, stiffness = machine.bearing_numbers[b]
        x, z, cage = q[ix], q[iy], given.cages[h, b]
        cc, cs = math.cos(cage), math.sin(cage)
        fx, fz = stiffness * x, stiffness * z
        for k in range(balls):
            ac, az = machine.azimuths[b, 2 * k], machine.azimuths[b, 2 * k + 1]
            c, s = ac * cc - az * cs, ac * cs + az * cc
            gap = x * c + z * s - clearance
            if given.missing.shape[0] > 0:
                gap -= given.missing[h, b, k]
            force = factor * contact(gap, exponent)
            fx -= force * c
            fz -= force * s
        for i in range(n):
            out[i] += machine.enter[i, ix] * fx + machine.enter[i, iy] * fz
    for m in range(machine.mesh_places.size):
        at = machine.mesh_places[m]
        mean, damping, play, gap = machine.mesh_numbers[m]
        stiffness, error, slope = given.meshes[h, m]
        linear = mean * q[at] + damping * q[count + at]
        force = linear - tooth_force(q[at] + error, q[count + at] + slope, stiffness, damping, play, gap)
        for i in range(n):
            out[i] += machine.enter[i, at] * force
    for f in range(machine.feet.shape[0]):
        row = machine.feet[f]
        lift, rate = 0.0, 0.0
        for j in range(n):
            lift += row[n + j] * y[j]
            rate += row[n + j] * y[n + j]
        force = foot_force(row, 2 * n, lift, rate)
        for i in range(n):
            out[i] += row[i] * force


@compiled
def integrate(y: Array, machine: Constants, given: Prescribed, step_s: float, out: Array) -> None:
    """Advance y by the steps of `out` (site rows, steps), which gets the accelerations where each begins."""
    n = machine.linear.shape[0]
    q, stage = np.zeros(2 * machine.enter.shape[1]), np.zeros(2 * n)
    k = np.zeros((4, 2 * n))
    for step in range(out.shape[1]):
        for part in range(4):
            h = 2 * step + (part + 1) // 2
            ahead = (0.0, 0.5, 0.5, 1.0)[part] * step_s
            for j in range(2 * n):
                stage[j] = y[j] + (ahead * k[part - 1, j] if part > 0 else 0.0)
            acceleration(h, stage, machine, given, q, k[part, n:])
            k[part, :n] = stage[n:]
            if part == 0:
                for r in range(machine.sites.shape[0]):
                    total = 0.0
                    for i in range(n):
                        total += machine.sites[r, i] * k[0, n + i]
                    out[r, step] = total
        for j in range(2 * n):
            y[j] += step_s / 6.0 * (k[0, j] + 2.0 * (k[1, j] + k[2, j]) + k[3, j])
