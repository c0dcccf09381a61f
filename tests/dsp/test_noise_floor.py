import numpy as np
import pytest
from scipy import stats

from gearsim_dsp.noise_floor import (
    LineTail,
    comb_false_alarm,
    effective_averages,
    local_floor,
    search_false_alarm,
)
from gearsim_io.errors import InputError


def _spectra(rng, windows, length, hop):
    x = rng.standard_normal(length + hop * (windows - 1))
    window = np.hanning(length + 1)[:-1]
    parts = [np.abs(np.fft.rfft(x[k * hop : k * hop + length] * window)) ** 2 for k in range(windows)]
    return np.mean(parts, axis=0)


@pytest.mark.parametrize(("windows", "hop"), [(1, 1000), (8, 1000), (8, 500), (9, 250)])
def test_effective_averages_are_the_ratio_of_squared_mean_and_variance(windows, hop):
    rng = np.random.default_rng(1)
    power = np.array([_spectra(rng, windows, 1000, hop)[20:480:8] for _ in range(150)])
    observed = np.mean(power) ** 2 / np.var(power)
    expected = effective_averages(np.arange(windows) * hop, 1000)
    assert observed == pytest.approx(expected, rel=0.12)


def test_floor_follows_coloured_noise_and_ignores_lines():
    rng = np.random.default_rng(2)
    shape = 1.0 + 20.0 * np.exp(-np.arange(4000) / 700)
    power = shape * rng.gamma(4.0, 0.25, 4000)
    power[::50] += 300.0
    floor = local_floor(power, 160, 4.0)
    error = floor / shape
    assert np.all(np.abs(error[100:-100] - 1) < 0.35)
    assert np.mean(error) == pytest.approx(1.0, abs=0.06)


def test_tail_is_the_f_distribution():
    for averages, floor in ((1.0, 36.0), (4.3, 150.0), (20.0, 700.0)):
        z = np.array([0.3, 1.0, 2.0, 5.0, 12.0])
        ours = LineTail(averages, floor)(z)
        theirs = -stats.f.logsf(z, 2 * averages, 2 * floor)
        np.testing.assert_allclose(ours, np.minimum(theirs, 60.0), rtol=0.02, atol=1e-3)


def test_line_rate_on_noise_is_the_nominal_one():
    """The F correction matters: with the chi-square law alone the rate would be three times too high."""
    rng = np.random.default_rng(3)
    worth = 0.45 * 80
    hits = trials = 0
    for _ in range(120):
        power = rng.exponential(1.0, 1600)
        # a block of 160 lines at half-bin spacing holds 80 independent ones; here all are independent
        ratio = power / local_floor(power, 80, 1.0)
        tail = LineTail(1.0, worth * 2 * 0.75)(ratio)
        hits += int(np.sum(tail > -np.log(1e-3)))
        trials += ratio.size
    low, high = stats.binom.interval(0.999, trials, 1e-3)
    assert 0.4 * low < hits < 1.6 * high


def test_comb_sum_is_gamma():
    rng = np.random.default_rng(4)
    total = -np.log(rng.random((20_000, 5))).sum(axis=1)
    p = comb_false_alarm(total, 5)
    assert stats.kstest(p, "uniform").pvalue > 1e-3
    assert comb_false_alarm(7.0, 0) == 1.0


def test_many_looks_find_more():
    assert search_false_alarm(1e-6, 100.0) == pytest.approx(1e-4, rel=1e-3)
    assert search_false_alarm(0.5, 10.0) == pytest.approx(1 - 0.5**10)
    assert search_false_alarm(1.0, 10.0) == 1.0
    with pytest.raises(InputError):
        search_false_alarm(1.5, 2.0)
