"""Single teeth in the transmission error between the encoders of a gear pair.

A cracked tooth yields by a fraction of a micrometre more than the others while it carries load: next to
nothing at a bearing, but the driven wheel lags by it. What encoders see of that is coloured by the twist of
shafts and couplings, whose resonances ring on over many teeth. So the synchronous average over a wheel's
turn, without mesh lines, their first sidebands and the shaft's harmonics, goes through its own linear
prediction (Wang and Wong, J. Sound Vib. 254 (2002) 149-163, for vibration): the residual of it is short where
a tooth comes in and goes out, and noise elsewhere.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.interpolate import CubicSpline

from gearsim_dsp.judges.gear_signs import energy_by_angle, standing_tooth
from gearsim_dsp.judges.measured import Measured
from gearsim_dsp.separation.linear_prediction import ar_residual
from gearsim_dsp.speed import Phase
from gearsim_io.nameplate import GearMesh

__all__ = ["ToothError", "ToothEvent", "encoder_phases", "tooth_errors"]

Array = NDArray[np.float64]

_LEAST_LINES = 16.0  # of an encoder, below which it cannot say where within a turn the wheel is
_LEAST_TURNS = 10
_SHAFT_HARMONICS = 6
_SIDEBANDS = 2
_TOP_MESH = (3.0, 6.0)  # highest orders looked at, in mesh orders
_NEAR_TEETH = 2.5
_TINY = float(np.finfo(np.float64).tiny)
_LEAST_TOP = 1.2  # mesh orders
_SHARE_OF_LINES = 0.45  # of an encoder's lines: the highest order that it resolves


@dataclass(frozen=True, slots=True)
class ToothEvent:
    """What one tooth does in the transmission error.

    Parameters
    ----------
    place : float
        Angle of the wheel in turns.
    over_rest, over_median : float
        Energy of the residual at that tooth over that of the strongest other one, and over the median angle.
    log10_chance : float
        Logarithm of the probability that teeth as uneven as the others have one so far out.
    size_of_pitch : float
        Largest deviation there, over the tooth pitch.
    width_teeth : float
        Standard width of the event in tooth pitches.
    unevenness : float
        Root mean square of the residual without its strongest tenth, over the tooth pitch: all teeth.
    """

    place: float
    over_rest: float
    over_median: float
    log10_chance: float
    size_of_pitch: float
    width_teeth: float
    unevenness: float


@dataclass(frozen=True, slots=True)
class ToothError:
    """The tooth of a wheel that stands out most.

    Parameters
    ----------
    shaft : str
    teeth : int
        Of the wheel.
    turns : int
        Averaged.
    event : ToothEvent
        Its place by the angle that accelerations are averaged by.
    """

    shaft: str
    teeth: int
    turns: int
    event: ToothEvent


def encoder_phases(measured: Measured, mesh: GearMesh) -> tuple[Phase, Phase] | None:
    """Angles of the driving and the driven shaft from the edges of their encoders; None without both.

    A tacho says nothing within the turn.
    """
    found = []
    for shaft in (mesh.driving_shaft, mesh.driven_shaft):
        train = measured.encoders.get(shaft)
        if train is None or train.pulses_per_revolution < _LEAST_LINES or train.samples.size < 8:
            return None
        found.append(Phase(train.samples, np.arange(train.samples.size) / train.pulses_per_revolution))
    return found[0], found[1]


def tooth_errors(measured: Measured, mesh: GearMesh) -> tuple[ToothError, ...]:
    """One entry for each wheel of a mesh; empty without encoders on both shafts or with too few turns."""
    phases = encoder_phases(measured, mesh)
    if phases is None:
        return ()
    lines = min(measured.encoders[s].pulses_per_revolution for s in (mesh.driving_shaft, mesh.driven_shaft))
    resolved = _SHARE_OF_LINES * lines / max(mesh.driving_teeth, mesh.driven_teeth)
    tops = sorted({min(top, resolved) for top in _TOP_MESH})
    own, mate = (_course(phases, mesh, 0), _course(phases, mesh, 1))
    if own is None or mate is None or tops[0] < _LEAST_TOP:
        return ()
    first, second = own.average(), mate.average()
    if mesh.driving_teeth != mesh.driven_teeth:
        # In few turns of one wheel what the other one does is not averaged out, so it is taken off.
        first, second = own.without(second).average(), mate.without(first).average()
    wheels = (
        (mesh.driving_shaft, mesh.driving_teeth, own, first),
        (mesh.driven_shaft, mesh.driven_teeth, mate, second),
    )
    found = []
    for shaft, teeth, course, average in wheels:
        looks = [_judged(average, teeth, top * teeth) for top in tops]
        best = min(looks, key=lambda one: one.log10_chance)
        chance = min(0.0, best.log10_chance + math.log10(len(looks)))
        place = (best.place + _zero(measured, course, shaft)) % 1.0
        # Wheels are compared over the same frequencies, those of the first look.
        uneven = looks[0].unevenness
        event = replace(best, place=place, log10_chance=chance, unevenness=uneven)
        found.append(ToothError(shaft, teeth, course.turns, event))
    return tuple(found)


@dataclass(frozen=True, slots=True, eq=False)
class _Course:
    """Transmission error in pitches at equal angles of one wheel, without its slow course.

    `grid` holds the wheel's own angle and `mate` that of the other wheel, in turns; `samples` where that is.
    """

    error: Array
    grid: Array
    mate: Array
    samples: Array
    turns: int

    def average(self) -> Array:
        """Over the wheel's turn; the first turn fades in as the last one fades out, to leave no step."""
        per_turn = self.error.size // self.turns
        ramp = np.arange(per_turn) / per_turn
        periods = self.error.reshape(self.turns, per_turn)
        inner = periods[1:-1].sum(axis=0)
        return np.asarray((periods[0] * ramp + inner + periods[-1] * (1.0 - ramp)) / (self.turns - 1))

    def without(self, average: Array) -> _Course:
        """Less the other wheel's average."""
        knots = np.arange(average.size + 1) / average.size
        wave = CubicSpline(knots, np.append(average, average[0]), bc_type="periodic")
        return replace(self, error=self.error - wave(np.mod(self.mate, 1.0)))


def _course(phases: tuple[Phase, Phase], mesh: GearMesh, own: int) -> _Course | None:
    """Of the driving (0) or the driven wheel (1); None with too few turns."""
    teeth = mesh.driving_teeth, mesh.driven_teeth
    low = max(phase.samples[0] for phase in phases)
    high = min(phase.samples[-1] for phase in phases)
    first, last = np.interp([low, high], phases[own].samples, phases[own].turns)
    # Averages begin where the wheel's own angle is 0.
    begin = math.ceil(first)
    turns = math.floor(last - begin)
    if turns < _LEAST_TURNS:
        return None
    per_turn = int(sfft.next_fast_len(16 * teeth[own], real=True))
    grid = begin + np.arange(turns * per_turn) / per_turn
    at = np.clip(CubicSpline(phases[own].turns, phases[own].samples)(grid), low, high)
    angles = [CubicSpline(phase.samples, phase.turns)(at) for phase in phases]
    error = angles[0] * teeth[0] - angles[1] * teeth[1]
    mate = angles[1 - own]
    # Of wheels of one speed, which share their harmonics, one will do.
    error = error - _slow(error, [grid] if teeth[0] == teeth[1] else [grid, mate], per_turn)
    return _Course(np.asarray(error), grid, np.asarray(mate), np.asarray(at), turns)


def _zero(measured: Measured, course: _Course, shaft: str) -> float:
    """What to add to the encoder's angle to get that by which accelerations are averaged."""
    if measured.phase is None:
        return 0.0
    ratio = measured.machine.shaft(shaft).ratio
    turns = np.interp(course.samples, measured.phase.samples, measured.phase.turns)
    return float(np.median(ratio * turns - course.grid))


def _slow(error: Array, angles: list[Array], per_turn: int) -> Array:
    """Course and shaft harmonics of both wheels: run-out is a hundred times what a tooth does.

    Of the other wheel it would not average out, and leave a step where the turn begins.
    """
    length = np.linspace(-1.0, 1.0, error.size)
    columns = [np.ones(error.size), length, length**2]
    for angle in angles:
        for order in range(1, _SHAFT_HARMONICS + 1):
            columns += [np.cos(2 * np.pi * order * angle), np.sin(2 * np.pi * order * angle)]
    table = np.stack(columns, axis=1)
    thin = max(1, per_turn // 64)
    weights = np.linalg.lstsq(table[::thin], error[::thin], rcond=None)[0]
    return np.asarray(table @ weights)


def _judged(average: Array, teeth: int, top: float) -> ToothEvent:
    """The tooth that stands out most in the residual of the orders up to `top`."""
    lines = sfft.rfft(average)[: math.floor(top) + 1]
    orders = np.arange(lines.size)
    from_mesh = np.abs(orders - teeth * np.round(orders / teeth))
    lines[(from_mesh <= _SIDEBANDS) | (orders <= _SHAFT_HARMONICS)] = 0.0
    size = 2 * lines.size
    error = sfft.irfft(lines, size) * (size / average.size)
    residual = ar_residual(error, min(teeth, size // 8), periodic=True)
    profile = energy_by_angle(residual, teeth)
    floor = max(float(np.median(profile)), _TINY)
    place, over_rest, over_median, chance = standing_tooth(profile / floor, teeth, 0.0)
    away = (np.arange(size) - round(place * size) + size // 2) % size - size // 2
    near = np.abs(away) <= _NEAR_TEETH * size / teeth
    energy = np.maximum(residual[near] ** 2 - floor, 0.0)
    at = away[near] * teeth / size
    total = max(float(energy.sum()), _TINY)
    centre = float(np.sum(energy * at)) / total
    width = math.sqrt(float(np.sum(energy * (at - centre) ** 2)) / total)
    largest = float(np.abs(error[near]).max())
    uneven = math.sqrt(float(np.mean(np.sort(profile)[: max(1, round(0.9 * size))])))
    return ToothEvent(place, over_rest, over_median, chance, largest, width, uneven)
