"""The planets of a stage told apart: the average of each, or of the sun, from one sensor beside the ring.

A sensor beside a ring that stands hears each planet loudest as it passes. With u the turns of the carrier, A
the loudness over its angle and v_p what planet p does over its own turn (Z_r / Z_p of these to one of the
carrier)::

    x(u) = sum_p A(u - u_p) v_p(u Z_r / Z_p),        u_p = u_1 - psi_p / 2 pi

Planets turn alike, so an average over the turn of a planet holds all of them. But at every angle of the
planet the carrier has been at Z_r different places, evenly spread, if the teeth of planet and ring have no
common factor (a hunting design) and the record holds Z_p turns of the carrier. A weight W over these places
then tells them apart (`pass_weights`)::

    y_p(phi) = 1/Z_r sum over the places of W(u - u_p) x(u)

The sun is heard through each planet in turn; its averages through all of them, each turned back by the
planet's place, are united (Blunt, US patent 6,898,975 (2003)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.resample import full_rate, to_angle
from gearsim_dsp.planet_kinematics import hunting_turns, planetary_orders
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.pass_weights import PassWeights
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_dsp.synchronous.tsa import Average
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine, PlanetaryStage

__all__ = [
    "PassPlace",
    "Separation",
    "pass_harmonics",
    "pass_place",
    "separate",
    "strike_levels",
    "why_not_separable",
]

Floats = NDArray[np.float64]
Member = Literal["planet", "sun"]

_SCATTER_HARMONICS = 8
"""Harmonics of the carrier in what repeats, when the rest is measured; passing of planets is smoother."""

_CLEAR = 6.0
"""A harmonic of the loudness stands this many standard deviations over those of the noise, told by a few."""


@dataclass(frozen=True, slots=True, eq=False)
class Separation:
    """Averages of planets, or of the sun as heard through each.

    Parameters
    ----------
    averages : tuple of Average
        One for each planet, over one turn of the member against the carrier; all begin where the carrier's
        turn is 0, so that one event is at one place in all of them. `std` / sqrt(`count`) is the
        uncertainty, `count` the turns of the member in the record.
    member : {"planet", "sun"}
    periods : int
        Hunting periods in the record.
    """

    averages: tuple[Average, ...]
    member: Member
    periods: int

    def sun(self, stage: PlanetaryStage) -> Average:
        """The sun's average through all planets together; sample 0 is where the carrier's turn is 0.

        Raises
        ------
        InputError
            When these are averages of planets.
        """
        if self.member != "sun":
            raise InputError("Separation", "member", self.member, "sun")
        places = np.asarray(stage.planet_angles_rad) / (2 * math.pi)
        values = [_turned(a.values, place) for a, place in zip(self.averages, places, strict=True)]
        spread = [_turned(a.std**2, place) for a, place in zip(self.averages, places, strict=True)]
        std = np.sqrt(np.maximum(np.mean(spread, axis=0), 0.0) / len(values))
        return Average(np.mean(values, axis=0), std, self.averages[0].count)


@dataclass(frozen=True, slots=True)
class PassPlace:
    """Where planets pass a sensor.

    Parameters
    ----------
    turn : float
        Turn of the carrier at which one of the planets is loudest, from 0 to below one over their number;
        as `pass_turn` of `separate` it makes that one planet 1.
    coherence : float
        Part of the sidebands' power that agrees on it, 0 to 1: low too where one line of a pair has all the
        power, which noise then decides. Of noise on n pairs it is about 1 / sqrt(n).
    """

    turn: float
    coherence: float


def why_not_separable(stage: PlanetaryStage, member: Member = "planet") -> str | None:
    """Why the planets (or the sun) of a stage cannot be told apart by their passing; None where they can."""
    if stage.fixed_member != "ring":
        return f"the {stage.fixed_member} stands: planets do not pass a sensor beside a ring that stands"
    teeth = stage.planet_teeth if member == "planet" else stage.sun_teeth
    seen = hunting_turns(stage)[f"{member}_ring"]
    if seen == teeth:
        return None
    return (
        f"{member} {teeth} and ring {stage.ring_teeth} teeth are no hunting design: only {seen} of {teeth} "
        f"teeth of the {member} ever pass the sensor, always at the same teeth of the ring"
    )


def separate(
    signal: NDArray[np.float32] | Floats,
    phase: Phase,
    machine: Machine,
    stage: PlanetaryStage,
    weights: PassWeights,
    *,
    pass_turn: float,
    member: Member = "planet",
    samples_per_tooth: int | None = None,
) -> Separation:
    """Averages of all planets, or of the sun through each.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        Of a sensor beside the ring, sampled at equal times.
    phase : Phase
        Angle of the reference shaft. Its turn 0 must be the same place of the carrier in all records that are
        to be compared (a tacho on the carrier, one pulse per turn).
    machine, stage : Machine, PlanetaryStage
    weights : PassWeights
    pass_turn : float
        Turn of the carrier at which planet 1 is loudest; the others follow by their angles, which count in
        the carrier's sense of turning.
    member : {"planet", "sun"}
    samples_per_tooth : int, optional
        By default as many as lose nothing.

    Raises
    ------
    InputError
        When the design is no hunting one (`why_not_separable`), or the record is too short.
    """
    blocks, turns, periods = _by_place(signal, phase, machine, stage, member, samples_per_tooth)
    places = np.asarray(stage.planet_angles_rad) / (2 * math.pi)
    variance = _scatter(blocks, turns)
    averages = []
    mean = blocks.mean(axis=0)
    count = blocks.shape[0] * blocks.shape[1]
    for place in places - places[0]:
        weight = weights(turns - (pass_turn - place)) / blocks.shape[1]
        # Of the mean: its squared uncertainty is that of one sample times the sum of squared weights.
        std = np.sqrt(variance * np.sum(weight**2, axis=0) / periods * count)
        averages.append(Average(np.sum(weight * mean, axis=0), std, count))
    return Separation(tuple(averages), member, periods)


def pass_harmonics(
    signal: NDArray[np.float32] | Floats,
    phase: Phase,
    machine: Machine,
    stage: PlanetaryStage,
    *,
    count: int = 3,
) -> tuple[float, ...]:
    """Loudness of a passing planet as a cosine series (a_0 ... a_count), the largest set to 1.

    Notes
    -----
    What differs between the planets (errors of teeth, faults) lies at the lines k Z_r / Z_p + m with k no
    multiple of Z_p, m = 0 to +-count by the loudness's harmonics: their powers, less that of the lines
    beyond, are taken. Harmonics are counted positive: loudest at the pass. It needs planets that differ:
    powers of m and -m belong to one harmonic, while the powers of different m compare only if the planets'
    errors do not depend on each other, or one is faulty.
    """
    blocks, turns, _ = _by_place(signal, phase, machine, stage, "planet", None)
    mean = blocks.mean(axis=0)
    powers = []
    for m in range(2 * count + 3):
        lines = (
            sfft.rfft(np.mean(mean * np.cos(2 * np.pi * m * turns), axis=0)),
            sfft.rfft(np.mean(mean * np.sin(2 * np.pi * m * turns), axis=0)),
        )
        power = np.abs(lines[0]) ** 2 + np.abs(lines[1]) ** 2
        power[:: stage.planet_teeth] = 0.0
        powers.append(float(np.sum(power)))
    beyond = np.asarray(powers[count + 1 :])
    floor, scatter = float(np.mean(beyond)), float(np.std(beyond, ddof=1))
    # The cosine and sine parts of m > 0 are a quarter of a_m^2 together, that of m = 0 is all of a_0^2.
    excess = np.asarray(powers[: count + 1]) - floor
    series = np.sqrt(np.where(excess > _CLEAR * scatter, excess, 0.0))
    series[1:] *= 2.0
    if not series.max() > 0:
        raise InputError("pass_harmonics", "signal", "no lines of single planets", "planets that differ")
    return tuple(float(a) for a in series / series.max())


def pass_place(average: Average, stage: PlanetaryStage, *, reach: int = 6) -> PassPlace:
    """Where planets pass the sensor, from the carrier's average: the place of one, not which.

    Parameters
    ----------
    average : Average
        Of the planet carrier (`tsa.shaft_average`), from a sensor beside the ring.
    stage : PlanetaryStage
        With planets evenly spaced and a ring that stands; it need not be a hunting design.
    reach : int
        Sidebands of the mesh harmonics looked at, in carrier orders.

    Notes
    -----
    Of N like planets the mesh harmonic h leaves the lines h Z_r + m that are multiples of N, with the
    amplitudes N a_m C_h exp(-2 pi j m u_1) (McFadden and Smith, Proc. Inst. Mech. Eng. C 199 (1985) 65-70).
    Two of them N apart differ by 2 pi N u_1 in phase if a_m > 0, that is, if planets are loudest as they
    pass: u_1 modulo 1/N. A ring that hears them by direction alone has one such line only: the coherence
    is then near 0. (Another way: D'Elia, Mucchi and Dalpiaz, Int. Conf. Surveillance 7 (2013).)
    """
    places = np.asarray(stage.planet_angles_rad) / (2 * math.pi)
    count = places.size
    even = np.allclose(np.sort(np.mod(places - places[0], 1.0)), np.arange(count) / count, atol=1e-3)
    if count < 2 or not even or stage.fixed_member != "ring":
        got = f"{count} planets, the {stage.fixed_member} stands"
        raise InputError("pass_place", "stage", got, "two or more, evenly spaced, on a ring that stands")
    if average.turns_per_period != 1 or average.samples_per_turn <= 2 * (stage.ring_teeth + reach):
        got = f"{average.samples_per_turn} samples in each of {average.turns_per_period} turns"
        raise InputError("pass_place", "average", got, "one turn, with the mesh and its sidebands")
    lines = sfft.rfft(average.values)
    total, most = 0j, 0.0
    for harmonic in range(stage.ring_teeth, lines.size - reach, stage.ring_teeth):
        near = [k for k in range(harmonic - reach, harmonic + reach + 1) if k % count == 0]
        low, high = lines[near[:-1]], lines[near[1:]]
        total += complex(np.sum(high * np.conj(low)))
        most += 0.5 * float(np.sum(np.abs(high) ** 2 + np.abs(low) ** 2))
    turn = float(np.mod(-np.angle(total) / (2 * math.pi * count), 1 / count))
    return PassPlace(turn, abs(total) / most if most > 0 else 0.0)


def strike_levels(separation: Separation, teeth: int, sideband_count: int = 1) -> Floats:
    """Fourth root of the mean fourth power of each difference signal: the planet struck hardest has the most.

    FM4 does not tell planets apart, as what leaks into the others' averages has the same shape.

    Parameters
    ----------
    separation : Separation
    teeth : int
        Of the member averaged.
    sideband_count : int
    """
    rest = [difference_signal(a, [teeth], sideband_count) for a in separation.averages]
    return np.array([np.mean(d**4) ** 0.25 for d in rest])


def _by_place(
    signal: NDArray[np.float32] | Floats,
    phase: Phase,
    machine: Machine,
    stage: PlanetaryStage,
    member: Member,
    samples_per_tooth: int | None,
) -> tuple[Floats, Floats, int]:
    """Signal by hunting period, turn of the member and angle; the carrier's turns at each; periods."""
    where = f"planetary stage {stage.name!r}"
    if reason := why_not_separable(stage, member):
        raise InputError(
            where, "", reason, "a hunting design; the carrier's average and the AR residual serve"
        )
    teeth = stage.planet_teeth if member == "planet" else stage.sun_teeth
    ratio = planetary_orders(machine, stage).ring_on_carrier * stage.ring_teeth / teeth
    if samples_per_tooth is None:
        samples_per_tooth = math.ceil(full_rate(phase, ratio=ratio) / teeth)
    angle = to_angle(signal, phase, teeth * samples_per_tooth, ratio=ratio)
    size = stage.ring_teeth * angle.samples_per_turn
    periods = angle.values.size // size
    if periods < 1:
        got = f"{angle.turn_count * teeth / stage.ring_teeth:.2f} turns of the carrier"
        raise InputError(
            where, "signal", got, f"{teeth} turns or more, after which the same teeth meet again"
        )
    start = round(angle.first_turn * angle.samples_per_turn)
    whole = np.roll(angle.values[: periods * size], start % (periods * size))
    blocks = whole.reshape(periods, stage.ring_teeth, angle.samples_per_turn)
    phi = np.arange(angle.samples_per_turn) / angle.samples_per_turn
    turns = (np.arange(stage.ring_teeth)[:, None] + phi) * (teeth / stage.ring_teeth)
    return blocks, turns, periods


def _scatter(blocks: Floats, turns: Floats) -> Floats:
    """Variance of single samples about what repeats, at each angle of the member.

    What repeats is taken as the first harmonics of the carrier's turn at that angle.
    """
    periods, places, _ = blocks.shape
    most = min(_SCATTER_HARMONICS, (places - 1) // 4)
    mean = blocks.mean(axis=0)
    power = np.einsum("rpa,rpa->a", blocks, blocks) / (periods * places)
    for m in range(-most, most + 1):
        power -= np.abs(np.mean(mean * np.exp(-2j * np.pi * m * turns), axis=0)) ** 2
    free = periods * places - (2 * most + 1)
    return np.asarray(np.maximum(power, 0.0) * (periods * places / free))


def _turned(values: Floats, turns: float) -> Floats:
    """A period begun `turns` later, exact for what is band-limited."""
    lines = sfft.rfft(values)
    return np.asarray(sfft.irfft(lines * np.exp(2j * np.pi * turns * np.arange(lines.size)), values.size))
