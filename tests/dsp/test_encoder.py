"""Angles from encoders against closed forms, and against the simulator's own transmission error."""

import numpy as np
import pytest

from gearsim_dsp.angle.encoder import (
    angular_deviation,
    encoder_phase,
    line_errors,
    phase_from_wave,
    transmission_error,
    without_line_errors,
)
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError
from gearsim_io.record import EdgeTrain

RATE = 65536.0
LINES = 900


def _edges(turns, lines=LINES, first=0):
    """Exact moments of the lines in samples, for an angle given at every sample."""
    wanted = np.arange(np.ceil(turns[0] * lines), np.floor(turns[-1] * lines) + 1) / lines
    return EdgeTrain("input", lines, first, np.interp(wanted, turns, np.arange(turns.size)))


def _even(speed_hz=10.0, seconds=3.0):
    return speed_hz * np.arange(round(seconds * RATE)) / RATE


def test_edges_become_an_angle_that_knows_its_zero():
    turns = _even() + 1e-4 * np.sin(2 * np.pi * 3 * _even())
    edges = _edges(turns, first=450)
    broken = EdgeTrain("input", LINES, 450, np.delete(edges.samples, [700, 701, 5000]))
    phase = encoder_phase(broken, turns.size)
    found = np.interp(np.arange(turns.size), phase.samples, phase.turns)
    # Two lines are lost at one place: 3 / 900 turns of a straight line through a wave of 1e-4 turns.
    assert np.max(np.abs(found - turns - 0.5)) < 2e-6


def test_a_sampled_wave_gives_the_same_angle_as_its_edges():
    base = _even()
    torsion = 2e-4 * np.sin(2 * np.pi * 32 * base)
    turns = base + torsion
    rng = np.random.default_rng(0)
    for wave in (np.cos(2 * np.pi * 180 * turns), np.sign(np.cos(2 * np.pi * 180 * turns))):
        signal = 2.5 + wave + 0.05 * rng.standard_normal(turns.size)
        phase = phase_from_wave(signal, RATE, 180, 10.4)
        found = np.interp(np.arange(turns.size), phase.samples, phase.turns)
        inside = (np.arange(turns.size) > 2000) & (np.arange(turns.size) < turns.size - 2000)
        error = (found - turns)[inside]
        # A pulse's harmonics fold back around the carrier: 36 samples a line leave 1 / 36^2 of a cycle.
        assert np.std(error) < 1.0 / 180 / 36**2 * 8
        assert np.polyfit(base[inside], found[inside] - base[inside], 1)[0] == pytest.approx(0, abs=1e-6)


def test_torsional_vibration_has_its_amplitude_and_sign():
    base = _even(seconds=2.0)
    turns = base + 3e-4 / (2 * np.pi) * np.sin(2 * np.pi * 32 * base)
    found = angular_deviation(encoder_phase(_edges(turns), turns.size), 900)
    inner = slice(4 * 900, -4 * 900)
    expected = 3e-4 * np.sin(2 * np.pi * 32 * found.turns)
    assert np.max(np.abs(found.values - expected)[inner]) < 3e-4 * 0.01


def test_slow_changes_of_speed_are_no_torsional_vibration():
    t = np.arange(round(3 * RATE)) / RATE
    turns = 10 * t + 0.5 * t**2
    found = angular_deviation(encoder_phase(_edges(turns), turns.size), 90)
    assert np.max(np.abs(found.values)[5 * 90 : -5 * 90]) < 0.05  # 5 Hz gained in 3 s, over 4 turns


@pytest.mark.parametrize(("driving", "driven"), [(32, 32), (32, 49)])
def test_transmission_error_between_two_encoders(driving, driven):
    base = _even()
    mesh = 4e-6 * np.cos(2 * np.pi * driving * base) + 1e-6 * np.cos(2 * np.pi * base + 0.4)
    radius = 0.045
    driven_turns = (base - mesh / (2 * np.pi * radius)) * driving / driven
    found = transmission_error(
        encoder_phase(_edges(base), base.size),
        encoder_phase(_edges(driven_turns), base.size),
        driving,
        driven,
        samples_per_turn=900,
        base_radius_m=radius,
    )
    assert found.unit == "m"
    turns = found.signal.turns
    expected = 4e-6 * np.cos(2 * np.pi * driving * turns) + 1e-6 * np.cos(2 * np.pi * turns + 0.4)
    error = (found.signal.values - expected)[900:-900]
    # The driven side is a cubic through its 900 lines: 28 knots in a mesh period of 32.
    assert np.max(np.abs(error - error.mean())) < 4e-8


def test_common_torsion_and_speed_cancel_in_the_transmission_error():
    base = _even() + 1e-3 * np.sin(2 * np.pi * 0.7 * _even())
    phase = encoder_phase(_edges(base), base.size)
    found = transmission_error(phase, phase, 32, 32, samples_per_turn=900)
    assert found.unit == "rad"
    assert np.max(np.abs(found.signal.values)) < 1e-9


def test_teeth_that_contradict_the_encoders_are_told():
    phase = encoder_phase(_edges(_even()), _even().size)
    with pytest.raises(InputError, match="turns of the driven shaft"):
        transmission_error(phase, phase, 32, 33, samples_per_turn=900)


def test_a_disc_with_uneven_lines_is_corrected():
    rng = np.random.default_rng(2)
    lines = 60
    offsets = 0.05 / lines * rng.standard_normal(lines)
    k = np.arange(lines * 25)
    angle = k / lines + offsets[k % lines]
    pulses = np.interp(angle, 10.0 * np.arange(RATE * 2.6) / RATE, np.arange(RATE * 2.6))
    found = line_errors(pulses, lines)
    assert found == pytest.approx(offsets - offsets.mean(), abs=1e-7)
    true = without_line_errors(k / lines, found)
    assert np.std(true - angle - np.mean(true - angle)) < 1e-7


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: encoder_phase(EdgeTrain("input", 900, 0, np.array([3.0])), 100), "two edges"),
        (lambda: phase_from_wave(np.zeros(10), RATE, 900, 10.0), "finite samples"),
        (lambda: phase_from_wave(np.zeros(1000), RATE, 900, 30.0), "sample_rate"),
        (lambda: phase_from_wave(np.random.default_rng(1).standard_normal(9000), RATE, 90, 10.0), "carrier"),
        (lambda: phase_from_wave(np.arange(1000.0), RATE, 90, 10.0), "carrier"),  # only a drift
        (lambda: line_errors(np.arange(10.0), 5), "4 turns"),
        (lambda: angular_deviation(Phase(np.array([0.0, 99.0]), np.array([0.0, 3.0])), 30), "8 turns"),
    ],
)
def test_bad_input_is_told(call, told):
    with pytest.raises(InputError, match=told):
        call()
