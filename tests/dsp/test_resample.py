"""Angular resampling against closed forms: lines at known orders on shafts whose speed changes."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.signal import resample_poly

from gearsim_dsp.angle.resample import AngleSignal, full_rate, sample_positions, to_angle
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

RATE = 8192.0


def _ramp(from_hz, to_hz, seconds=4.0):
    """Turns at every sample, and the phase with one exact pulse in each turn."""
    t = np.arange(round(seconds * RATE)) / RATE
    slope = (to_hz - from_hz) / seconds
    turns = from_hz * t + 0.5 * slope * t**2
    whole = np.arange(0, np.floor(turns[-1]) + 1)
    at = whole / from_hz if slope == 0 else (np.sqrt(from_hz**2 + 2 * slope * whole) - from_hz) / slope
    return turns, Phase(at * RATE, whole)


def test_lines_of_a_shaft_that_speeds_up_keep_amplitude_and_phase():
    turns, phase = _ramp(9.0, 13.0)
    signal = np.cos(2 * np.pi * (32 * turns + 0.1)) + 0.3 * np.cos(2 * np.pi * 181.5 * turns)
    found = to_angle(signal, phase, full_rate(phase))
    expected = np.cos(2 * np.pi * (32 * found.turns + 0.1)) + 0.3 * np.cos(2 * np.pi * 181.5 * found.turns)
    # 181.5 orders reach 0.29 of the rate; the kernel's images lie below -80 dB. In the outermost turns the
    # spline through one pulse a turn errs by more.
    error = (found.values - expected)[3 * found.samples_per_turn : -3 * found.samples_per_turn]
    assert np.max(np.abs(error)) < 1e-4
    order, height = found.spectrum()
    assert order[np.argmax(height)] == pytest.approx(32, abs=1 / found.turn_count)
    assert np.max(height) == pytest.approx(1.0, rel=0.16)  # Hann: 1.4 dB at most between two lines


def test_first_turn_and_whole_turns_fall_on_samples():
    turns, phase = _ramp(10.0, 10.0)
    late = Phase(phase.samples[3:] + 17.25, phase.turns[3:] + 100.37)
    found = to_angle(np.cos(2 * np.pi * turns), late, 64)
    assert found.first_turn * 64 == pytest.approx(round(found.first_turn * 64), abs=1e-9)
    assert 103.37 <= found.first_turn < 103.37 + 1 / 64
    at, first = sample_positions(late, turns.size, 64)
    assert first == found.first_turn
    assert np.all(np.diff(at) > 0)


def test_constant_speed_equals_scipys_polyphase_resampling():
    rng = np.random.default_rng(1)
    x = resample_poly(rng.standard_normal(4096), 2, 1)  # nothing above half of the band
    turns = np.arange(x.size) / 64.0
    found = to_angle(x, Phase(np.array([0.0, x.size - 1.0]), turns[[0, -1]]), 96)
    theirs = resample_poly(x, 3, 2, window=("kaiser", 10.0))
    inner = slice(200, found.values.size - 200)
    # Both filters have their edges above the band used, so that only their ripple is left.
    assert np.max(np.abs(found.values[inner] - theirs[: found.values.size][inner])) < 2e-3


def test_orders_above_half_the_samples_per_turn_are_filtered_out_at_any_speed():
    turns, phase = _ramp(5.0, 20.0)
    low, high = np.cos(2 * np.pi * 10 * turns), np.cos(2 * np.pi * 45 * turns)
    found = to_angle(high, phase, 64).values[64:-64]
    assert np.std(found) < 2e-4  # it would fold back to 19 orders
    kept = to_angle(low, phase, 64)
    expected = np.cos(2 * np.pi * 10 * kept.turns)
    inner = slice(6 * 64, -6 * 64)  # an end error of a spline falls to 0.27 with each knot
    assert np.max(np.abs(kept.values - expected)[inner]) < 3e-4


def test_a_constant_stays_up_to_the_ends():
    _, phase = _ramp(9.0, 11.0)
    for per_turn in (16, 2000):
        assert to_angle(np.full(32768, 3.5), phase, per_turn).values == pytest.approx(3.5, rel=1e-12)


def test_another_shaft_turns_by_its_ratio():
    turns, phase = _ramp(10.0, 12.0)
    found = to_angle(np.cos(2 * np.pi * 21 * 0.4 * turns), phase, 256, ratio=0.4)
    assert found.turn_count == pytest.approx(0.4 * phase.turns[-1], abs=0.01)
    assert found.values[50:-50] == pytest.approx(np.cos(2 * np.pi * 21 * found.turns)[50:-50], abs=3e-4)


def test_full_rate_is_that_of_the_slowest_turn():
    _, phase = _ramp(8.0, 16.0)
    assert full_rate(phase) == pytest.approx(RATE / 8.0, rel=0.02)
    assert full_rate(phase, ratio=2.0) == pytest.approx(RATE / 16.0, rel=0.02)


def test_irregular_pulses_never_turn_back():
    rng = np.random.default_rng(3)
    at = np.cumsum(rng.choice([0.4, 9.0, 200.0], 300))
    phase = Phase(at, np.arange(300.0))
    positions, _ = sample_positions(phase, round(at[-1]), 128)
    assert np.all(np.diff(positions) >= 0)


def test_spline_through_few_pulses_beats_straight_lines():
    turns, phase = _ramp(6.0, 14.0)
    signal = np.cos(2 * np.pi * 60 * turns)
    found = to_angle(signal, phase, 512)
    straight = np.interp(found.turns, phase.turns, phase.samples)
    plain = CubicSpline(np.arange(signal.size), signal)(straight)
    expected = np.cos(2 * np.pi * 60 * found.turns)
    assert np.std(found.values - expected) < 0.01 * np.std(plain - expected)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"signal": np.zeros((2, 100))}, "signal"),
        ({"signal": np.append(np.zeros(400), np.nan)}, "finite"),
        ({"samples_per_turn": 1}, "samples_per_turn"),
        ({"ratio": 0.0}, "ratio"),
        ({"phase": Phase(np.array([900.0, 1000.0]), np.array([0.0, 1.0]))}, "phase"),
    ],
)
def test_bad_input_is_told(change, told):
    good = {
        "signal": np.zeros(500),
        "phase": Phase(np.array([0.0, 499.0]), np.array([0.0, 2.0])),
        "samples_per_turn": 32,
    } | change
    ratio = good.pop("ratio", 1.0)
    with pytest.raises(InputError, match=told):
        to_angle(good["signal"], good["phase"], good["samples_per_turn"], ratio=ratio)


def test_angle_signal_is_checked():
    with pytest.raises(InputError):
        AngleSignal(np.zeros((2, 2)), 4, 0.0)
    with pytest.raises(InputError):
        AngleSignal(np.zeros(4), 1, 0.0)
