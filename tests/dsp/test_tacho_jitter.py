import numpy as np
import pytest
from bearing_signals import turns_of

from gearsim_dsp.angle.tacho import smoothed_phase
from gearsim_dsp.speed import Phase, phase_from_pulses
from gearsim_io.errors import InputError

RATE = 10_000.0


def _pulses(turns, per_turn=1.0):
    wanted = np.arange(1.0, turns[-1] * per_turn) / per_turn
    return np.interp(wanted, turns, np.arange(turns.size))


def _error(phase, turns):
    found = np.interp(np.arange(turns.size), phase.samples, phase.turns)
    inner = slice(turns.size // 20, -turns.size // 20)
    difference = (found - turns)[inner]
    return float(np.std(difference))


@pytest.mark.parametrize("speeds", [[25.0, 25.0], [20.0, 30.0], [24.0, 26.0, 24.5, 25.5]])
def test_jitter_is_taken_out_and_the_shaft_is_followed(speeds):
    turns = turns_of(np.array(speeds), 8.0, RATE)
    rng = np.random.default_rng(1)
    exact = _pulses(turns)
    pulses = exact + 4.0 * rng.standard_normal(exact.size)
    rough = phase_from_pulses(pulses, 1.0, turns.size).phase
    # 200 pulses, and a course of a handful of free values: the scatter falls by sqrt(200 / 20) or more.
    assert _error(smoothed_phase(rough), turns) < _error(rough, turns) / 3


def test_without_jitter_nothing_is_lost():
    base = turns_of(10.0, 6.0, RATE)
    turns = base + 0.01 * np.sin(2 * np.pi * base / 8)
    clean = phase_from_pulses(_pulses(turns, 12.0), 12.0, turns.size).phase
    assert _error(smoothed_phase(clean), turns) < 1.2 * _error(clean, turns) + 1e-6


def test_jitter_of_an_encoder_does_not_hide_torsion():
    base = turns_of(10.0, 3.0, RATE * 6)
    turns = base + 2e-4 * np.sin(2 * np.pi * 5 * base)
    rng = np.random.default_rng(2)
    exact = _pulses(turns, 100.0)
    rough = Phase(exact + 0.5 * rng.standard_normal(exact.size), np.arange(1, exact.size + 1) / 100.0)
    smooth = smoothed_phase(rough)
    wave = np.interp(smooth.samples, np.arange(turns.size), turns - base)
    found = smooth.turns - np.interp(smooth.samples, np.arange(base.size), base)
    inner = slice(100, -100)
    # Jitter of 0.5 / 6000 turns; a wave takes 20 pulses, of which a free spline needs four or five.
    assert np.std((found - wave)[inner]) < 0.5 * 0.5 / 6000


def test_too_few_pulses_are_told():
    with pytest.raises(InputError, match="12 pulses"):
        smoothed_phase(Phase(np.arange(5.0), np.arange(5.0)))
