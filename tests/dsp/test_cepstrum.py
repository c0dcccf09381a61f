"""The real cepstrum and what is edited in it: closed forms, openconmo, and a measured record."""

import numpy as np
import pytest
from bearing_signals import defect, rotating_lines, turns_of
from scipy.signal import lfilter

from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.cepstrum import (
    comb_lifter,
    exponential_lifter,
    liftered,
    prewhitened,
    real_cepstrum,
)
from gearsim_io.errors import InputError

RATE = 24_000.0


@pytest.mark.parametrize("n", [20_000, 20_001])
def test_prewhitening_equals_openconmo(n):
    from openconmo.benchmark_methods import cepstrum_prewhitening as reference

    x = lfilter([1.0], [1.0, -1.6, 0.9], np.random.default_rng(0).standard_normal(n))
    _, theirs = reference(x, 1.0)
    # openconmo adds 1e-10 to magnitudes of order 1.
    np.testing.assert_allclose(prewhitened(x, tapered_share=0.0), theirs, atol=1e-7)


def test_every_line_has_the_same_magnitude_and_its_own_phase():
    x = np.random.default_rng(1).standard_normal(1000)
    before, after = np.fft.rfft(x), np.fft.rfft(prewhitened(x, tapered_share=0.0))
    np.testing.assert_allclose(np.abs(after), np.abs(after[5]), rtol=1e-10)
    np.testing.assert_allclose(np.angle(after / before), 0.0, atol=1e-10)


def test_prewhitening_brings_impacts_out_of_gears():
    rng = np.random.default_rng(2)
    turns = turns_of(25.0, 2.0, RATE)
    ball = defect(rng, turns, RATE, 3.245, resonance_hz=5000.0, damping=0.04).x
    mesh = rotating_lines(turns, {k * 19.0 + s: 5.0 / k for k in (1, 2, 3) for s in (-1, 0, 1)})
    x = mesh + ball + 0.02 * rng.standard_normal(turns.size)
    assert kurtosis(x) < 0.3 * kurtosis(ball)
    assert kurtosis(prewhitened(x)) > kurtosis(ball)


def test_the_cepstrum_of_a_pole_is_its_power_over_the_quefrency():
    """An impulse response r^n has the complex cepstrum r^k / k, the real one half of that."""
    r = 0.9
    cepstrum = real_cepstrum(r ** np.arange(1024))  # r^1024 is 1e-47
    k = np.arange(1, 100)
    np.testing.assert_allclose(cepstrum[1:100], 0.5 * r**k / k, atol=1e-12)
    assert cepstrum[0] == pytest.approx(0.0, abs=1e-12)


def test_an_echo_is_one_rahmonic_and_a_comb_lifter_removes_it():
    """1 + a z^-d has the real cepstrum a/2, -a^2/4, ... at d, 2d, ...; without it the echo is gone."""
    n, d, a = 4200, 300, 0.5
    rng = np.random.default_rng(3)
    x = np.zeros(n)
    x[:50] = rng.standard_normal(50) * np.exp(-np.arange(50) / 8)
    echoed = x + a * np.roll(x, d)
    change = real_cepstrum(echoed) - real_cepstrum(x)
    assert change[d] == pytest.approx(a / 2, abs=1e-5)
    assert change[2 * d] == pytest.approx(-(a**2) / 4, abs=2e-5)  # series up to 14 d, then wrapped
    edited = liftered(echoed, comb_lifter(n, d))
    ratio = np.abs(np.fft.rfft(edited)) / np.abs(np.fft.rfft(x))
    assert np.std(np.log(np.abs(np.fft.rfft(echoed)) / np.abs(np.fft.rfft(x)))) > 0.3
    # What the notch takes besides is what x itself has at these quefrencies.
    own = np.abs(np.fft.rfft(liftered(x, comb_lifter(n, d)))) / np.abs(np.fft.rfft(x))
    np.testing.assert_allclose(ratio, own, rtol=2e-5)


def test_a_lifter_of_ones_changes_nothing_and_one_of_zeros_whitens():
    for n in (500, 501):
        x = np.random.default_rng(4).standard_normal(n)
        np.testing.assert_allclose(liftered(x, np.ones(n // 2 + 1)), x, atol=1e-12)
        only_level = np.zeros(n // 2 + 1)
        only_level[0] = 1.0
        np.testing.assert_allclose(liftered(x, only_level), prewhitened(x, tapered_share=0.0), atol=1e-12)


def test_the_comb_takes_harmonics_of_one_shaft_and_leaves_the_other():
    """Two shafts' impacts: lines of the first fall by 10 dB and more, those of the other by less than 2 dB.

    Some rahmonics of one are rahmonics of the other.
    """
    n = 48_000
    t = np.arange(n)
    rng = np.random.default_rng(5)
    x = 0.05 * rng.standard_normal(n)
    for period in (480, 375):
        x[(t % period) == 7] += 3.0
    x = lfilter([1.0], [1.0, -1.2, 0.8], x)
    power = [np.abs(np.fft.rfft(s)) ** 2 for s in (x, liftered(x, comb_lifter(n, 480.0, 0.5)))]
    own, other = np.arange(1, 240) * (n // 480), np.arange(1, 187) * (n // 375)
    common = np.intersect1d(own, other)
    own, other = np.setdiff1d(own, common), np.setdiff1d(other, common)
    assert np.median(power[0][own] / power[1][own]) > 10.0
    assert np.median(power[0][other] / power[1][other]) < 10**0.2


def test_the_exponential_lifter_adds_known_damping():
    """A pole r has the cepstrum r^k / k; times exp(-k / q) that is a pole at r exp(-1 / q)."""
    r, decay = 0.98, 40.0
    x = r ** np.arange(4096.0)
    got = np.abs(np.fft.rfft(liftered(x, exponential_lifter(4096, decay))))
    want = np.abs(np.fft.rfft((r * np.exp(-1 / decay)) ** np.arange(4096)))
    np.testing.assert_allclose(got, want, rtol=1e-6)


def test_empty_lines_stay_empty_and_silence_silent():
    assert np.all(prewhitened(np.zeros(100)) == 0)
    assert np.all(liftered(np.zeros(100), np.ones(51)) == 0)
    x = np.cos(2 * np.pi * 5 / 100 * np.arange(100))
    np.testing.assert_allclose(prewhitened(x, tapered_share=0.0), x, atol=1e-12)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="at least 16 samples"):
        prewhitened(np.ones(8))
    with pytest.raises(InputError, match="band_hz"):
        prewhitened(np.ones(100), band_hz=(10.0, 60.0), sample_rate_hz=100.0)
    with pytest.raises(InputError, match="51 for 100 samples"):
        liftered(np.ones(100), np.ones(100))
    with pytest.raises(InputError, match="period"):
        comb_lifter(100, 60.0)
    with pytest.raises(InputError, match="width"):
        comb_lifter(100, 10.0, 5.0)
    with pytest.raises(InputError, match="decay"):
        exponential_lifter(100, 0.0)


@pytest.mark.records
def test_a_measured_fault_gains_kurtosis(record_file):
    """HIT-SM inner race at 1200 rpm: the record's kurtosis before and after pre-whitening."""
    from gearsim_io.importers import import_file

    x = import_file(record_file("hit_sm/SQ_IR2_1200.mat"), "hit_sq").data[0]
    assert kurtosis(prewhitened(x)) > 1.5 * kurtosis(x)


@pytest.mark.records
def test_the_ends_of_a_record_are_no_impact(record_file):
    """CWRU 135 is empty above 22 kHz but for the jump from its end to its beginning, which CPW would raise.

    That jump, not the bearing, is what gives brick-wall bands up there a kurtosis of thousands.
    """
    from gearsim_io.importers import import_file

    record = import_file(record_file("cwru/135_0.mat"), "cwru_drive_end")
    x, rate = record.data[0], record.sample_rate_hz
    bare, tapered = prewhitened(x, tapered_share=0.0), prewhitened(x)
    assert kurtosis(bare) > 500
    assert set(np.argsort(-np.abs(bare))[:2]) == {0, x.size - 1}
    assert kurtosis(x) < kurtosis(tapered) < 20
    assert kurtosis(tapered) == pytest.approx(kurtosis(bare[200:-200]), rel=0.2)
    inside = prewhitened(x, band_hz=(100.0, 20_000.0), sample_rate_hz=rate)
    lines = np.abs(np.fft.rfft(inside))
    frequency = np.arange(lines.size) * rate / x.size
    within = (frequency >= 100) & (frequency <= 20_000)
    assert np.ptp(lines[within]) < 1e-6 * lines[within].mean()
    assert np.max(lines[~within]) < 1e-6 * lines[within].mean()
