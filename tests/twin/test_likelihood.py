"""Evidence against closed forms and brute force: Gaussian limits, dependence, outliers, quiet places."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.stats import t as student
from toy_rig import ToyPlace, places_features

from gearsim_twin.dependence import independent_share
from gearsim_twin.likelihood import Yardstick, densities
from gearsim_twin.stack import Assumed, Levels, stack_of
from gearsim_twin.systematic import smooth_errors


def rows(channels=1, lines=200, records=1, std=1.0, level=None, domain="psd"):
    places = tuple(ToyPlace(domain, str(c), "band", float(k)) for c in range(channels) for k in range(lines))
    zero = np.zeros(len(places)) if level is None else level
    return stack_of([places_features(places, zero, std) for _ in range(records)])


def yard_of(stack, share=1.0, tau=0.5, smooth=None):
    d = len(stack.domains)
    empty = csr_array((stack.size, 0)) if smooth is None else smooth
    use = np.ones(stack.size, dtype=bool)
    return Yardstick(stack, np.full(d, share), np.full(d, tau), np.full(d, 1.6), use, empty)


def levels(stack, level_db, std=0.0):
    return Levels(
        np.broadcast_to(level_db, stack.size).astype(float),
        np.full(stack.size, std),
        np.ones(stack.size, bool),
        np.ones(stack.size),
        np.zeros(stack.size),
    )


def test_the_core_is_students_t_and_the_densities_integrate_to_one():
    r = np.linspace(-400, 400, 400001)
    core, wide = densities(r, np.full(r.size, 1.7**2))
    assert core[::4000] == pytest.approx(student(5, scale=1.7).pdf(r[::4000]), rel=1e-9)
    assert np.trapezoid(core, r) == pytest.approx(1.0, abs=1e-4)
    assert np.trapezoid(wide, r) == pytest.approx(1.0, abs=1e-4)


def test_a_linear_model_gives_the_weighted_mean_and_its_spread():
    rng = np.random.default_rng(3)
    stack = rows(std=1.0, level=2.0 + 1.2 * rng.standard_normal(200))
    found = yard_of(stack).posterior(levels(stack, 0.0), np.ones((200, 1)), np.zeros(1))
    # Prior N(0, 1) with 200 measurements of standard deviation 1.2 or so.
    assert found.coordinates[0] == pytest.approx(np.mean(stack.measured.level_db), abs=0.12)
    assert np.sqrt(found.covariance[0, 0]) == pytest.approx(1.2 / np.sqrt(200), rel=0.25)
    assert found.volume == pytest.approx(0.5 * np.log(found.covariance[0, 0]), abs=1e-9)


def test_evidence_is_the_integral_over_the_prior():
    rng = np.random.default_rng(4)
    stack = rows(lines=40, std=1.0, level=0.5 + rng.standard_normal(40))
    yard = yard_of(stack, tau=0.05)
    u = np.linspace(-4, 4, 801)
    value = np.array([yard.value(levels(stack, x), np.array([x])) for x in u]) - 0.5 * np.log(2 * np.pi)
    brute = np.log(np.trapezoid(np.exp(value - value.max()), u)) + value.max()
    found = yard.posterior(levels(stack, 0.0), np.ones((40, 1)), np.zeros(1))
    # Laplace, with the information of an M-estimator for the curvature: right to a few tenths of a nat.
    assert found.value + found.volume == pytest.approx(brute, abs=0.3)


def test_a_share_makes_alike_places_count_as_fewer():
    stack = rows(level=np.full(200, 0.3))
    one, tenth = (
        yard_of(stack, share).posterior(levels(stack, 0.0), np.ones((200, 1)), np.zeros(1))
        for share in (1.0, 0.1)
    )
    assert tenth.covariance[0, 0] == pytest.approx(10 * one.covariance[0, 0], rel=0.2)


def test_halving_a_large_difference_earns_little_and_explaining_it_much():
    stack = rows(lines=60, level=np.concatenate([np.zeros(54), np.full(6, 24.0)]), std=0.5)
    yard = yard_of(stack)
    part = np.concatenate([np.zeros(54), np.ones(6)])
    nothing, half, all_ = (yard.value(levels(stack, 24.0 * x * part), np.zeros(0)) for x in (0.0, 0.5, 1.0))
    assert all_ - half > 5 * (half - nothing)
    assert half - nothing < 6 * 1.0


def test_dependence_is_found_and_independence_is_left_alone():
    rng = np.random.default_rng(5)
    stack = rows(channels=4, lines=150, records=2)
    free = rng.standard_normal(stack.size)
    assert independent_share(stack, free, np.ones(1))[0] > 0.4
    common = rng.standard_normal(150)[np.array([int(p.at) for p in stack.places])]
    shared = independent_share(stack, common, np.ones(1))[0]
    assert shared == pytest.approx(1 / 8, rel=0.4)  # four channels, two records
    smooth = np.convolve(rng.standard_normal(160), np.ones(10) / np.sqrt(10), mode="valid")[:150]
    along = independent_share(rows(lines=150), smooth, np.ones(1))[0]
    assert along == pytest.approx(1 / 10, rel=0.6)  # variance of a mean of ten alike
    # If the model's part of the variance is small, what is shared can be no more than that.
    assert independent_share(stack, common, np.array([0.2]))[0] > shared


def test_smooth_errors_take_what_is_smooth_and_leave_single_lines():
    lines = 60
    k = np.arange(lines)
    single = np.where(k == 30, 8.0, 0.0)
    stack = rows(lines=lines, level=2.0 * np.cos(2 * np.pi * k / 40) + single, std=0.3)
    smooth = smooth_errors(stack, np.ones(lines, bool), np.array([1.5]))
    found = yard_of(stack, smooth=smooth).posterior(levels(stack, 0.0), np.zeros((lines, 0)), np.zeros(0))
    others = np.delete(found.residual_db, np.arange(28, 33))
    assert np.sqrt(np.mean(others**2)) < 0.35  # of 1.4 dB
    assert found.residual_db[30] > 7.0


def test_places_where_neither_has_anything_favour_no_model():
    stack = rows(lines=30)
    quiet = replace(stack, measured=replace(stack.measured, clear=np.zeros(30, bool)))
    yard = yard_of(quiet)
    silent = replace(levels(quiet, 0.0), clear=np.zeros(30, bool))
    assert yard.value(silent, np.zeros(0)) == yard.value(
        replace(silent, level_db=silent.level_db - 9), np.zeros(0)
    )
    loud = replace(silent, level_db=silent.level_db + 12.0, clear=np.arange(30) == 7)
    assert yard.value(loud, np.zeros(0)) < yard.value(silent, np.zeros(0)) - 2


def test_what_is_assumed_costs_when_it_is_not_so():
    features = places_features((ToyPlace("psd", "a", "band", 1.0),), np.zeros(1), 1.0)
    stack = stack_of([features], [Assumed("a", "gain", 1.0)])
    yard = yard_of(stack)
    good, bad = (yard.value(stack.filled({0: features}, [gain]), np.zeros(0)) for gain in (0.0, 6.0))
    assert good - bad == pytest.approx(18.0)


def test_a_model_that_errs_by_many_decibels_everywhere_is_measured_by_these():
    """A line 10 dB above one that errs by 7 dB all over is nothing much; above a good one it proves a lot."""
    rng = np.random.default_rng(12)
    more = []
    for error_db in (7.0, 0.5):
        level = error_db * rng.standard_normal(200)
        stack = rows(std=0.3, level=level)
        yard = yard_of(stack, tau=0.7)
        predicted = levels(stack, 0.0)
        residual = yard.residual(predicted)
        noise = yard.noise(residual, predicted)
        # The core of a t distribution with 5 degrees is narrower than its spread, by up to sqrt(3 / 5).
        assert 0.7 * error_db < np.hypot(noise.tau_db[0], 0.3) < 1.1 * error_db
        better, worse = (np.where(np.arange(200) == 3, x, residual) for x in (0.0, 10.0))
        gain = yard.loglike(better, predicted, noise) - yard.loglike(worse, predicted, noise)
        more.append(float(gain.sum()))
    assert more[0] < 2.0
    assert more[1] > 4.0
