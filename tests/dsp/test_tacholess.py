"""Speed and angle without tacho: synthetic machines with a known angle, and the measured gear records."""

import numpy as np
import pytest
from rotating_machine import random_case

from gearsim_dsp.angle.record_speed import changes, doubt_of_angle, record_speed
from gearsim_dsp.angle.refine import angle_error
from gearsim_dsp.angle.resample import AngleSignal
from gearsim_dsp.angle.ridge import best_path
from gearsim_dsp.angle.tacholess import speed_limits, track_speed
from gearsim_dsp.angle.tracked_orders import all_mesh_orders, tracked_orders
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_io.nameplate import Machine, Shaft
from gearsim_io.record import PulseTrain, Record


def _angle_error(track, case):
    """Scatter of the angle in turns, but for its zero, away from the ends."""
    error = np.interp(track.phase.samples, np.arange(case.turns.size), case.turns) - track.phase.turns
    edge = error.size // 10
    return float(np.std(error[edge:-edge]))


@pytest.mark.parametrize("profile", ["constant", "ramp", "swing", "walk"])
def test_angle_follows_the_speed(profile):
    errors = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        known = seed % 2 == 0
        case = random_case(rng, seconds=4.0, profile=profile, level_db=30.0, known_speed=known)
        track = track_speed(case.x, case.rate_hz, case.machine)
        errors.append(_angle_error(track, case) * case.machine.gear_meshes[0].driving_teeth)
        assert track.found
        true = float(np.ptp(case.speed_hz[50:-50])) / track.mean_hz
        if not 1e-3 < true < 4e-3:  # the limit is at 2e-3
            assert changes(track) == (true > 2e-3)
    # In mesh periods: none is lost, and mostly the mesh's line keeps within 2 % (1 - (2 pi 0.03)^2 / 2).
    assert max(errors) < 0.4
    assert np.median(errors) < 0.03


def test_steady_speed_stays_steady_beside_supply_lines():
    bent = 0
    for seed in range(8):
        rng = np.random.default_rng(700 + seed)
        case = random_case(rng, level_db=rng.uniform(10, 40), profile="constant", seconds=2.5)
        bent += changes(track_speed(case.x, case.rate_hz, case.machine))
    assert bent == 0


def test_confidence_and_interval_are_honest():
    """Other seeds than those that the confidence was fitted to; half of them drown in noise."""
    sure, inside, right = 0, 0, 0
    for seed in range(24):
        rng = np.random.default_rng(90_000 + seed)
        case = random_case(rng, level_db=rng.uniform(0, 40), seconds=3.0)
        track = track_speed(case.x, case.rate_hz, case.machine)
        if track.confidence < 0.9:
            continue
        sure += 1
        at = np.clip(track.phase.samples.astype(int), 0, case.turns.size - 1)
        edge = at.size // 20
        right += np.max(np.abs(track.speed_hz / case.speed_hz[at] - 1)[edge:-edge]) < 5e-3
        true_hz = (case.turns[-1] - case.turns[0]) / (case.turns.size - 1) * case.rate_hz
        low, high = track.shaft_speed().ci95_hz
        inside += low <= true_hz <= high
    assert sure >= 10
    # Of 10 to 24 at nine in ten each, more than a quarter miss with a probability below 2 %.
    assert right >= 0.75 * sure
    assert inside >= 0.75 * sure


def test_noise_is_not_taken_for_a_speed():
    plate = load_machine("unsw_parallel")
    noises = (np.random.default_rng(seed).standard_normal(24_000) for seed in range(8))
    assert max(track_speed(x, 8000.0, plate).confidence for x in noises) < 0.7


def test_channels_help_each_other():
    case = random_case(np.random.default_rng(5), seconds=4.0, profile="ramp", level_db=30.0)
    rng = np.random.default_rng(6)
    other = np.std(case.x) * rng.standard_normal(case.x.size)
    both = track_speed(np.stack([other, case.x]), case.rate_hz, case.machine)
    assert both.confidence > 0.9
    # Of 60 records of noise with random nameplates none came above 0.53.
    assert track_speed(other, case.rate_hz, case.machine).confidence < 0.7


def test_high_rates_are_thinned_without_harm():
    case = random_case(np.random.default_rng(7), seconds=3.0, profile="ramp", level_db=35.0)
    factor = 6
    x = np.repeat(case.x, factor)
    track = track_speed(x, case.rate_hz * factor, case.machine)
    assert track.phase.samples[-1] == x.size - 1
    plain = track_speed(case.x, case.rate_hz, case.machine)
    assert track.mean_hz == pytest.approx(plain.mean_hz, rel=1e-4)


def test_the_phases_of_lines_tell_the_error_of_the_angle():
    turns = np.arange(256 * 120) / 256
    ahead = 2e-3 * np.sin(2 * np.pi * turns / 40) + 1e-5 * turns
    rng = np.random.default_rng(1)
    x = 0.3 * rng.standard_normal(turns.size)
    for order, strength in ((1, 0.4), (22, 1.0), (44, 0.6)):
        x += strength * np.cos(2 * np.pi * (order * (turns + ahead) + 0.3))
    x += 0.5 * np.cos(2 * np.pi * 61.93 * turns)  # an electrical line near the 62nd order
    found = angle_error([AngleSignal(x, 256, 0.0)], np.array([1.0, 22.0, 44.0, 62.0]), 0.2)
    assert 62.0 not in found.orders
    expected = np.interp(found.turns, turns, ahead)
    inner = slice(found.turns.size // 10, -found.turns.size // 10)
    error = (found.ahead - expected)[inner]
    # Phase noise in the band: 0.3 sqrt(0.4 / 128) / (2 pi 44 * 0.6) turns and less, and the band's edge.
    assert np.std(error - error.mean()) < 1e-4
    assert found.bend > 4
    steady = angle_error([AngleSignal(_steady(rng, turns), 256, 0.0)], np.array([1.0, 22.0, 44.0]), 0.2)
    assert steady.bend < 2


def _steady(rng, turns):
    lines = sum(np.cos(2 * np.pi * order * turns) for order in (1, 22, 44))
    return lines + 0.3 * rng.standard_normal(turns.size)


def test_path_is_the_best_of_all_paths():
    rng = np.random.default_rng(1)
    evidence = rng.standard_normal((4, 5))
    path, score = best_path(evidence, 0.3, 2)
    best = -np.inf
    for a, b, c, d in np.ndindex(5, 5, 5, 5):
        steps = np.diff([a, b, c, d])
        if np.max(np.abs(steps)) <= 2:
            total = evidence[0, a] + evidence[1, b] + evidence[2, c] + evidence[3, d]
            best = max(best, total - 0.3 * np.sum(steps**2))
    assert 4 * score == pytest.approx(best)
    steps = np.diff(path)
    assert np.sum(evidence[np.arange(4), path]) - 0.3 * np.sum(steps**2) == pytest.approx(best)


def test_orders_of_a_planetary_stage_are_among_the_comb():
    plate = load_machine("unsw_planetary")
    stage = plate.planetary_stages[0]
    mesh = stage.ring_teeth * plate.shaft(stage.carrier_shaft).ratio
    assert any(order == pytest.approx(mesh) for order in all_mesh_orders(plate))
    orders, weights = tracked_orders(plate)
    assert weights[np.argmin(np.abs(orders - mesh))] == pytest.approx(1.0)


def test_too_short_a_record_says_how_long_it_must_be():
    plate = Machine("m", "", "s", (Shaft("s", 1.0, 10.0),), speed_tolerance=0.02)
    with pytest.raises(InputError, match=r"at least 1\.05 s \(10 turns"):
        track_speed(np.zeros(500), 1000.0, plate)
    with pytest.raises(InputError, match="not finite"):
        track_speed(np.full(5000, np.nan), 1000.0, plate)
    with pytest.raises(InputError, match="range_hz"):
        track_speed(np.zeros(5000), 1000.0, plate, range_hz=(3.0, 2.0))


# Angle signals that contradict the nameplate


def _record_with_tacho(case, factor):
    """Pulses of a tacho that gives `factor` times as many as are listed."""
    whole = np.arange(1, case.turns[-1] * factor)
    pulses = np.interp(whole / factor, case.turns, np.arange(case.turns.size))
    train = PulseTrain("s0", 1.0, pulses)
    return Record(case.rate_hz, ("a",), "m/s^2", case.x[None].astype(np.float32), (train,))


@pytest.mark.parametrize(("factor", "words"), [(2.0, "2 times as many"), (0.5, "1/2 of the"), (0.37, "")])
def test_a_tacho_that_counts_wrongly_is_found_out(factor, words):
    case = random_case(np.random.default_rng(3), seconds=4.0, profile="ramp", level_db=30.0)
    found = record_speed(_record_with_tacho(case, factor), case.machine)
    assert [issue.issue for issue in found.issues] == ["angle_contradicted"]
    assert words in found.issues[0].detail
    assert found.replaces_angle
    mean = np.mean(case.speed_hz[5:-5])
    assert found.speed.value_hz == pytest.approx(mean, rel=1e-3)
    assert found.speed.source == "estimated"


def test_a_machine_that_runs_at_another_speed_is_believed():
    case = random_case(np.random.default_rng(3), seconds=4.0, profile="constant", level_db=30.0)
    true = float(np.mean(case.speed_hz[5:-5]))
    shafts = tuple(Shaft(s.name, s.ratio, true * 1.6 * s.ratio) for s in case.machine.shafts)
    plate = Machine("m", "", "s0", shafts, case.machine.gear_meshes, speed_tolerance=0.02)
    found = record_speed(_record_with_tacho(case, 1.0), plate)
    assert found.issues == ()
    assert found.speed.source == "tacho"
    assert not found.replaces_angle


def test_without_lines_a_contradiction_stays_open():
    rng = np.random.default_rng(4)
    x = rng.standard_normal((1, 40_000))
    plate = Machine("m", "", "s", (Shaft("s", 1.0, 25.0),), speed_tolerance=0.02)
    turns = np.array([0.0, 50.0])
    speed = ShaftSpeed(12.5, (12.49, 12.51), "tacho", Phase(np.array([0.0, 39_999.0]), turns))
    doubt = doubt_of_angle(x, 10_000.0, plate, speed)
    assert doubt.instead is None
    assert doubt.issue.issue == "angle_doubtful"
    low, high = speed_limits(plate)
    assert (low, high) == pytest.approx((23.75, 26.25))
