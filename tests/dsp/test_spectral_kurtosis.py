"""Spectral kurtosis and scalar indicators: closed forms, scipy's transform, false alarms, records."""

import numpy as np
import pytest
from bearing_signals import defect, noise, turns_of
from scipy.signal import spectrogram
from scipy.signal.windows import hann
from scipy.stats import kurtosis as scipy_kurtosis
from scipy.stats import skew

from gearsim_dsp import features
from gearsim_dsp.impulsive.spectral_kurtosis import spectral_kurtosis
from gearsim_io.errors import InputError

RATE = 24_000.0


def test_equals_its_definition_on_scipys_transform():
    """Windows side by side without overlap, so that their number is exact."""
    x = np.random.default_rng(0).standard_normal(64 * 128)
    x[::500] += 5
    x -= x.mean()
    ours = spectral_kurtosis(x, RATE, 128, 128)
    frequency, _, lines = spectrogram(
        x, RATE, hann(128, sym=False), nperseg=128, noverlap=0, detrend=False, mode="complex"
    )
    lines = lines[1:-1]
    second, fourth = np.mean(np.abs(lines) ** 2, axis=1), np.mean(np.abs(lines) ** 4, axis=1)
    k = 64
    want = (k + 1) / (k - 1) * (fourth / second**2 - 1) - 1
    np.testing.assert_allclose(ours.values, want, atol=1e-9)
    np.testing.assert_allclose(ours.frequency_hz, frequency[1:-1])
    assert ours.independent == pytest.approx(k)


def test_noise_has_zero_and_a_line_minus_one():
    rng = np.random.default_rng(1)
    x = noise(rng, 200_000, 0.7)
    kurtosis = spectral_kurtosis(x, RATE, 256)
    # 128 lines, of which neighbours depend on each other: three standard errors of 1.5 lines each.
    assert abs(np.mean(kurtosis.values)) < 3 * 2 / np.sqrt(kurtosis.independent * 127 / 1.5)
    assert np.std(kurtosis.values) == pytest.approx(2 / np.sqrt(kurtosis.independent), rel=0.25)
    assert np.sum(kurtosis.mean_square) == pytest.approx(1.0, rel=0.03)
    line = spectral_kurtosis(x + 50 * np.cos(2 * np.pi * 0.125 * np.arange(x.size)), RATE, 256)
    assert line.values[31] == pytest.approx(-1.0, abs=0.01)


def test_noise_that_is_there_a_share_of_the_time_has_the_kurtosis_of_its_share():
    """Present in a share p of whole windows: <|X|^4> / <|X|^2>^2 = 2 / p, so SK = 2 / p - 2."""
    rng = np.random.default_rng(2)
    on = np.repeat(np.arange(4000) % 5 == 0, 128)
    kurtosis = spectral_kurtosis(noise(rng, on.size) * on, RATE, 128, 128)
    assert np.mean(kurtosis.values) == pytest.approx(2 / 0.2 - 2, rel=0.03)


def test_false_alarms_are_what_was_asked_for():
    rng = np.random.default_rng(3)
    found = [spectral_kurtosis(noise(rng, 20_000), RATE, 128) for _ in range(150)]
    share = np.mean([np.max(f.values) > f.chance_limit(0.1) for f in found])
    assert 0.01 <= share <= 0.1 + 3 * np.sqrt(0.1 * 0.9 / 150)
    # 150 records of 63 lines: their scatter is known to better than one percent.
    assert np.std([f.values for f in found]) == pytest.approx(2 / np.sqrt(found[0].independent), rel=0.04)


def test_the_wiener_filter_brings_impacts_out_of_noise():
    rng = np.random.default_rng(4)
    turns = turns_of(25.0, 4.0, RATE)
    ball = defect(rng, turns, RATE, 3.245, resonance_hz=5000.0, damping=0.03).x
    x = 0.5 * ball + noise(rng, turns.size)
    kurtosis = spectral_kurtosis(x, RATE, 128)
    assert 4500 < kurtosis.frequency_hz[np.argmax(kurtosis.values)] < 5500
    filtered = kurtosis.filtered(x)
    assert filtered.shape == x.shape
    assert features.kurtosis(filtered) > 1.5 * features.kurtosis(x)
    assert np.corrcoef(filtered, ball)[0, 1] > 1.3 * np.corrcoef(x, ball)[0, 1]
    # Noise alone: the share of windows with a false alarm is one in a thousand.
    quiet = spectral_kurtosis(noise(rng, 30_000), RATE, 128)
    assert np.all(quiet.wiener_gain() == 0)
    assert np.all(quiet.filtered(np.ones(500)) == 0)


def test_the_filter_keeps_to_a_band():
    rng = np.random.default_rng(8)
    x = noise(rng, 100_000)
    for place in (0.1, 0.4):
        ring = np.exp(-np.arange(60) / 10) * np.cos(2 * np.pi * place * np.arange(60))
        for k in range(0, x.size - 60, 1000):
            x[k : k + 60] += 8 * ring
    kurtosis = spectral_kurtosis(x, RATE, 128)
    gain, inside = kurtosis.wiener_gain(), kurtosis.wiener_gain(band_hz=(0.0, 6000.0))
    assert gain[kurtosis.frequency_hz > 6000.0].max() > 0.3
    assert np.all(inside[kurtosis.frequency_hz > 6000.0] == 0)
    assert inside.max() == 1.0
    lines = np.abs(np.fft.rfft(kurtosis.filtered(x, band_hz=(0.0, 6000.0)) * np.hanning(x.size)))
    assert lines[: lines.size // 2].max() > 100 * lines[int(0.6 * lines.size) :].max()
    with pytest.raises(InputError, match="band_hz"):
        kurtosis.wiener_gain(band_hz=(5000.0, 100.0))


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="at least 1024 samples"):
        spectral_kurtosis(np.ones(1000), RATE, 128)
    with pytest.raises(InputError, match="hop_samples"):
        spectral_kurtosis(np.ones(2000), RATE, 128, 129)
    with pytest.raises(InputError, match="false_alarm"):
        spectral_kurtosis(noise(np.random.default_rng(5), 2000), RATE, 128).chance_limit(0.0)


def test_scalar_indicators_of_a_sine_of_noise_and_of_scipy():
    t = np.arange(100_000)
    sine = 3 * np.sin(2 * np.pi * t / 1000)
    assert features.peak(sine) == pytest.approx(3.0)
    assert features.shape_factor(sine) == pytest.approx(np.pi / np.sqrt(8), rel=1e-4)
    assert features.impulse_factor(sine) == pytest.approx(np.pi / 2, rel=1e-4)
    # Mean of sqrt|sin| is Gamma(3/4) / (sqrt(pi) Gamma(5/4)).
    assert features.clearance_factor(sine) == pytest.approx(
        1 / 0.762759764**2, rel=1e-3
    )  # a cusp at every zero
    x = noise(np.random.default_rng(6), 100_000)
    assert features.shape_factor(x) == pytest.approx(np.sqrt(np.pi / 2), rel=0.01)
    y = np.exp(0.3 * x)
    assert features.skewness(y) == pytest.approx(skew(y), rel=1e-9)
    assert features.kurtosis(y) == pytest.approx(scipy_kurtosis(y, fisher=False), rel=1e-9)
    for indicator in (features.skewness, features.shape_factor, features.impulse_factor):
        assert np.isnan(indicator(np.ones(10)))


@pytest.mark.records
def test_healthy_records_are_near_zero_and_faulty_ones_far_above(record_file):
    from gearsim_io.importers import import_file

    def largest(name, machine):
        record = import_file(record_file(name), machine)
        found = spectral_kurtosis(record.data[0], record.sample_rate_hz, 128)
        return np.max(found.values) / found.chance_limit()

    assert largest("mfpt/baseline_1.mat", "mfpt") < 2
    assert largest("mfpt/InnerRaceFault_vload_5.mat", "mfpt") > 20
    assert largest("cwru/135_0.mat", "cwru_drive_end") > 20
