"""MED, ARMED and MCKD: PySDKit, the gradient itself, known impacts behind known filters, and a record."""

import numpy as np
import pytest
from bearing_signals import noise
from scipy.optimize import minimize
from scipy.signal import lfilter

from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.deconvolution import armed, correlated_kurtosis, mckd, med
from gearsim_dsp.separation.linear_prediction import ar_residual, best_ar_length
from gearsim_io.errors import InputError

N = 20_000


def behind_a_path(impacts, rng, level=0.05):
    """Impacts that ring two resonances, in noise."""
    ringing = lfilter([1.0], [1.0, -1.7, 0.92], impacts) + lfilter([1.0], [1.0, 0.9, 0.9], impacts)
    return ringing / np.std(ringing) + level * noise(rng, impacts.size)


@pytest.fixture(scope="module")
def train():
    """Impacts of either sign with random distances, as of a bearing with slip."""
    rng = np.random.default_rng(0)
    impacts = np.zeros(N)
    impacts[np.cumsum(rng.integers(180, 220, 90))] = rng.uniform(0.8, 1.2, 90) * rng.choice([-1, 1], 90)
    return impacts, behind_a_path(impacts, rng)


def test_med_undoes_the_path(train):
    impacts, x = train
    found = med(x, 40)
    assert kurtosis(found.values) > 3 * kurtosis(x)
    shift = np.argmax(np.abs(np.correlate(found.values, impacts, "full"))) - (N - 1)
    assert 0 <= shift < 40
    moved = np.roll(impacts, shift)
    assert abs(np.corrcoef(moved, found.values)[0, 1]) > 0.9
    assert found.converged
    assert np.mean(found.values[39:] ** 2) == pytest.approx(np.var(x), rel=1e-3)
    assert np.all(found.values[:39] == 0)


def test_the_end_of_the_iteration_is_a_maximum(train):
    """scipy's search finds nothing better nearby; the iteration ends when it gains less than 1e-4."""
    _, x = train
    found = med(x, 6, iterations=500)  # too short to undo the path, so other aims lead elsewhere

    def value(taps):
        y = np.convolve(x - x.mean(), taps, "valid")
        return y.size * np.sum(y**4) / np.sum(y**2) ** 2

    top = value(found.taps)
    assert top == pytest.approx(found.history[-1], rel=1e-9)
    assert value(3.0 * found.taps) == pytest.approx(top)
    best = minimize(lambda taps: -value(taps), found.taps, method="BFGS")
    assert -best.fun < top * (1 + 1e-3)


def test_correlated_kurtosis_equals_pysdkit(train):
    from pysdkit.utils.deconvolution import correlated_kurtosis as reference

    _, x = train
    for period, shifts in ((200, 1), (77, 2), (5, 3)):
        assert correlated_kurtosis(x, period, shifts) == pytest.approx(reference(x, period, shifts), rel=1e-9)


@pytest.mark.parametrize("shifts", [1, 3])
def test_one_step_of_mckd_equals_pysdkit(shifts):
    """PySDKit counts outputs from the first sample on; with a silent beginning that is no difference."""
    from pysdkit import FMD

    length, period, n = 16, 50, 3000
    rng = np.random.default_rng(2)
    x = np.zeros(n)
    x[length:] = rng.standard_normal(n - length)
    x[length::period] += 4.0
    x[length:] -= np.mean(x[length:])
    start = np.zeros(length)
    start[length // 2] = 1.0
    _, filters, _, _ = FMD(fs=500.0)._xxc_mckd(x, start, 2, T=period, M=shifts)
    ours = mckd(x, length, period, shifts, iterations=1)
    assert ours.history[1] > ours.history[0]
    np.testing.assert_allclose(ours.taps, filters[:, 1], atol=2e-5)  # our ridge is 1e-6


def test_one_knock_wins_med_but_not_mckd():
    rng = np.random.default_rng(3)
    impacts = np.zeros(N)
    impacts[100::200] = 1.0
    impacts[7777] = 12.0
    x = behind_a_path(impacts, rng, 0.3)
    med_taps, mckd_taps = (found.taps for found in (med(x, 40), mckd(x, 40, 200, 3)))
    quiet = np.delete(np.arange(N), np.arange(7700, 8200))
    regular = {}
    for name, taps in (("med", med_taps), ("mckd", mckd_taps)):
        y = np.convolve(x, taps)[:N][quiet]
        regular[name] = np.sort(np.abs(y))[-90:].mean() / np.std(y)
    assert regular["mckd"] > 5.0
    found = mckd(x, 40, 200, 3)
    assert found.history[-1] > 5 * found.history[0]
    wrong = mckd(x, 40, 183, 3)
    assert max(wrong.history) < 0.2 * max(found.history)


def test_armed_takes_gears_away_first():
    rng = np.random.default_rng(4)
    impacts = np.zeros(N)
    impacts[np.cumsum(rng.integers(180, 220, 90))] = 1.0
    t = np.arange(N)
    gears = 6 * np.cos(0.21 * t) + 4 * np.cos(0.42 * t + 1)
    x = behind_a_path(impacts, rng) + gears
    found = armed(x, 50, 40)
    assert found.values.shape == x.shape
    ar = best_ar_length(x, 50)
    np.testing.assert_array_equal(found.values[ar:], med(ar_residual(x, ar)[ar:], 40).values)
    assert np.all(found.values[: ar + 39] == 0)
    assert kurtosis(found.values) > 20 > 5 * kurtosis(x)


@pytest.mark.parametrize("scale", [1e-30, 1e30])
def test_any_unit_will_do(train, scale):
    _, x = train
    np.testing.assert_allclose(med(scale * x, 10).taps, med(x, 10).taps, rtol=1e-6)
    np.testing.assert_allclose(mckd(scale * x, 10, 200, 3).taps, mckd(x, 10, 200, 3).taps, rtol=1e-6)


def test_what_does_not_fit_is_refused():
    with pytest.raises(InputError, match="at least 160 samples"):
        med(np.ones(100), 40)
    with pytest.raises(InputError, match="varies"):
        med(np.ones(1000), 40)
    with pytest.raises(InputError, match="at least 1640 samples"):
        mckd(np.ones(1000), 40, 400, 1)
    with pytest.raises(InputError, match="shifts"):
        mckd(np.ones(1000), 40, 100, 0)
    with pytest.raises(InputError, match="at least 361 samples"):
        armed(np.ones(300), 50, 40)
    with pytest.raises(InputError, match="varies"):
        correlated_kurtosis(np.zeros(10), 2)


@pytest.mark.records
def test_a_measured_outer_race_becomes_more_impulsive(record_file):
    from gearsim_io.importers import import_file

    x = import_file(record_file("hit_sm/SQ_OR2_1200.mat"), "hit_sq").data[0][:100_000]
    assert kurtosis(med(x, 60).values) > 2 * kurtosis(x)
