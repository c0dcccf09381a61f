import numpy as np
import pytest
from scipy import fft as sfft
from scipy.signal import welch

from gearsim_dsp.spectra import good_length, welch_psd
from gearsim_io.errors import InputError


def test_good_length_is_the_largest_5_smooth_number_below():
    for samples in (1, 2, 7, 100, 97656, 131072, 146484, 585936):
        length = good_length(samples)
        assert length <= samples
        rest = length
        for prime in (2, 3, 5):
            while rest % prime == 0:
                rest //= prime
        assert rest == 1
        assert all(
            sfft.next_fast_len(k, real=True) != k for k in range(length + 1, min(samples, length + 50))
        )


def test_psd_integrates_to_the_variance():
    rng = np.random.default_rng(1)
    x = 3.0 + 2.0 * rng.standard_normal(200_000)
    psd = welch_psd(x, 1000.0, 2.0)
    assert psd.power(0.0, 501.0) == pytest.approx(np.var(x), rel=0.01)
    assert np.sum(psd.density) * psd.step_hz == pytest.approx(np.var(x), rel=0.01)


def test_a_sine_has_its_mean_square_around_its_line():
    t = np.arange(50_000) / 5000.0
    x = 1.7 * np.sin(2 * np.pi * 123.4 * t)
    psd = welch_psd(x, 5000.0, 1.0)
    assert psd.power(119.0, 128.0) == pytest.approx(1.7**2 / 2, rel=1e-3)


def test_agrees_with_scipy():
    rng = np.random.default_rng(2)
    x = rng.standard_normal(32_000)
    ours = welch_psd(x, 640.0, 1.0)
    frequency, theirs = welch(x - x.mean(), 640.0, nperseg=640, detrend=False)
    np.testing.assert_allclose(ours.frequency_hz, frequency)
    np.testing.assert_allclose(ours.density, theirs, rtol=1e-10)


@pytest.mark.parametrize("bad", [np.zeros((2, 100)), np.zeros(4)])
def test_what_is_no_signal_is_refused(bad):
    with pytest.raises(InputError):
        welch_psd(bad, 100.0, 1.0)
