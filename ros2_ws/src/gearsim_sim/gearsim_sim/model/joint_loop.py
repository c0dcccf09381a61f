"""Loose feet and side oscillators in the compiled loop; the readable twins are `LooseFoot`, `SideOscillator`.

Their forces come last in a step: displacements and rates of their directions are known from the predicted
modes and the new forces of the interfaces. Feet take their own new force from its extrapolation;
oscillators are linear, so theirs are solved for.
"""

from __future__ import annotations

import math

from gearsim_sim.integrate.carrier_kernel import (
    Carrier,
    free_motion,
    known_forces_at,
    mode_without_force,
    structure_force,
)
from gearsim_sim.integrate.compiled import apart, embedded
from gearsim_sim.integrate.pieces import ramp
from gearsim_sim.model.loop_data import SEVERITY_COLUMNS, Array
from gearsim_sim.model.side_data import Side

_FOOT, _OSC = SEVERITY_COLUMNS, SEVERITY_COLUMNS
# Rows of Side.now.
FORCE, KNOWN, PLACE, RATE = 0, 1, 2, 3


@embedded
def severity_of(row: Array, step: int) -> float:
    """Severity of a row of a table at a step."""
    rise, _, _ = ramp(float(step) - row[2], row[3])
    value: float = row[0] + (row[1] - row[0]) * rise
    return value


@embedded
def extrapolated(state: Array, at: int) -> float:
    """The next of three equally spaced values, newest first, by a parabola."""
    value: float = 3.0 * (state[at] - state[at + 1]) + state[at + 2]
    return value


@embedded
def remember(state: Array, at: int, value: float) -> None:
    """Put the newest of three values."""
    state[at + 2] = state[at + 1]
    state[at + 1] = state[at]
    state[at] = value


@embedded
def rounded_corner(x: float, width: float) -> tuple[float, float]:
    """max(x, 0) with a corner rounded over +-width, and its slope."""
    if x <= -width:
        return 0.0, 0.0
    if x >= width:
        return x, 1.0
    t = x + width
    return t * t / (4.0 * width), t / (2.0 * width)


@embedded
def foot_force(row: Array, step: int, y: float, rate: float) -> float:
    """Force of a loose foot beyond the linear base."""
    share: float = -math.expm1(severity_of(row, step) * row[_FOOT + 3])
    x = y - row[_FOOT + 4]
    first, opened = rounded_corner(x, row[_FOOT + 6])
    last, stopped = rounded_corner(x - row[_FOOT + 5], row[_FOOT + 6])
    spring = row[_FOOT + 1] * (first - last)
    force: float = share * (spring + row[_FOOT + 2] * (opened - stopped) * rate)
    return force


@apart
def guess_forces(side: Side, q: Array, rates: Array, sc: Array, nc: int, ic: int) -> None:
    """Extrapolated forces of feet and oscillators into `Side.now`, and what they do to the interfaces.

    `sc`, of a structure of `nc` modes and `ic` interfaces, is empty if bearings stand on the ground.
    """
    now = side.now
    for d in range(now.shape[1]):
        now[FORCE, d] = 0.0
        now[PLACE, d] = 0.0
        now[RATE, d] = 0.0
    feet = side.feet.shape[0]
    for j in range(feet):
        now[FORCE, int(side.feet[j, _FOOT])] += extrapolated(side.state[j], 0)
    for j in range(side.oscillators.shape[0]):
        for i in range(2):
            d = int(side.oscillators[j, _OSC + i])
            if d >= 0:
                now[FORCE, d] += extrapolated(side.state[feet + j], 5 + 3 * i)
    for d in range(now.shape[1]):
        force = now[FORCE, d]
        if force != 0.0:
            for i in range(q.size):
                q[i] += side.motions[d, i] * force
                rates[i] += side.motions[d, q.size + i] * force
            for i in range(ic):
                sc[free_motion(nc, ic) + i] += side.structure_motions[d, i] * force


@embedded
def places(side: Side, s: Array, start: int, n2: int) -> None:
    """Add what the predicted modes of a part say of displacements and rates of the directions."""
    for d in range(side.now.shape[1]):
        place = 0.0
        rate = 0.0
        for m in range(n2):
            predicted = s[n2 + m] + s[2 * n2 + m]
            place += side.rows[d, start + m] * predicted
            rate += side.rate_rows[d, start + m] * predicted
        side.now[PLACE, d] += place
        side.now[RATE, d] += rate


@apart
def carried_places(side: Side, s: Array, carrier: Carrier, nc: int, ni: int) -> None:
    """What the predicted modes of a structure and the forces on it say of the directions; goes first."""
    now, w = side.now, carrier.state_weights
    for d in range(now.shape[1]):
        place, rate = side.structure_known[0, d], side.structure_known[1, d]
        for i in range(ni):
            force = structure_force(s, i, nc)
            place += side.structure_motions[d, i] * force
            rate += side.structure_rates[d, i] * force
        for m in range(nc):
            zr, zi = mode_without_force(s, w, m, nc)
            place += side.structure_rows[d, m] * zi
            rate += side.structure_rows[d, m] * (carrier.poles[m] * zi + carrier.poles[nc + m] * zr)
        now[PLACE, d] = place
        now[RATE, d] = rate


@apart
def push_carried(side: Side, s: Array, carrier: Carrier, nc: int) -> None:
    """The new forces of `Side.now` into the known forces on the modes of a structure."""
    known = known_forces_at(nc)
    for m in range(nc):
        s[known + m] = carrier.known[m]
    for d in range(side.now.shape[1]):
        force = side.now[FORCE, d]
        if force != 0.0:
            for m in range(nc):
                s[known + m] += side.structure_rows[d, m] * force


@embedded
def place_of(side: Side, d: int) -> tuple[float, float]:
    """Displacement and rate of a direction under all forces of `Side.now`."""
    place, rate = side.now[PLACE, d], side.now[RATE, d]
    for e in range(side.now.shape[1]):
        place += side.own[d, e] * side.now[FORCE, e]
        rate += side.own_rate[d, e] * side.now[FORCE, e]
    return place, rate


@embedded
def advance_oscillator(side: Side, j: int, step: int) -> None:
    """New motion of an oscillator and its new forces, in place of the extrapolated ones."""
    row, pole, state = side.oscillators[j], side.poles[j], side.state[side.feet.shape[0] + j]
    a, b = int(row[_OSC]), int(row[_OSC + 1])
    count = 1 if b < 0 else 2
    b = a if b < 0 else b
    w, zeta = row[_OSC + 3], row[_OSC + 4]
    stiff, damp = w * w, 2.0 * zeta * w
    side.now[FORCE, a] -= extrapolated(state, 5)
    side.now[FORCE, b] -= extrapolated(state, 8)
    xa, va = place_of(side, a)
    xb, vb = place_of(side, b)
    la, lb = stiff * xa + damp * va, stiff * xb + damp * vb
    real = pole[0] * state[0] - pole[1] * state[1]
    imag = pole[0] * state[1] + pole[1] * state[0]
    for i in range(3):
        real += pole[4 + 2 * i] * state[2 + i]
        imag += pole[5 + 2 * i] * state[2 + i]
    wd = w * math.sqrt(1.0 - zeta * zeta)
    pull = (stiff * imag + damp * (wd * real - zeta * w * imag)) / wd
    gain = (stiff * pole[3] + damp * (wd * pole[2] - zeta * w * pole[3])) / wd
    kappa = severity_of(row, step) * row[_OSC + 2] / count
    gaa = stiff * side.own[a, a] + damp * side.own_rate[a, a]
    gab = stiff * side.own[a, b] + damp * side.own_rate[a, b]
    gba = stiff * side.own[b, a] + damp * side.own_rate[b, a]
    gbb = stiff * side.own[b, b] + damp * side.own_rate[b, b]
    if count == 1:
        fa = kappa * (pull + (gain - 1.0) * la) / (1.0 + kappa * (1.0 - gain) * gaa)
        fb = 0.0
        drive = la + gaa * fa
    else:
        half = 0.5 * gain
        ra = kappa * (pull + half * (la + lb) - la)
        rb = kappa * (pull + half * (la + lb) - lb)
        maa = 1.0 + kappa * (gaa - half * (gaa + gba))
        mab = kappa * (gab - half * (gab + gbb))
        mba = kappa * (gba - half * (gaa + gba))
        mbb = 1.0 + kappa * (gbb - half * (gab + gbb))
        whole = maa * mbb - mab * mba
        fa = (ra * mbb - mab * rb) / whole
        fb = (maa * rb - mba * ra) / whole
        drive = 0.5 * (la + lb + (gaa + gba) * fa + (gab + gbb) * fb)
    state[0] = real + pole[2] * drive
    state[1] = imag + pole[3] * drive
    remember(state, 2, drive)
    remember(state, 5, fa)
    remember(state, 8, fb)
    side.now[FORCE, a] += fa
    side.now[FORCE, b] += fb


@apart
def joint_forces(
    step: int, side: Side, forces: Array, s0: Array, s1: Array, n0: int, n1: int, accel: Array, column: int
) -> None:
    """New forces of feet and oscillators, and what they do to modes and sites; n0, n1: 2 nm of the parts.

    `Side.now` has what a carrying structure says of the directions (`carried_places`), else zeros.
    """
    now = side.now
    for d in range(now.shape[1]):
        for i in range(forces.size):
            now[PLACE, d] += side.back[d, i] * forces[i]
            now[RATE, d] += side.back_rate[d, i] * forces[i]
    places(side, s0, 0, n0)
    places(side, s1, n0, n1)
    for j in range(side.feet.shape[0]):
        d = int(side.feet[j, _FOOT])
        y, rate = place_of(side, d)
        new = foot_force(side.feet[j], step, y, rate)
        now[FORCE, d] += new - extrapolated(side.state[j], 0)
        remember(side.state[j], 0, new)
    for j in range(side.oscillators.shape[0]):
        advance_oscillator(side, j, step)
    for d in range(now.shape[1]):
        force = now[FORCE, d]
        if force != 0.0:
            for m in range(n0):
                s0[m] += side.step[d, m] * force
                s0[3 * n0 + m] += side.step[d, m] * force
            for m in range(n1):
                s1[m] += side.step[d, n0 + m] * force
                s1[3 * n1 + m] += side.step[d, n0 + m] * force
        for i in range(accel.shape[0]):
            accel[i, column] += side.site_full[d, i] * force + side.site_known[d, i] * now[KNOWN, d]
