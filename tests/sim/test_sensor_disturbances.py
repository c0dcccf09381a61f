"""What is added to the signal or takes it away: noise, drift, interference, dropouts."""

import itertools
import math

import numpy as np
import pytest
from chain_runs import run_chain, silence
from scipy import integrate, signal, special

from gearsim_sim.sensors.drift import Drift
from gearsim_sim.sensors.dropouts import Dropouts
from gearsim_sim.sensors.interference import Inverter, Mains, PhaseClock
from gearsim_sim.sensors.noise import LOWEST_HZ, _Shape
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.settings import Accel

RATE = 65536.0

# --- noise


def test_noise_rises_as_one_over_f_below_its_corner():
    rate, density, corner = 16_384.0, 2e-3, 200.0
    noise = run_chain([Row("c", "a", noise_density=density, noise_corner_hz=corner)], silence(1 << 22), rate)[
        0
    ]
    frequency, psd = signal.welch(noise, rate, nperseg=1 << 16, detrend=False)
    expected = density**2 * (1 + corner / frequency[1:])
    edges = [1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1000.0, 3000.0, 8000.0]
    for low, high in itertools.pairwise(edges):
        band = (frequency[1:] >= low) & (frequency[1:] < high)
        averages = 127 * band.sum()  # half-overlapping segments, bins
        ratio = np.mean(psd[1:][band] / expected[band])
        # 4 sigma of the estimate, and the promise of `noise`
        assert ratio == pytest.approx(1.0, abs=4 / math.sqrt(averages) + 0.01 + 2 * corner / rate)


def test_the_shape_is_the_formula_down_to_the_lowest_frequency():
    shape = _Shape(700.0, RATE)
    frequency = np.geomspace(3 * LOWEST_HZ, 20_000.0, 300)
    _, response = signal.sosfreqz(
        np.array([[b0, b1, b2, 1.0, a1, a2] for b0, b1, b2, a1, a2 in shape.sections]), frequency, fs=RATE
    )
    error = np.abs(np.abs(response) ** 2 / (1 + 700.0 / frequency) - 1)
    # Lorentzians that lie a factor r apart ripple by 4 exp(-pi^2 / ln r) = 0.3 %; those missing above 0.45
    # of the rate are 0.3 corner / (0.45 rate) = 0.7 %, those missing below 0.01 Hz 0.2 pole / f.
    middle = (frequency > 1) & (frequency < 3000)
    assert np.all(error[middle] < 0.01)
    assert np.all(error < 0.01 + 2 * 700.0 / RATE + 0.5 * LOWEST_HZ / frequency)


def test_flicker_is_stationary_from_the_first_sample():
    rate, count = 2048.0, 400
    rows = [Row(f"c{k}", "a", noise_density=1.0, noise_corner_hz=200.0) for k in range(count)]
    noise = run_chain(rows, silence(4096), rate)
    # White over half the rate and 1/f from 0.01 Hz up to about there.
    frequency = np.geomspace(1e-5, rate / 2, 40_000)
    zero = _Shape(200.0, rate)
    sos = np.array([[b0, b1, b2, 1.0, a1, a2] for b0, b1, b2, a1, a2 in zero.sections])
    _, response = signal.sosfreqz(sos, frequency, fs=rate)
    variance = integrate.trapezoid(np.abs(response) ** 2, frequency)
    for part in (noise[:, 0], noise[:, -1]):
        assert part.var() == pytest.approx(variance, rel=5 * math.sqrt(2 / count))


# --- drift


def test_charge_drift_is_a_lorentzian_of_its_rms_and_time():
    rate, rms, time = 4096.0, 0.7, 0.5
    drift = Drift[Accel](rms=f"{rms} m/s^2", time=f"{time} s")
    out = run_chain([Row("c", "a", drift=drift, offset=2.0)], silence(1 << 23), rate)[0]
    values = out.size / rate / (2 * time)
    assert out.mean() == pytest.approx(2.0, abs=4 * rms / math.sqrt(values))
    assert out.std() == pytest.approx(rms, rel=4 / math.sqrt(2 * values))
    frequency, psd = signal.welch(out, rate, nperseg=1 << 17)
    expected = 4 * rms**2 * time / (1 + (2 * np.pi * frequency * time) ** 2)
    for low, high in ((0.1, 0.3), (0.3, 1.0), (1.0, 3.0)):
        band = (frequency >= low) & (frequency < high)
        averages = 127 * band.sum()
        # 4 sigma; straight lines between knots 1/64 s apart take (pi f / 64)^2 / 3 x 2 < 2 % below 3 Hz
        assert np.mean(psd[band] / expected[band]) == pytest.approx(1.0, abs=4 / math.sqrt(averages) + 0.02)


# --- interference


def test_mains_lines_have_their_amplitudes_and_one_phase_for_all_channels():
    harmonics = {3: 0.5, 4: 0.0, 90: 1.0}
    rows = [
        Row(name, "a", mains=Mains[Accel](amplitude=amplitude, harmonics=harmonics))
        for name, amplitude in (("c", "0.2 m/s^2"), ("d", "0.8 m/s^2"))
    ]
    out = run_chain(rows, silence(16_384), 8192.0)
    lines = np.abs(np.fft.rfft(out[0])) * 2 / out.shape[1]
    assert lines[100] == pytest.approx(0.2, rel=1e-5)
    assert lines[300] == pytest.approx(0.1, rel=1e-5)
    rest = np.delete(lines, [100, 300])
    assert rest.max() < 1e-6  # float32; the 90th harmonic, 4500 Hz, is beyond half the rate
    np.testing.assert_allclose(out[1], 4 * out[0], atol=1e-6)


def test_mains_phase_is_exact_after_days():
    clock = PhaseClock(50.0, 48_000.0)  # 50 / 48000 is no binary fraction
    day = 86400 * 48_000
    turns = clock.turns(3 * day + 12_345, 40_000)
    exact = np.array([(50 * (3 * day + 12_345 + k)) % 48_000 for k in (0, 39_999)]) / 48_000
    np.testing.assert_allclose(np.mod(turns[[0, -1]], 1.0), exact, rtol=0, atol=1e-12)


def _bare_pwm(carrier_hz, output_hz, modulation, rate):
    """Sine against triangle, the way an inverter does it, at a rate far above the carrier."""
    time = np.arange(int(rate)) / rate
    triangle = 2 / np.pi * np.arcsin(np.sin(2 * np.pi * carrier_hz * time))
    return np.where(modulation * np.cos(2 * np.pi * output_hz * time) > triangle, 1.0, -1.0)


def test_inverter_lines_are_those_of_pulse_width_modulation():
    carrier, output, index = 4000.0, 50.0, 0.8
    inverter = Inverter[Accel](
        amplitude="1 m/s^2", carrier="4 kHz", output="50 Hz", modulation=index, multiples=3
    )
    out = run_chain([Row("c", "a", inverter=inverter)], silence(65536))[0]
    lines = np.abs(np.fft.rfft(out)) * 2 / out.size  # 1 Hz per bin
    assert lines[4000] == pytest.approx(1.0, rel=1e-3)
    # Bessel amplitudes (Holmes and Lipo), times m for the capacitance
    for m in (1, 2, 3):
        for n in range(-6, 7):
            amplitude = special.jv(abs(n), m * np.pi * index / 2) if (m + n) % 2 else 0.0
            amplitude /= special.jv(0, np.pi * index / 2)
            assert lines[round(m * carrier + n * output)] == pytest.approx(abs(amplitude), abs=2e-3)
    # and against a comparator: its derivative, so each line times its frequency
    rate = 4_000_000.0
    bare = np.abs(np.fft.rfft(_bare_pwm(carrier, output, index, rate))) * np.arange(int(rate) // 2 + 1)
    bare /= bare[4000]
    for m, n in ((1, 2), (1, -2), (2, 1), (2, -3), (3, 0), (3, 2)):
        place = round(m * carrier + n * output)
        # The model leaves out the slow change of the duty cycle, n output / (m carrier) < 5 % of a line; a
        # comparator at 4 MHz errs by a sample in the 1000 of a carrier period.
        assert lines[place] == pytest.approx(bare[place], rel=0.06, abs=0.01)


def test_inverter_groups_beyond_the_band_are_left_out():
    inverter = Inverter[Accel](amplitude="1 m/s^2", carrier="10 kHz", multiples=8)
    out = run_chain([Row("c", "a", inverter=inverter)], silence(65536))[0]
    lines = np.abs(np.fft.rfft(out)) * 2 / out.size
    assert lines[10_000] > 0.9
    near = np.abs(np.arange(lines.size)[:, None] - np.array([10_000, 20_000, 30_000])).min(axis=1)
    assert lines[near > 1500].max() < 1e-3  # 40 kHz would fold to 25.5 kHz


# --- dropouts


def _bursts(values):
    lost = np.concatenate([[False], values == 0.0, [False]])
    edges = np.flatnonzero(np.diff(lost.astype(int)))
    return edges[::2], edges[1::2]


def test_dropouts_come_and_last_as_they_should():
    rate = 10_000.0
    row = Row("c", "a", dropouts=Dropouts(rate="2 Hz", duration="20 ms"))
    out = run_chain([row], np.ones((2, 10_000_000)), rate)[0]
    starts, ends = _bursts(out)
    count = starts.size
    mean = 10_000_000 / ((0.5 + 0.02) * rate)  # a burst per gap and length
    assert count == pytest.approx(mean, abs=4 * math.sqrt(mean))
    lengths = (ends - starts)[:-1] / rate
    gaps = (starts[1:] - ends[:-1]) / rate
    for values, expected in ((lengths, 0.02), (gaps, 0.5)):
        assert values.mean() == pytest.approx(expected, rel=4 / math.sqrt(count))
        assert values.std() == pytest.approx(expected, rel=8 / math.sqrt(count))  # exponential
    assert set(np.unique(out)) == {0.0, 1.0}


def test_dropouts_hold_or_lie_at_the_rail():
    rate = 10_000.0
    ramp = np.vstack([np.arange(200_000) / 200_000] * 2)
    zero, hold, rail = run_chain(
        [
            Row("c", "a", full_scale=5.0, dropouts=Dropouts(rate="2 Hz", duration="20 ms", shows=shows))
            for shows in ("zero", "hold", "rail")
        ],
        ramp,
        rate,
    )
    starts, ends = _bursts(zero[1:])
    assert starts.size > 10
    for start, end in zip(starts + 1, ends + 1, strict=True):
        np.testing.assert_allclose(hold[start:end], ramp[0, start - 1], rtol=1e-6)
        assert np.all(rail[start:end] == 5.0)
    kept = zero != 0.0
    np.testing.assert_array_equal(hold[kept], zero[kept])
