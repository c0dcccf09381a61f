"""Linear prediction: known processes, scipy's Toeplitz solver, lines, impacts, and a measured record."""

import numpy as np
import pytest
from bearing_signals import defect, noise, rotating_lines, turns_of
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.linear_prediction import (
    ar_residual,
    best_ar_length,
    kurtosis_by_length,
    linear_predictor,
    longest_ar_length,
)
from gearsim_io.errors import InputError

RATE = 24_000.0


@pytest.fixture(scope="module")
def gears_and_defect():
    """Mesh lines 20 dB above the impacts, as on a gearbox; impacts at order 3.245 of 25 Hz."""
    rng = np.random.default_rng(1)
    turns = turns_of(25.0, 2.0, RATE)
    ball = defect(rng, turns, RATE, 3.245, resonance_hz=5000.0, damping=0.04)
    mesh = rotating_lines(turns, {k * 19.0 + s: 10.0 / k for k in (1, 2, 3) for s in (-1, 0, 1)})
    return ball, mesh + ball.x + 0.1 * rng.standard_normal(turns.size)


def test_coefficients_of_a_known_process():
    """An estimate's standard error is below 1 / sqrt(n); the taper costs a factor of about 1.2."""
    x = lfilter([1.0], [1.0, -1.5, 0.9], np.random.default_rng(0).standard_normal(100_000))
    predictor = linear_predictor(x, 2)
    np.testing.assert_allclose(predictor.coefficients, [1.5, -0.9], atol=5 * 1.2 / np.sqrt(x.size))
    assert predictor.error_share * np.var(x) == pytest.approx(1.0, rel=0.03)
    assert np.var(predictor.residual(x)[2:]) == pytest.approx(1.0, rel=0.03)


def test_equals_scipys_toeplitz_solver():
    """Of a periodic signal the autocorrelation is exact, so both solve the same equations."""
    x = np.random.default_rng(2).standard_normal(600)
    x -= x.mean()
    r = np.array([x @ np.roll(x, lag) for lag in range(41)])
    predictor = linear_predictor(x, 40, periodic=True)
    np.testing.assert_allclose(predictor.coefficients, solve_toeplitz(r[:-1], r[1:]), atol=1e-10)
    assert predictor.reflection[-1] == pytest.approx(predictor.coefficients[-1])
    error = x - sum(a * np.roll(x, k + 1) for k, a in enumerate(predictor.coefficients))
    np.testing.assert_allclose(predictor.residual(x), error, atol=1e-12)
    assert np.mean(error**2) / np.mean(x**2) == pytest.approx(predictor.error_share)


def test_lines_are_predicted_to_below_the_noise():
    rng = np.random.default_rng(3)
    t = np.arange(100_000)
    lines = 300 * np.cos(0.3 * t) + 100 * np.cos(0.32 * t + 1) + 30 * np.cos(1.1 * t)
    residual = ar_residual(lines + rng.standard_normal(t.size), 200)
    # A line's sine and cosine take two coefficients' worth of noise each: 6 of 200, and as much to fit them.
    assert np.var(residual[200:]) == pytest.approx(1.0, rel=0.15)
    assert np.all(residual[:200] == 0)


def test_a_predictor_of_the_sound_state_serves_another_record():
    """Wang and Wong's way: coefficients from the baseline, residual of the record in question."""
    rng = np.random.default_rng(4)
    push = rng.standard_normal((2, 20_000))
    push[1, 5000] += 40.0
    sound, other = lfilter([1.0], [1.0, -1.8, 0.95], push)
    residual = linear_predictor(sound, 2).residual(other)
    # What was pushed in comes out; the fit's error of 1 / sqrt(n) acts on a signal some ten times it.
    np.testing.assert_allclose(residual[2:], push[1, 2:], atol=50 * 10 / np.sqrt(20_000))
    assert np.std(residual[2:] - push[1, 2:]) < 10 * 2 / np.sqrt(20_000)


def test_all_lengths_at_once_equal_one_at_a_time(gears_and_defect):
    _, x = gears_and_defect
    longest = 60
    curve = kurtosis_by_length(x, longest)
    for length in (1, 2, 17, 60):
        residual = linear_predictor(x, length).residual(x)[longest:]
        assert curve[length - 1] == pytest.approx(np.mean(residual**4) / np.mean(residual**2) ** 2, rel=1e-6)
    assert best_ar_length(x, longest) == np.argmax(curve) + 1


def test_impacts_below_gears_come_out(gears_and_defect):
    """The impacts' own kurtosis, which the mesh hides; the residual must come within half of it."""
    ball, x = gears_and_defect
    longest = longest_ar_length(RATE, 3.245 * 25.0, x.size)
    assert longest == int(0.25 * RATE / (3.245 * 25.0))
    length = best_ar_length(x, longest)
    residual = ar_residual(x, length)
    assert kurtosis(x) < 0.3 * kurtosis(ball.x)
    assert kurtosis(residual) > 0.5 * kurtosis(ball.x)
    position = np.interp(ball.impacts, ball.turns, np.arange(x.size)).astype(int)
    position = position[(position > length) & (position < x.size - 10)]
    at_impacts = np.mean([np.max(np.abs(residual[p : p + 10])) for p in position])
    assert at_impacts > 5 * np.median(np.abs(residual))


@pytest.mark.parametrize("scale", [1e-120, 1e120])
def test_any_unit_will_do(gears_and_defect, scale):
    _, x = gears_and_defect
    assert best_ar_length(scale * x, 40) == best_ar_length(x, 40)


def test_too_short_and_unfit_signals_are_refused():
    with pytest.raises(InputError, match="at least 401 samples"):
        ar_residual(np.ones(400), 100)
    with pytest.raises(InputError, match="1 values that are not finite"):
        ar_residual(np.append(np.ones(400), np.nan), 10)
    with pytest.raises(InputError, match="length"):
        ar_residual(np.ones(400), 0)
    with pytest.raises(InputError, match="a signal that varies"):
        best_ar_length(np.ones(400), 10)
    with pytest.raises(InputError, match="impacts_hz"):
        longest_ar_length(RATE, 0.0, 1000)


def test_silence_stays_silence():
    assert np.all(ar_residual(np.full(500, 3.0), 20) == 0)


@pytest.mark.records
def test_a_measured_outer_race_becomes_more_impulsive(record_file):
    """CWRU 135: the residual's kurtosis against the raw record's, and healthy 97 stays near noise."""
    from gearsim_io.importers import import_file

    raw = import_file(record_file("cwru/135_0.mat"), "cwru_drive_end").data[0]
    longest = longest_ar_length(48_000.0, 3.585 * 29.95, raw.size)
    length = best_ar_length(raw, longest)
    assert kurtosis(ar_residual(raw, length)) > kurtosis(raw)
    sound = import_file(record_file("cwru/97_Normal_0.mat"), "cwru_drive_end").data[0]
    assert kurtosis(ar_residual(sound, best_ar_length(sound, longest))) < 3.5


def test_white_noise_offers_nothing_to_predict():
    x = noise(np.random.default_rng(5), 50_000)
    assert linear_predictor(x, 20).error_share == pytest.approx(1.0, abs=0.01)
