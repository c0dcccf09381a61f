"""What faults enter before the forces of the bearings are worked out, in the compiled loop.

In `memory.missing` what surfaces lack under each ball; in `now` (bearings, NOW_COLUMNS) numbers of each
bearing at this step. Rows of severity zero enter nothing, so that they change no bit.
"""

from __future__ import annotations

import math

import numpy as np

from gearsim_sim.integrate.compiled import apart, embedded
from gearsim_sim.integrate.pieces import ramp, table_value
from gearsim_sim.model.loop_data import SEVERITY_COLUMNS, Array, BearingMemory, Bearings, Drive, Indices

_OWN = SEVERITY_COLUMNS  # a row's first column of its own
TWO_PI = 2.0 * math.pi
# Columns of `now`: added clearance, what cage and balls are ahead [turns], the oil film's thickness under
# 1 N and squeeze constants, flags for play in the pockets, entries in `missing`, and a cage that slips.
CLEARANCE, CAGE, SPIN, FILM, SQUEEZE, SQUEEZE_ROOT, PLAY, DIRTY, SLIPS = range(9)
NOW_COLUMNS = 9
# Columns of `BearingMemory.cage`: turns that cage and balls have fallen behind, way of the cage, mean force.
LAG, SPIN_LAG, WAY, MEAN_FORCE = range(4)
CAGE_COLUMNS = 4
JUMP_COLUMNS = 4
# Kinds of terms, as `bearing_faults.Term` numbers them.
_CLEARANCE, _SLIP, _CAGE_JITTER, _POCKET_PLAY, _FILM = range(5)
_BALL_STRIDE = 1 << 40  # of the knots between the random functions of neighbours
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S11, _S27, _S30, _S31 = np.uint64(11), np.uint64(27), np.uint64(30), np.uint64(31)


@embedded
def severity(row: Array, step: int) -> float:
    """Severity of a row of a table at a step."""
    rise, _, _ = ramp(float(step) - row[2], row[3])
    value: float = row[0] + (row[1] - row[0]) * rise
    return value


@embedded
def knot_value(key: int, knot: int) -> float:
    """See `cage_slip.knot_value`."""
    state = np.uint64(key) + np.uint64(knot + 1) * _GOLDEN
    state = (state ^ (state >> _S30)) * _MIX_1
    state = (state ^ (state >> _S27)) * _MIX_2
    value: float = float((state ^ (state >> _S31)) >> _S11) * 2.0**-52 - 1.0
    return value


@embedded
def jitter(key: int, position: float, first_knot: int) -> float:
    """See `cage_slip.jitter`; `first_knot` is that at position zero."""
    whole = math.floor(position)
    u = position - whole
    rise = u * u * u * (10.0 - u * (15.0 - 6.0 * u))
    knot = first_knot + int(whole)
    return knot_value(key, knot) * (1.0 - rise) + knot_value(key, knot + 1) * rise


@embedded
def rest_terms(memory: BearingMemory, now: Array) -> None:
    """`now` without faults: cages keep what they have fallen behind."""
    for b in range(now.shape[0]):
        for k in range(NOW_COLUMNS):
            now[b, k] = 0.0
        now[b, CAGE] = -memory.cage[b, LAG]
        now[b, SPIN] = -memory.cage[b, SPIN_LAG]


@embedded
def enter_slip(row: Array, level: float, way: float, cage: Array, cage_rate: float, spin_rate: float) -> None:
    """Let a cage and its balls fall behind the kinematic way of this step; `way` is the reference shaft's."""
    share = level * row[_OWN + 2] / (1.0 + cage[MEAN_FORCE] / row[_OWN + 3])
    if row[_OWN + 4] != 0.0:
        share *= 1.0 + row[_OWN + 4] * jitter(int(row[_OWN + 6]), cage[WAY] * row[_OWN + 5], 0)
    lag = cage[LAG] + share * cage_rate * way
    cage[LAG] = lag - math.floor(lag)
    lag = cage[SPIN_LAG] + share * spin_rate * way
    cage[SPIN_LAG] = lag - math.floor(lag)


@embedded
def enter_play(row: Array, level: float, way: float, play: Array) -> None:
    """Move balls within their pockets, each by a random function of its own [turns]."""
    for j in range(play.size):
        play[j] += level * row[_OWN + 2] * jitter(int(row[_OWN + 4]), way * row[_OWN + 3], j * _BALL_STRIDE)


@apart
def enter_terms(
    step: int,
    speed: float,
    step_s: float,
    drive: Drive,
    bearings: Bearings,
    memory: BearingMemory,
    now: Array,
) -> None:
    """What faults add to the numbers of the bearings at this step, into `now`."""
    rest_terms(memory, now)
    way = speed * step_s
    for j in range(drive.bearing_terms.shape[0]):
        row = drive.bearing_terms[j]
        b, what = int(row[_OWN]), int(row[_OWN + 1])
        level = severity(row, step)
        if level == 0.0:
            continue
        if what == _CLEARANCE:
            now[b, CLEARANCE] += level * row[_OWN + 2]
        elif what == _FILM:
            now[b, FILM] += level * row[_OWN + 2] * abs(speed) ** row[_OWN + 3]
            now[b, SQUEEZE] += level * row[_OWN + 4]
            now[b, SQUEEZE_ROOT] += level * row[_OWN + 5]
        else:
            now[b, SLIPS] = 1.0
            gone = memory.cage[b, WAY]
            if what == _SLIP:
                cage_rate, spin_rate = drive.rates[bearings.places[b, 2]], drive.rates[bearings.spins[b]]
                enter_slip(row, level, way, memory.cage[b], cage_rate, spin_rate)
            elif what == _CAGE_JITTER:
                now[b, CAGE] += level * row[_OWN + 2] * jitter(int(row[_OWN + 4]), gone * row[_OWN + 3], 0)
            else:
                if now[b, PLAY] == 0.0:
                    memory.play[b, :] = 0.0
                now[b, PLAY] = 1.0
                enter_play(row, level, gone, memory.play[b])
    for b in range(now.shape[0]):
        if now[b, SLIPS] != 0.0:
            memory.cage[b, WAY] += abs(drive.rates[bearings.places[b, 2]] * way)


@embedded
def turn_balls(b: int, bearings: Bearings, memory: BearingMemory) -> None:
    """Cosines and sines of the balls with their play in the pockets."""
    for j in range(memory.play.shape[1]):
        d = TWO_PI * memory.play[b, j]
        square = d * d
        c = 1.0 - square * (0.5 - square * (1.0 / 24.0))
        s = d * (1.0 - square * (1.0 / 6.0 - square * (1.0 / 120.0)))
        memory.cosines[b, j] = bearings.cosines[b, j] * c - bearings.sines[b, j] * s
        memory.sines[b, j] = bearings.sines[b, j] * c + bearings.cosines[b, j] * s


@embedded
def spall_place(
    row: Array, phases: Array, cage_ahead: float, spin_ahead: float, bearings: Bearings
) -> tuple[int, float]:
    """The ball nearest to a spall, and its distance from the middle of the pit [turns]."""
    b = int(row[_OWN])
    middle = row[_OWN + 5] + row[_OWN + 4] * phases[int(row[_OWN + 3])]
    ball = int(row[_OWN + 2])
    if ball >= 0:
        middle += spin_ahead
        away = middle - math.floor(middle + 0.5)
    else:
        count = bearings.balls_per_row[b]
        cage = phases[bearings.places[b, 2]] + cage_ahead
        place = (middle - cage - bearings.row_offsets[b, int(row[_OWN + 1])]) * count
        nearest = math.floor(place + 0.5)
        ball = int(row[_OWN + 1]) * count + int(nearest) % count
        away = (place - nearest) / count
    return ball, away


@embedded
def rounded_drop(away: float, row: Array) -> float:
    """See `pit.rounded_drop`."""
    past = row[_OWN + 6] - abs(away)
    if past <= 0.0:
        return 0.0
    carrier, other = row[_OWN + 8], row[_OWN + 9]
    chord = carrier * math.sin(past)
    half = math.sin(0.5 * past)
    own = other - math.sqrt(other * other - chord * chord)
    drop = row[_OWN + 11] * own + row[_OWN + 10] * 2.0 * carrier * half * half
    reached: float = min(row[_OWN + 7], drop)
    return reached


@embedded
def step_fraction(away: float, row: Array, way: float, drive: Drive, bearings: Bearings) -> float:
    """Part of this step in a rectangular pit, see `pit.inside_fraction`; `way` is the reference shaft's."""
    rate = row[_OWN + 4] * drive.rates[int(row[_OWN + 3])]
    if row[_OWN + 2] < 0.0:
        rate -= drive.rates[bearings.places[int(row[_OWN]), 2]]
    travel = abs(TWO_PI * rate * way)
    if travel == 0.0:
        return 1.0 if abs(away) < row[_OWN + 6] else 0.0
    first = max(away - 0.5 * travel, -row[_OWN + 6])
    last = min(away + 0.5 * travel, row[_OWN + 6])
    part: float = max(0.0, last - first) / travel
    return part


@apart
def enter_spalls(
    step: int, way: float, phases: Array, drive: Drive, bearings: Bearings, memory: BearingMemory, now: Array,
    jumps: Array,
) -> int:  # fmt: skip
    """What spalls take away under their nearest balls.

    Into `memory.missing`, or for rectangular pits into `jumps` (bearing, ball, depth, part of this step in
    the pit): their forces are averaged over the step. Returns the number of jumps.
    """
    found = 0
    for j in range(drive.spalls.shape[0]):
        row = drive.spalls[j]
        level = severity(row, step)
        if level == 0.0:
            continue
        b = int(row[_OWN])
        ball, away = spall_place(row, phases, now[b, CAGE], now[b, SPIN], bearings)
        if now[b, PLAY] != 0.0 and row[_OWN + 2] < 0.0:
            away -= memory.play[b, ball]
        away *= TWO_PI
        if row[_OWN + 12] == 0.0:
            drop = rounded_drop(away, row)
            if drop > 0.0:
                now[b, DIRTY] = 1.0
                memory.missing[b, ball] += level * drop
        else:
            part = step_fraction(away, row, way, drive, bearings)
            if part > 0.0:
                jumps[found, 0] = b
                jumps[found, 1] = ball
                jumps[found, 2] = level * row[_OWN + 7]
                jumps[found, 3] = part
                found += 1
    return found


@apart
def enter_profiles(
    step: int, phases: Array, drive: Drive, bearings: Bearings, memory: BearingMemory, now: Array
) -> None:
    """What shapes of races and balls take away, into `memory.missing`."""
    for j in range(drive.profiles.shape[0]):
        row = drive.profiles[j]
        level = severity(row, step)
        if level == 0.0:
            continue
        b, first, span = int(row[_OWN]), int(row[_OWN + 1]), row[_OWN + 7]
        offset, points = int(row[_OWN + 8]), int(row[_OWN + 9])
        turned = row[_OWN + 6] + row[_OWN + 4] * phases[int(row[_OWN + 3])]
        on_ball = row[_OWN + 5] != 0.0
        if not on_ball:
            turned -= phases[bearings.places[b, 2]] + now[b, CAGE]
        else:
            turned += now[b, SPIN]
        now[b, DIRTY] = 1.0
        for k in range(int(row[_OWN + 2])):
            ball = first + k
            at = turned
            if not on_ball:
                at = bearings.azimuths[b, ball] - turned
                if now[b, PLAY] != 0.0:
                    at += memory.play[b, ball]
            fraction = (at - math.floor(at)) / span
            if fraction < 1.0:
                value, _ = table_value(fraction, drive.samples, offset, points)
                memory.missing[b, ball] += level * value


@embedded
def place_spalls(
    step: int, phases: Array, drive: Drive, bearings: Bearings, missing: Array, touched: Indices
) -> None:
    """Enter rounded spalls under their balls into `missing`, for bearings that know nothing else.

    `touched` says where; rectangular pits are switched, not averaged.
    """
    for j in range(drive.spalls.shape[0]):
        row = drive.spalls[j]
        level = severity(row, step)
        ball, away = spall_place(row, phases, 0.0, 0.0, bearings)
        touched[j, 0] = int(row[_OWN])
        touched[j, 1] = ball
        if level != 0.0:
            away *= TWO_PI
            inside = row[_OWN + 12] != 0.0 and abs(away) < row[_OWN + 6]
            missing[int(row[_OWN]), ball] += level * (row[_OWN + 7] if inside else rounded_drop(away, row))
