"""Mesh stiffness and transmission error as smooth periodic functions, and the pieces that evaluate them."""

import math

import numpy as np
import pytest

from gearsim_sim.integrate.pieces import (
    DEGREE,
    circle_table,
    cosine_sine,
    plain_polynomial,
    plain_ramp,
    table_value,
)
from gearsim_sim.model.gear_errors import gear_error, pitch_series
from gearsim_sim.model.gear_mesh import stiffness_series
from gearsim_sim.model.periodic import merged, sinusoid
from gearsim_sim.params import load_parallel_params


@pytest.fixture(scope="module")
def params():
    return load_parallel_params()


def test_mesh_stiffness_keeps_its_mean_and_its_two_levels(params):
    series = stiffness_series(params.model.mesh, variation=True)
    phase = np.arange(4096) / 4096
    stiffness = series.value(phase)
    assert np.mean(stiffness) == pytest.approx(3.178e8, rel=1e-12)
    assert stiffness[2048] < 3.178e8 < stiffness[0]  # one pair in the middle, two pairs at phase zero
    assert stiffness.max() / stiffness.min() == pytest.approx(1.6, rel=0.02)
    double = np.mean(stiffness > 0.5 * (stiffness.max() + stiffness.min()))
    assert double == pytest.approx(0.67, abs=0.02)  # contact ratio - 1
    assert stiffness_series(params.model.mesh, variation=False).value(phase) == pytest.approx(3.178e8)


def test_mesh_stiffness_has_no_overshoot(params):
    """Smooth: between its levels it only rises and falls once per pitch, up to a percent of ripple."""
    stiffness = stiffness_series(params.model.mesh, variation=True).value(np.arange(1024) / 1024)
    swing = stiffness.max() - stiffness.min()
    assert np.abs(np.diff(stiffness)).sum() == pytest.approx(2 * swing, rel=0.05)


def test_pitch_errors_hold_at_the_middle_of_each_tooth():
    rng = np.random.default_rng(5)
    errors = rng.normal(size=32)
    series = pitch_series(errors, 3200)
    assert series.value(np.arange(32) / 32) == pytest.approx(errors, abs=2e-4)
    between = series.value((np.arange(32) + 0.5) / 32)
    assert between == pytest.approx((errors + np.roll(errors, -1)) / 2, abs=2e-4)
    limited = pitch_series(errors, 320)
    assert limited.value(np.arange(32) / 32) == pytest.approx(errors, abs=0.02)


def only(params, **switched_on):
    off = dict.fromkeys(("runout", "tooth_profile", "tooth_pitch", "tooth_surface"), False)
    physics = params.physics.model_copy(update=off | switched_on)
    return gear_error(params.model.gear_errors, physics, 32, 0.4, seed=1, wheel=0)


def test_transmission_error_of_the_thesis(params):
    """(4.15) and (4.16): 30 um once and 15 um thirty-two times per turn."""
    turns = np.linspace(0, 1, 257)
    runout = only(params, runout=True).value(turns)
    assert runout == pytest.approx(30e-6 * np.sin(2 * np.pi * turns + 0.4), abs=1e-12)
    profile = only(params, tooth_profile=True).value(turns)
    assert profile == pytest.approx(15e-6 * np.sin(2 * np.pi * 32 * turns + 0.4), abs=1e-12)


def test_random_errors_have_their_size_and_band(params):
    turns = np.arange(4096) / 4096
    pitch = np.array([_rms(_pitch(params, seed)) for seed in range(200)])
    # The hand-over between teeth averages two of them: rms sqrt(3/4) of the teeth's own.
    assert np.sqrt(np.mean(pitch**2)) == pytest.approx(0.2e-6 * math.sqrt(0.75), rel=0.05)
    surface = only(params, tooth_surface=True)
    assert np.std(surface.value(turns)) == pytest.approx(0.02e-6, rel=0.1)
    spectrum = np.abs(np.fft.rfft(surface.value(turns)))
    assert spectrum[330:].max() < 1e-6 * spectrum[:321].max()  # ten times the tooth mesh order


def _rms(series):
    return np.sqrt(np.sum(series.cosine**2 + series.sine**2) / 2)  # Parseval


def _pitch(params, seed):
    physics = params.physics.model_copy(
        update=dict.fromkeys(("runout", "tooth_profile", "tooth_surface"), False)
    )
    return gear_error(params.model.gear_errors, physics, 32, 0.0, seed, wheel=1)


def test_random_errors_follow_seed_and_wheel(params):
    arguments = (params.model.gear_errors, params.physics, 32, 0.0)
    one = gear_error(*arguments, seed=1, wheel=0)
    assert np.array_equal(one.cosine, gear_error(*arguments, seed=1, wheel=0).cosine)
    assert not np.allclose(one.cosine, gear_error(*arguments, seed=2, wheel=0).cosine)
    assert not np.allclose(one.cosine, gear_error(*arguments, seed=1, wheel=1).cosine)


def test_slope_is_the_derivative():
    series = merged(sinusoid(1, 2.0, 0.3), sinusoid(32, 0.5, 1.0))
    for turns in (0.1, 0.77):
        change = series.value(turns + 1e-6) - series.value(turns - 1e-6)
        assert series.slope(turns) == pytest.approx(change / 2e-6, rel=1e-6)


def test_tables_follow_their_series(params):
    series = gear_error(params.model.gear_errors, params.physics, 32, 0.0, 3, 0)
    table = series.table()
    turns = np.random.default_rng(0).uniform(0, 3, 400)
    found = np.array([table_value(t, table, 0, table.size // 2 - 1) for t in turns])
    assert found[:, 0] == pytest.approx(series.value(turns), abs=1e-13)
    slope = series.slope(turns)
    assert found[:, 1] == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())


def test_cosine_and_sine_to_rounding():
    circle = circle_table()
    turns = np.random.default_rng(0).uniform(0, 1, 1000)
    found = np.array([cosine_sine(t, circle) for t in turns])
    assert found[:, 0] == pytest.approx(np.cos(2 * np.pi * turns), abs=1e-15)
    assert found[:, 1] == pytest.approx(np.sin(2 * np.pi * turns), abs=1e-15)


def test_ramps_are_smooth_and_consistent():
    """Slope and integral belong to the value; nothing jumps at either end, curvature included."""
    steps = 1000.0
    at = np.linspace(-100, 1300, 28001)
    value, slope, integral = np.array([plain_ramp(s, steps) for s in at]).T
    inside = (at > 0) & (at < 1200)
    assert np.gradient(value, at)[inside] == pytest.approx(
        slope[inside], abs=2e-6 * np.abs(slope).max() + 1e-9
    )
    assert np.gradient(integral, at)[inside] == pytest.approx(value[inside], abs=1e-5 * np.abs(value).max())
    curvature = np.gradient(slope, at)
    assert np.abs(np.diff(curvature[at > 0.2])).max() < 2e-3 * np.abs(curvature).max()
    assert (value[-1], slope[-1]) == (1.0, 0.0)
    assert plain_ramp(1e-9, steps)[1] == pytest.approx(0.0, abs=1e-9)


def test_polynomials_and_their_derivatives():
    coefficients = np.random.default_rng(1).normal(size=DEGREE + 1)
    reference = np.polynomial.Polynomial(coefficients)
    for u in (0.0, 0.3, 1.0, -2.5):
        expected = [reference(u), reference.deriv()(u), reference.deriv(2)(u)]
        assert plain_polynomial(u, coefficients) == pytest.approx(expected, rel=1e-12)
