"""Planets told apart: exactly on signals made so, and on the simulated stage.

The simulator's ring is rigid and multiplies nothing by a window. Its sensor hears each planet's force by its
direction, once per turn of the carrier and without a mean: three planets cannot be told apart fully, and the
weights say so.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from gearsim_dsp.features import rms
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.indicators import fm4
from gearsim_dsp.synchronous.pass_weights import McFaddenWindow, forrester_weights, gains
from gearsim_dsp.synchronous.planets import (
    pass_harmonics,
    pass_place,
    separate,
    strike_levels,
    why_not_separable,
)
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_dsp.synchronous.tsa import shaft_average
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.plant import RotatingSite
from gearsim_sim.params import load_planetary_params

RIG = load_machine("unsw_planetary_hunting")
STAGE = RIG.planetary_stages[0]
P, S, R = STAGE.planet_teeth, STAGE.sun_teeth, STAGE.ring_teeth
PLACES = np.asarray(STAGE.planet_angles_rad) / (2 * math.pi)
PASS = 0.2
RATE_HZ = 4096.0


def cosines(series, turns):
    return sum(a * np.cos(2 * np.pi * m * turns) for m, a in enumerate(series))


def carrier(turns_wanted, hz=2.0):
    """Turns of a carrier whose speed swings by 2 %, and its phase."""
    n = int((turns_wanted + 0.2) / hz * RATE_HZ)
    t = np.arange(n) / RATE_HZ
    turns = 0.3 + hz * t + 0.02 * hz / (2 * np.pi * 0.5) * np.sin(2 * np.pi * 0.5 * t)
    knots = np.unique(np.append(np.arange(0, n, 16), n - 1))
    return turns, Phase(knots.astype(float), turns[knots])


def shapes(rng, lines=60):
    """One smooth periodic function of a turn for each planet, by its lines."""
    return rng.normal(size=(3, lines)) + 1j * rng.normal(size=(3, lines))


def value(lines, turns):
    return np.real(np.exp(2j * np.pi * np.multiply.outer(turns, np.arange(1, lines.size + 1))) @ lines)


@lru_cache
def made(loudness, turns=P):
    u, phase = carrier(turns)
    lines = shapes(np.random.default_rng(7))
    x = sum(
        cosines(loudness, u - (PASS - place)) * value(v, u * R / P)
        for place, v in zip(PLACES, lines, strict=True)
    )
    return x, phase, lines


def relative_error(average, expected):
    return rms(average.values - expected) / rms(expected)


def test_forresters_weights_give_back_each_planet():
    loudness = (1.0, 1.0)
    x, phase, lines = made(loudness)
    weights = forrester_weights(STAGE, loudness)
    np.testing.assert_allclose(gains(weights, STAGE, loudness), np.eye(3), atol=1e-9)
    found = separate(x, phase, RIG, STAGE, weights, pass_turn=PASS)
    for average, v in zip(found.averages, lines, strict=True):
        # The interpolation of the angle between knots and of the signal: below 1e-3 of it.
        assert relative_error(average, value(v, average.turns)) < 1e-3
    assert found.periods == 1


def test_mcfaddens_window_hears_the_others_as_loud_as_they_are():
    loudness = (0.45, 0.8, 0.5, 0.25)
    x, phase, lines = made(loudness)
    window = McFaddenWindow(R)
    found = separate(x, phase, RIG, STAGE, window, pass_turn=PASS)
    expected = gains(window, STAGE, loudness)
    assert expected[0, 0] == pytest.approx(cosines(loudness, 0.0), rel=2e-3)
    assert expected[0, 1] == pytest.approx(cosines(loudness, 1 / 3), abs=2e-3)
    for row, average in zip(expected, found.averages, strict=True):
        mixed = sum(g * value(v, average.turns) for g, v in zip(row, lines, strict=True))
        # A slope of the loudness under the window of two teeth in 83 comes in as the planet's turn shifts it.
        assert relative_error(average, mixed) < 0.02


def test_windows_of_two_teeth_add_up_at_every_angle():
    turns = (np.arange(R)[:, None] + np.linspace(0, 1, 57)) * P / R
    for width in (2, 3, 5):
        total = McFaddenWindow(R, width)(turns).mean(axis=0)
        np.testing.assert_allclose(total, 1.0, atol=1e-12)
    with pytest.raises(InputError, match="width_teeth"):
        McFaddenWindow(R, 1)


def test_one_harmonic_alone_leaves_what_the_weights_say():
    """Where all planets are alike nothing is heard: 2/3 of its own and -1/3 of the others are left."""
    weights = forrester_weights(STAGE, (0.0, 1.0))
    rest = gains(weights, STAGE, (0.0, 1.0))
    np.testing.assert_allclose(rest, np.eye(3) - 1 / 3, atol=1e-9)


def test_the_uncertainty_told_is_that_of_the_noise():
    rng = np.random.default_rng(8)
    _, phase = carrier(2 * P)
    count = int(phase.samples[-1]) + 1
    for weights in (forrester_weights(STAGE), McFaddenWindow(R)):
        noise = rng.normal(size=count)
        found = separate(noise, phase, RIG, STAGE, weights, pass_turn=PASS, samples_per_tooth=12)
        assert found.periods == 2
        for average in found.averages:
            # 276 values, not all independent: known to some 5 %, of which four.
            assert rms(average.values) == pytest.approx(average.noise_rms, rel=0.2)


def test_loudness_is_measured_from_what_differs_between_planets():
    loudness = (0.5, 1.0, 0.4)
    x, phase, _ = made(loudness, 2 * P)
    found = pass_harmonics(x + np.random.default_rng(1).normal(size=x.size), phase, RIG, STAGE)
    # The planets' shapes are independent: 3 x 60 lines give the powers to some 15 %, the amplitudes to 8.
    assert found == pytest.approx((0.5, 1.0, 0.4, 0.0), abs=0.12)
    for silent in (np.zeros(x.size), np.random.default_rng(2).normal(size=x.size)):
        with pytest.raises(InputError, match="planets that differ"):
            pass_harmonics(silent, phase, RIG, STAGE)


@pytest.mark.parametrize("machine", ["unsw_planetary", "unsw_planetary_hunting"])
@pytest.mark.parametrize("place", [0.05, 0.3])
def test_where_planets_pass_is_in_the_sidebands_of_the_mesh(machine, place):
    """Planets that mesh alike, loudest as they pass; each in its own phase of the mesh."""
    plate = load_machine(machine)
    stage = plate.planetary_stages[0]
    u, phase = carrier(8)
    rng = np.random.default_rng(3)
    mesh = [complex(*rng.normal(size=2)) for _ in range(4)]
    x = rng.normal(size=u.size)
    for planet in PLACES:
        waves = (
            c * np.exp(2j * np.pi * (h + 1) * stage.ring_teeth * (u + planet)) for h, c in enumerate(mesh)
        )
        x += cosines((1.0, 1.3, 0.6, 0.2), u - place + planet) * np.real(sum(waves))
    found = pass_place(shaft_average(x, phase), stage)
    assert found.turn == pytest.approx(place % (1 / 3), abs=0.01)
    # Harmonics 1, 2, 4 have the lines 0.65 and 0.3 and nothing beyond: 0.65 x 0.3 / (0.65^2 + 0.3^2) = 0.38;
    # harmonic 3 has 0.1, 1, 0.1: (0.1 + 0.1) / (1 + 0.1^2 + 0.1^2) = 0.2.
    assert 0.2 < found.coherence < 0.4
    assert pass_place(shaft_average(rng.normal(size=u.size), phase), stage).coherence < 0.25
    with pytest.raises(InputError, match="one turn, with the mesh"):
        pass_place(shaft_average(x, phase, samples_per_turn=100), stage)
    uneven = replace(stage, planet_angles_rad=(0.0, 1.0, 3.0))
    with pytest.raises(InputError, match="evenly spaced"):
        pass_place(shaft_average(x, phase), uneven)


def test_the_sun_is_united_over_its_planets():
    u, phase = carrier(S)
    v = shapes(np.random.default_rng(9))[0]
    x = sum((1 + np.cos(2 * np.pi * (u - PASS + place))) * value(v, u * R / S - place) for place in PLACES)
    found = separate(x, phase, RIG, STAGE, forrester_weights(STAGE), pass_turn=PASS, member="sun")
    united = found.sun(STAGE)
    assert relative_error(united, value(v, united.turns)) < 1e-3
    planets = separate(x, phase, RIG, STAGE, forrester_weights(STAGE), pass_turn=PASS)
    with pytest.raises(InputError, match="member"):
        planets.sun(STAGE)


def test_refusals():
    plain = load_machine("unsw_planetary")
    stage = plain.planetary_stages[0]
    assert why_not_separable(STAGE) is None
    assert "only 1 of 20 teeth" in str(why_not_separable(stage))
    assert "only 1 of 40 teeth" in str(why_not_separable(stage, "sun"))
    x, phase, _ = made((1.0, 1.0))
    with pytest.raises(InputError, match="no hunting design"):
        separate(x, phase, plain, stage, McFaddenWindow(80), pass_turn=0.0)
    short = Phase(phase.samples, phase.turns * 0.5)
    with pytest.raises(InputError, match=r"11\.[56]\d turns of the carrier, expected 23 turns or more"):
        separate(x, short, RIG, STAGE, McFaddenWindow(R), pass_turn=0.0)


# --- the simulated stage ----------------------------------------------------------------------------------

SIM_RATE_HZ = 16384.0
CARRIER_HZ = 32 / 15
RING_TOP = {"ring": RotatingSite({"x_r": 1.0}, {"y_r": 1.0}, 0, -1.0, 0.25)}
# A planet pushes the ring along the line of action, 20 degrees off the tangent. So a vertical sensor hears it
# loudest 20 degrees before it is level with the centre, where planet 1 is at turn 0.
LOUDEST = -20 / 360
FAULTS = {
    "spall_ring": ("planet_tooth_spall", {"side": "ring"}),
    "spall_sun": ("planet_tooth_spall", {"side": "sun"}),
    "crack": ("planet_tooth_crack", {"opens_towards": "ring", "closing": 1.0}),
}


@lru_cache
def simulated(case, planet, seed):
    params = load_planetary_params("unsw_planetary_hunting", overrides={"gear_errors.runout": "5 um"})
    faults = []
    if case != "healthy":
        kind, options = FAULTS[case]
        faults = [FaultSpec(kind, f"planet_{planet}", {**options, "tooth": 2 + 5 * seed})]
    engine = Engine(params, seed, SIM_RATE_HZ, 8, faults, sites=RING_TOP)
    count = int((P + 0.5) / CARRIER_HZ * SIM_RATE_HZ)
    output = engine.advance(count)
    noise = 0.05 * np.random.default_rng(seed).normal(size=count)
    phase = Phase(np.array([0.0, count - 1.0]), np.array([0.0, (count - 1) / SIM_RATE_HZ * CARRIER_HZ]))
    return output.accel[0] + noise, phase


@pytest.mark.parametrize(
    ("case", "planet"),
    [("crack", 1), ("crack", 2), ("crack", 3), ("spall_ring", 1), ("spall_ring", 3), ("spall_sun", 2)],
)
def test_the_planet_with_the_bad_tooth_is_found(case, planet):
    x, phase = simulated(case, planet, planet)
    loudness = pass_harmonics(x, phase, RIG, STAGE)
    assert loudness[1] == 1.0
    assert max(loudness[0], *loudness[2:]) < 0.1
    found = separate(x, phase, RIG, STAGE, forrester_weights(STAGE, loudness), pass_turn=LOUDEST)
    levels = strike_levels(found, P)
    assert int(np.argmax(levels)) == planet - 1
    # What the others hold of it is half as much, as `gains` says, and their own small differences.
    assert sorted(levels)[1] < 0.75 * max(levels)


def test_a_rigid_ring_does_not_tell_where_planets_pass():
    x, phase = simulated("healthy", 2, 2)
    assert pass_place(shaft_average(x, phase), STAGE).coherence < 0.1


def test_the_average_of_one_planet_shows_the_tooth_and_a_sound_stage_shows_none():
    for case, low, high in (("spall_sun", 20.0, math.inf), ("healthy", 0.0, 6.0)):
        x, phase = simulated(case, 2, 2)
        weights = forrester_weights(STAGE, (0.0, 1.0))
        found = separate(x, phase, RIG, STAGE, weights, pass_turn=LOUDEST)
        assert low < fm4(difference_signal(found.averages[1], [P])) < high
