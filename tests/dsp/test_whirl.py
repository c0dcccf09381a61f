"""Whirl after the blows of one tooth: found from one standing sensor, in its sense, or not at all."""

import numpy as np
import pytest

from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.whirl import blow_of_tooth, push_of_tooth, unlike_the_rest, whirl_parts

RATE_HZ, CARRIER_HZ, TEETH, RING = 16384.0, 3.0, 20, 80
BAND = (2000.0, 3000.0)
LINE_HZ, DELAY_S, WIDTH_S = 2500.0, 1.5e-3, 0.5e-3
PLACE = 0.3


def phase_of(samples):
    ends = np.array([0.0, samples - 1.0])
    return Phase(ends, ends * CARRIER_HZ / RATE_HZ)


def standing_sensor(forward, backward, *, unturned=0.0, noise=0.0, seconds=6.0, planet=4.0, mesh=1.0, seed=1):
    """Blows at one place of the planet's turn, as the centre's whirl heard from one direction in space."""
    samples = round(seconds * RATE_HZ)
    t = np.arange(samples) / RATE_HZ
    angle = 2 * np.pi * CARRIER_HZ * t
    since = np.mod(t - PLACE / (planet * CARRIER_HZ), 1 / (planet * CARRIER_HZ))
    # Swelling and fading so smoothly that it has no negative frequencies, which would whirl the other way.
    ring = np.exp(-(((since - DELAY_S) / WIDTH_S) ** 2) + 2j * np.pi * LINE_HZ * since)
    ring *= t >= PLACE / (planet * CARRIER_HZ)
    x = np.real(ring * (forward * np.exp(1j * angle) + backward * np.exp(-1j * angle) + unturned))
    x += mesh * np.cos(2 * np.pi * RING * 10 * CARRIER_HZ * t + 0.4) * np.cos(angle)
    return x + noise * np.random.default_rng(seed).standard_normal(samples)


def parts_of(x, planet=4.0, carrier=1.0):
    halves = whirl_parts(
        x,
        RATE_HZ,
        phase_of(x.size),
        planet_ratio=planet,
        carrier_ratio=carrier,
        teeth=TEETH,
        bands_hz=[BAND],
    )
    return None if halves is None else halves.mean(axis=0)


@pytest.mark.parametrize(("forward", "backward"), [(2.0, 0.5), (0.5, 2.0), (1.0, 1.0)])
def test_forward_and_backward_whirl_are_told_apart(forward, backward):
    blow = blow_of_tooth(parts_of(standing_sensor(forward, backward, noise=0.05)), TEETH, PLACE)
    ratio = np.log(blow.net[0, 0] / blow.net[0, 1])
    # 3 standard deviations as told, and 1 % for the interpolation.
    allowed = 3 * np.sqrt(np.sum(blow.variance[0, :2] / blow.net[0, :2] ** 2)) + 0.01
    assert allowed < 0.3
    assert ratio == pytest.approx(2 * np.log(forward / backward), abs=allowed)


def test_what_does_not_turn_is_a_part_of_its_own():
    blow = blow_of_tooth(parts_of(standing_sensor(1.0, 0.0, unturned=2.0)), TEETH, PLACE)
    assert blow.net[0, 2] / blow.net[0, 0] == pytest.approx(4.0, rel=0.02)
    assert blow.net[0, 1] < 1e-3 * blow.net[0, 0]


def test_a_filter_on_the_way_changes_nothing():
    x = standing_sensor(2.0, 0.5)
    filtered = np.convolve(x, [1.0, -0.9, 0.3])[: x.size]
    ratios = [
        blow.net[0, 0] / blow.net[0, 1]
        for blow in (blow_of_tooth(parts_of(one), TEETH, PLACE) for one in (x, filtered))
    ]
    assert ratios[1] == pytest.approx(ratios[0], rel=0.02)


def test_the_told_variance_is_that_of_repeated_noise():
    logs, told = [], []
    for seed in range(40):
        x = standing_sensor(0.3, 0.1, noise=0.5, seed=seed)
        blow = blow_of_tooth(parts_of(x), TEETH, PLACE)
        logs.append(np.log(blow.net[0, 0]))
        told.append(blow.variance[0, 0] / blow.net[0, 0] ** 2)
    # The variance of 40 numbers has a standard deviation of 23 %, that of 14 teeth's scatter 40 %.
    assert np.median(told) == pytest.approx(np.var(logs), rel=0.8)


def test_two_places_of_the_carrier_are_too_few():
    x = standing_sensor(1.0, 0.3, planet=2.0)
    assert parts_of(x, planet=2.0) is None


def test_too_few_turns_give_nothing():
    assert parts_of(standing_sensor(1.0, 0.3, seconds=0.4)) is None


def test_a_sensor_on_the_carrier_has_one_part():
    parts = parts_of(standing_sensor(0.0, 0.0, unturned=1.0), carrier=0.0)
    assert parts.shape == (1, 1, TEETH * 16)
    blow = blow_of_tooth(parts, TEETH, PLACE)
    assert blow.energy[0, 0] > 100 * blow.floor[0, 0]


@pytest.mark.parametrize("turn", [0.1, 0.37, 0.5])
def test_the_line_of_a_straight_motion(turn):
    """Forward and backward alike: heard most where the carrier's angle is half of what lies between them."""
    angle = 2 * np.pi * turn
    parts = parts_of(standing_sensor(np.exp(-1j * angle), np.exp(1j * angle), noise=0.05))
    told, straight = push_of_tooth(parts, TEETH, PLACE)
    assert np.mod(told - turn + 0.25, 0.5) == pytest.approx(0.25, abs=0.003)
    assert straight > 0.98
    assert push_of_tooth(parts_of(standing_sensor(1.0, 0.0)), TEETH, PLACE)[1] < 0.1


def test_two_bad_teeth_stand_out_of_what_all_share():
    """A mesh that swells once a turn, and two teeth with something of their own."""
    bins = TEETH * 16
    u = np.arange(bins) / bins
    parts = np.exp(2j * np.pi * TEETH * u) * (1 + 0.5 * np.cos(2 * np.pi * u)) + 0j
    rng = np.random.default_rng(3)
    parts = parts + 1e-3 * (rng.standard_normal(bins) + 1j * rng.standard_normal(bins))
    bad = [3, 13]
    for tooth in bad:
        parts[tooth * 16 : tooth * 16 + 16] += 0.2
    energy = np.mean(np.abs(unlike_the_rest(parts[None], TEETH)[0].reshape(TEETH, 16)) ** 2, axis=1)
    assert set(np.argsort(energy)[-2:]) == set(bad)
    assert sorted(energy)[-2] > 100 * np.median(energy)
