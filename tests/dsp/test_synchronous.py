"""Synchronous averages, what is regular in them, and indicators: against signals with known answers."""

import numpy as np
import pytest
from scipy import signal, stats

from gearsim_dsp.angle.resample import AngleSignal
from gearsim_dsp.features import rms
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.indicators import (
    energy_ratio,
    fm0,
    fm4,
    gear_indicators,
    m6a,
    m8a,
    na4,
    nb4,
    sideband_level,
    variance,
)
from gearsim_dsp.synchronous.modulation import demodulate_mesh, mesh_envelope
from gearsim_dsp.synchronous.signals import difference_signal, regular_signal, residual_signal
from gearsim_dsp.synchronous.tsa import (
    Average,
    merged,
    shaft_average,
    synchronous_average,
    synchronous_part,
)
from gearsim_io.errors import InputError

TEETH = 32


def of(values, turns_per_period=1):
    """An average without noise."""
    values = np.asarray(values, dtype=float)
    return Average(values, np.zeros(values.size), 2, turns_per_period)


def turn(samples=1024):
    return np.arange(samples) / samples


def wave(order, amplitude=1.0, phase=0.0, samples=1024):
    return amplitude * np.cos(2 * np.pi * order * turn(samples) + phase)


# --- averages ---------------------------------------------------------------------------------------------


def test_what_repeats_comes_out_at_its_angle_and_what_does_not_falls_by_the_number_of_turns():
    rng = np.random.default_rng(1)
    turns, per_turn = 400, 256
    at = 0.25 + np.arange(turns * per_turn) / per_turn
    pattern = np.cos(2 * np.pi * 7 * at) + 0.3 * np.sin(2 * np.pi * 31 * at)
    noise = rng.normal(size=at.size)
    average = synchronous_average(AngleSignal(pattern + noise, per_turn, 0.25))
    error = average.values - (
        np.cos(2 * np.pi * 7 * average.turns) + 0.3 * np.sin(2 * np.pi * 31 * average.turns)
    )
    # rms of the mean of 400: 1/20, known to 1/sqrt(2*256) = 4.4 %, of which four.
    assert rms(error) == pytest.approx(0.05, rel=0.18)
    assert average.noise_rms == pytest.approx(0.05, rel=0.02)
    assert average.count == turns


def test_turns_of_one_half_order_need_a_period_of_two_turns():
    per_turn = 64
    at = np.arange(20 * per_turn) / per_turn
    half = AngleSignal(np.cos(2 * np.pi * 2.5 * at), per_turn, 0.0)
    assert np.ptp(synchronous_average(half).values) < 1e-12
    two = synchronous_average(half, turns_per_period=2)
    orders, amplitude = two.spectrum()
    assert orders[np.argmax(amplitude)] == 2.5
    assert amplitude[two.line(2.5)] == pytest.approx(1.0)


def test_too_short_a_record_is_told_how_long_it_must_be():
    signal = AngleSignal(np.zeros(190), 100, 0.0)
    with pytest.raises(InputError, match=r"1.90 turns, expected 2 turns or more"):
        synchronous_average(signal)
    with pytest.raises(InputError, match="expected 6 turns or more"):
        synchronous_average(signal, turns_per_period=3)


def test_a_stream_of_averages_is_the_average_of_all():
    rng = np.random.default_rng(2)
    values = rng.normal(size=17 * 50) + 3.0
    whole = synchronous_average(AngleSignal(values.copy(), 50, 0.0))
    parts = [AngleSignal(values[a:b].copy(), 50, a / 50) for a, b in ((0, 200), (200, 300), (300, 850))]
    first, second, third = (synchronous_average(part) for part in parts)
    both = merged(merged(first, second), third)
    assert both.count == whole.count
    np.testing.assert_allclose(both.values, whole.values, rtol=1e-12)
    np.testing.assert_allclose(both.std, whole.std, rtol=1e-12)
    with pytest.raises(InputError, match="50 samples in 1 turns"):
        merged(whole, of(np.zeros(60)))


def speeding_record(seconds=6.0, rate=8192.0):
    """A record of two shafts, 1 and 32/90, whose speed rises by a tenth."""
    n = int(seconds * rate)
    t = np.arange(n) / rate
    turns = 10.0 * t + 0.5 * t**2 / seconds
    phase = Phase(np.arange(0.0, n, 8.0), turns[::8])
    phase = Phase(np.append(phase.samples, n - 1.0), np.append(phase.turns, turns[-1]))
    fast = np.cos(2 * np.pi * 32 * turns) * (1 + 0.2 * np.cos(2 * np.pi * turns + 1.0))
    slow = 0.7 * np.cos(2 * np.pi * 45 * turns * 32 / 90 + 0.4)
    return fast, slow, phase


def test_each_shaft_has_its_average_while_the_speed_changes():
    fast, slow, phase = speeding_record()
    first = shaft_average(fast + slow, phase, samples_per_turn=512)
    second = shaft_average(fast + slow, phase, ratio=32 / 90, samples_per_turn=512)
    # 63 and 22 turns: the other shaft's lines, not periodic here, are left with about 1/63 and 1/22.
    assert first.spectrum()[1][[31, 32, 33]] == pytest.approx([0.1, 1.0, 0.1], abs=0.02)
    assert second.spectrum()[1][45] == pytest.approx(0.7, abs=0.03)
    assert 60 <= first.count <= 63


@pytest.mark.parametrize(("ratio", "samples_per_turn"), [(1.0, 128), (32 / 90, 180), (32 / 90, None)])
def test_what_one_shaft_brings_is_taken_out_of_the_record(ratio, samples_per_turn):
    """With as few as four samples to a wave."""
    fast, slow, phase = speeding_record()
    own, other = (fast, slow) if ratio == 1 else (slow, fast)
    average = shaft_average(own, phase, ratio=ratio, samples_per_turn=samples_per_turn)
    left = fast + slow - synchronous_part(average, phase, fast.size, ratio=ratio)
    inside = slice(200, -200)
    # Resampling there and back: the interpolators' own errors (1e-4 each) on an amplitude of 1.
    assert rms((left - other)[inside]) < 5e-4
    with pytest.raises(InputError, match="synchronous_part"):
        synchronous_part(average, Phase(np.array([5.0, 900.0]), np.array([0.0, 1.0])), 900)


# --- regular, residual, difference --------------------------------------------------------------------------


def gear_wave():
    regular = 0.2 + wave(1, 0.5) + wave(2, 0.1) + wave(32) + wave(31, 0.2) + wave(33, 0.1) + wave(64, 0.4)
    return regular, wave(3, 0.05) + wave(34, 0.02) + wave(100, 0.03)


def test_lines_fall_where_they_belong_and_both_parts_add_up():
    regular, rest = gear_wave()
    average = of(regular + rest)
    np.testing.assert_allclose(regular_signal(average, [TEETH]), regular, atol=1e-12)
    np.testing.assert_allclose(difference_signal(average, [TEETH]), rest, atol=1e-12)
    np.testing.assert_allclose(
        residual_signal(average, [TEETH]), rest + wave(31, 0.2) + wave(33, 0.1), atol=1e-12
    )
    more = difference_signal(average, [TEETH], 2, shaft_harmonics=3)
    np.testing.assert_allclose(more, wave(100, 0.03), atol=1e-12)


def test_lines_of_averages_over_several_turns():
    values = np.tile(gear_wave()[0], 2)
    half = 0.1 * np.cos(2 * np.pi * 16.5 * np.arange(2048) / 1024)
    average = of(values + half, turns_per_period=2)
    np.testing.assert_allclose(difference_signal(average, [TEETH]), half, atol=1e-12)
    np.testing.assert_allclose(regular_signal(average, [TEETH]), values, atol=1e-12)
    assert np.ptp(difference_signal(average, [TEETH, 16.5])) < 1e-12


@pytest.mark.parametrize(
    ("orders", "count", "field"), [([12.5], 1, "order"), ([0], 1, "mesh_orders"), ([4], 2, "sideband_count")]
)
def test_lines_that_cannot_be_are_refused(orders, count, field):
    with pytest.raises(InputError, match=field):
        difference_signal(of(gear_wave()[0]), orders, count)


# --- indicators ---------------------------------------------------------------------------------------------


def test_indicators_of_noise_and_of_a_sine():
    noise = np.random.default_rng(3).normal(size=1_000_000)
    # Standard errors over a million values: sqrt(24), sqrt(10170), sqrt(2.0e6) / 1000; four of them.
    assert fm4(noise) == pytest.approx(3, abs=0.02)
    assert m6a(noise) == pytest.approx(15, abs=0.4)
    assert m8a(noise) == pytest.approx(105, abs=6)
    sine = wave(5)
    assert (fm4(sine), m6a(sine), m8a(sine)) == pytest.approx((1.5, 2.5, 4.375))


def test_moments_are_those_of_scipy():
    x = np.random.default_rng(5).gamma(2.0, size=5000)
    assert fm4(x) == pytest.approx(stats.kurtosis(x, fisher=False), rel=1e-12)
    assert m6a(x) == pytest.approx(stats.moment(x, 6) / np.var(x) ** 3, rel=1e-12)
    assert m8a(x) == pytest.approx(stats.moment(x, 8) / np.var(x) ** 4, rel=1e-12)


def test_fm0_is_the_swing_over_the_mesh_lines():
    # In phase at angle 0, so that the peak is the sum: (1.4 + trough) / (1 + 0.4).
    average = of(wave(32) + wave(64, 0.4))
    trough = np.min(np.cos(np.linspace(0, 2 * np.pi, 33)) + 0.4 * np.cos(2 * np.linspace(0, 2 * np.pi, 33)))
    assert fm0(average, [TEETH]) == pytest.approx((1.4 - trough) / 1.4)
    impulse = wave(32)
    impulse[100] += 10
    assert fm0(of(impulse), [TEETH]) > 4


def test_energy_ratio_and_sidebands_of_known_amplitudes():
    assert energy_ratio(wave(3, 0.3), wave(5, 2.0)) == pytest.approx(0.15)
    average = of(wave(32, 2.0) + wave(31, 0.3) + wave(33, 0.1))
    assert sideband_level(average, TEETH) == pytest.approx(0.4 / np.sqrt((4 + 0.09 + 0.01) / 2))


def test_na4_grows_with_the_level_where_fm4_does_not():
    rng = np.random.default_rng(4)
    runs = [rng.normal(size=4096) for _ in range(99)]
    earlier = [variance(run) for run in runs]
    worse = 2.0 * rng.normal(size=4096)
    # 16 m4 over the mean variance (99 + 4) / 100, squared: 16 * 3 / 1.03^2.
    assert na4(worse, earlier) == pytest.approx(48 / 1.03**2, rel=0.1)
    assert fm4(worse) == pytest.approx(3, abs=0.4)
    assert na4(runs[0]) == pytest.approx(fm4(runs[0]))
    with pytest.raises(InputError, match="earlier_variances"):
        na4(worse, [-1.0])


def test_nb4_is_na4_of_the_envelope():
    average = of((1 + 0.4 * wave(3)) * wave(32))
    envelope = mesh_envelope(average, TEETH)
    np.testing.assert_allclose(envelope, 1 + 0.4 * wave(3), atol=1e-12)
    assert nb4(envelope) == pytest.approx(1.5)
    assert nb4(envelope, [variance(envelope) / 4] * 3) == pytest.approx(1.5 / (1.75 / 4) ** 2)


def test_all_at_once_are_the_single_ones_and_nothing_divides_by_nothing():
    regular, rest = gear_wave()
    average = of(regular + rest)
    found = gear_indicators(average, TEETH, earlier_residual=[0.01])
    assert found.fm4 == fm4(difference_signal(average, [TEETH]))
    assert found.na4 == na4(residual_signal(average, [TEETH]), [0.01])
    assert found.energy_ratio == pytest.approx(
        np.sqrt((0.05**2 + 0.02**2 + 0.03**2) / (0.25 + 0.01 + 1 + 0.04 + 0.01 + 0.16)), rel=1e-9
    )
    silent = gear_indicators(of(np.zeros(256)), TEETH)
    assert np.isnan([silent.fm0, silent.fm4, silent.m6a, silent.na4, silent.energy_ratio]).all()


# --- demodulation -------------------------------------------------------------------------------------------


def test_modulations_come_out_as_they_were_put_in():
    a = 0.3 * np.cos(2 * np.pi * turn()) + 0.1 * np.sin(2 * np.pi * 3 * turn())
    p = 0.4 * np.sin(2 * np.pi * 2 * turn())
    average = of(2.0 * (1 + a) * np.cos(2 * np.pi * 64 * turn() + 0.7 + p) + wave(32, 5.0))
    found = demodulate_mesh(average, TEETH, harmonic=2)
    # J_k(0.4) beyond the 15 lines kept (k > 7) is below 1e-9.
    np.testing.assert_allclose(found.amplitude, a, atol=1e-8)
    np.testing.assert_allclose(found.phase_rad, p, atol=1e-8)
    assert found.mean_amplitude == pytest.approx(2.0)
    assert found.sideband_count == 15


@pytest.mark.parametrize("samples", [1024, 1025])
def test_demodulation_is_that_of_scipys_hilbert(samples):
    """Of the same band, whose lines are cut out by a transform of numpy's."""
    x = np.random.default_rng(6).normal(size=samples) + 5 * wave(32, samples=samples)
    lines = np.fft.rfft(x)
    lines[np.abs(np.arange(lines.size) - 32) > 10] = 0
    analytic = signal.hilbert(np.fft.irfft(lines, samples))
    np.testing.assert_allclose(mesh_envelope(of(x), TEETH, sideband_count=10), np.abs(analytic), atol=1e-12)
    found = demodulate_mesh(of(x), TEETH, sideband_count=10)
    phase = np.unwrap(np.angle(analytic)) - 2 * np.pi * 32 * turn(samples)
    np.testing.assert_allclose(found.phase_rad, phase - phase.mean(), atol=1e-9)
    np.testing.assert_allclose(found.amplitude, np.abs(analytic) / np.abs(analytic).mean() - 1, atol=1e-9)


def test_a_soft_tooth_shows_at_its_angle():
    dip = np.exp(-0.5 * ((turn() - 0.3) / 0.02) ** 2)
    average = of((1 - 0.2 * dip) * np.cos(2 * np.pi * 32 * turn() - 0.5 * dip))
    found = demodulate_mesh(average, TEETH)
    assert turn()[np.argmin(found.amplitude)] == pytest.approx(0.3, abs=0.02)
    assert turn()[np.argmin(found.phase_rad)] == pytest.approx(0.3, abs=0.02)


def test_what_cannot_be_demodulated_is_refused():
    with pytest.raises(InputError, match="stronger than its sidebands"):
        demodulate_mesh(of(wave(32, 0.1) + wave(33)), TEETH)
    with pytest.raises(InputError, match="sideband_count"):
        demodulate_mesh(of(wave(32)), TEETH, sideband_count=16)
    with pytest.raises(InputError, match="samples per turn"):
        demodulate_mesh(of(wave(32, samples=80)), TEETH)
