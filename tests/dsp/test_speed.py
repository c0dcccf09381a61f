import numpy as np
import pytest
from bearing_signals import machine, turns_of

from gearsim_dsp.speed import Phase, phase_from_pulses, window_speed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine, Shaft
from gearsim_io.record import PulseTrain

RATE = 10_000.0


def _pulses(turns, per_turn=1.0, start=0.3):
    wanted = np.arange(start, turns[-1] * per_turn, 1.0) / per_turn
    return np.interp(wanted, turns, np.arange(turns.size))


def _error(track, turns):
    """Largest deviation of the angle in turns, but for the unknown zero."""
    found = np.interp(np.arange(turns.size), track.phase.samples, track.phase.turns)
    difference = found - turns
    return float(np.max(np.abs(difference - np.median(difference))))


def test_angle_of_a_ramp_is_found_between_the_pulses():
    turns = turns_of(np.array([9.0, 11.0]), 3.0, RATE)
    track = phase_from_pulses(_pulses(turns), 1.0, turns.size)
    assert _error(track, turns) < 2e-3
    assert track.note == ""


def test_missing_pulses_are_counted_on():
    turns = turns_of(10.0, 4.0, RATE)
    pulses = np.delete(_pulses(turns), [7, 20, 21, 30])
    track = phase_from_pulses(pulses, 1.0, turns.size)
    assert _error(track, turns) < 1e-6
    assert track.note == "4 missing pulses filled in"


def test_double_pulses_are_dropped():
    turns = turns_of(10.0, 4.0, RATE)
    pulses = _pulses(turns)
    bounces = pulses[[3, 11, 12, 29]] + 12.0
    track = phase_from_pulses(np.sort(np.concatenate([pulses, bounces])), 1.0, turns.size)
    assert _error(track, turns) < 1e-6
    assert track.note == "4 double pulses dropped"


@pytest.mark.parametrize("share", [0.1, 0.3, 0.45])
def test_many_missing_and_double_pulses_are_counted_right(share):
    turns = turns_of(np.array([20.0, 24.0]), 8.0, RATE)
    for seed in range(10):
        rng = np.random.default_rng(seed)
        pulses = _pulses(turns)
        there = rng.random(pulses.size) > share
        seen = pulses[there] + 0.5 * rng.standard_normal(there.sum())
        doubles = seen[rng.random(seen.size) < 0.05] + rng.uniform(5, 60)
        track = phase_from_pulses(np.sort(np.concatenate((seen, doubles))), 1.0, turns.size)
        first, last = np.flatnonzero(there)[[0, -1]]
        missing = last - first + 1 - there.sum()
        dropped = f"{doubles.size} double pulses dropped, " if doubles.size else ""
        assert track.note == f"{dropped}{missing} missing pulses filled in"
        # Straight lines over the longest gap at 0.5 Hz/s, and four deviations of the jitter.
        gap_s = np.max(np.diff(pulses[there])) / RATE
        assert _error(track, turns) < 0.5 * gap_s**2 / 8 + 4 * 0.5 / RATE * 24


def test_pulses_halfway_between_the_true_ones_are_no_finer_wheel():
    turns = turns_of(10.0, 8.0, RATE)
    pulses = _pulses(turns)
    halves = 0.5 * (pulses[3:-1:10] + pulses[4::10])
    track = phase_from_pulses(np.sort(np.concatenate((pulses, halves))), 1.0, turns.size)
    assert track.note == f"{halves.size} double pulses dropped"
    assert _error(track, turns) < 1e-6


def test_a_wheel_with_two_teeth_left_out_is_counted_right():
    turns = turns_of(np.array([10.0, 11.0]), 4.0, RATE)
    pulses = _pulses(turns, 60.0)
    tooth = np.arange(pulses.size) % 60
    track = phase_from_pulses(pulses[tooth < 58], 60.0, turns.size)
    assert _error(track, turns) < 1e-4
    assert "missing pulses filled in" in track.note
    assert "double" not in track.note


def test_missing_and_double_pulses_on_a_ramp():
    turns = turns_of(np.array([8.0, 12.0]), 4.0, RATE)
    pulses = _pulses(turns)
    broken = np.sort(np.concatenate([np.delete(pulses, [5, 25]), pulses[[15, 33]] + 20.0]))
    track = phase_from_pulses(broken, 1.0, turns.size)
    assert _error(track, turns) < 8e-3  # two turns at 1 Hz/s without a pulse: 1 * 0.2^2 / 8 turns


def test_encoder_lines_give_the_angle_finely():
    turns = turns_of(np.array([10.0, 10.5, 9.8, 10.2]), 2.0, RATE)
    track = phase_from_pulses(_pulses(turns, 900.0), 900.0, turns.size)
    assert _error(track, turns) < 1e-5


@pytest.mark.parametrize("jitter", [0.05, 1.0])
def test_interval_holds_the_true_speed(jitter):
    inside = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        turns = turns_of(25.0, 2.0, RATE)
        pulses = _pulses(turns, start=rng.uniform(0.1, 0.9))
        pulses = pulses + jitter * rng.standard_normal(pulses.size)
        speed = window_speed([PulseTrain("shaft", 1.0, pulses)], turns.size, RATE, machine())
        assert speed.source == "tacho"
        inside += speed.ci95_hz[0] <= 25.0 <= speed.ci95_hz[1]
    assert inside >= 180


def test_pulses_of_another_shaft_count_by_its_ratio():
    plate = Machine("m", "", "shaft", (Shaft("shaft", 1.0, 20.0), Shaft("slow", 0.4, 8.0)))
    turns = turns_of(20.0, 2.0, RATE)
    train = PulseTrain("slow", 1.0, _pulses(0.4 * turns))
    speed = window_speed([train], turns.size, RATE, plate)
    assert speed.value_hz == pytest.approx(20.0, rel=1e-6)


def test_without_pulses_the_nameplate_speaks_and_says_so():
    speed = window_speed([PulseTrain("shaft", 1.0, np.array([5.0]))], 1000, RATE, machine())
    assert speed.source == "nameplate"
    assert speed.value_hz == 25.0
    assert speed.ci95_hz == pytest.approx((24.5, 25.5))
    assert "no tacho pulses" in speed.note


def test_unknown_speed_is_null_in_json():
    speed = window_speed([], 1000, RATE, machine(float("nan")))
    assert speed.to_json() == {"value": None, "ci95": None, "source": "nameplate"}


@pytest.mark.parametrize(
    ("samples", "turns"),
    [([0.0, 0.0], [0.0, 1.0]), ([0.0, 1.0], [1.0, 0.0]), ([0.0], [0.0]), ([0.0, 1.0, 2.0], [0.0, 1.0])],
)
def test_phase_must_ascend(samples, turns):
    with pytest.raises(InputError):
        Phase(np.array(samples), np.array(turns))
