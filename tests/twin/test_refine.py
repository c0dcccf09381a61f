"""The last fit: it finds a maximum that the first guesses missed, and intervals as the likelihood falls."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from toy_rig import CAUSES, TUNING, context_of, effect, toy_case, yard_of

from gearsim_twin.fit import fit_tuning, judged
from gearsim_twin.model import Extension, Model
from gearsim_twin.refine import refined, slopes_among


def trial(at, level_db, refused=False):
    levels = SimpleNamespace(level_db=np.asarray(level_db, dtype=float))
    return SimpleNamespace(model=SimpleNamespace(coordinates=tuple(at)), levels=levels, refused=refused)


def test_slopes_are_those_of_the_plane_through_all_simulations():
    rng = np.random.default_rng(0)
    slopes = rng.standard_normal((50, 3))
    at = rng.uniform(-0.3, 0.3, (20, 3))
    base = trial(np.zeros(3), np.zeros(50))
    seen = [base, *(trial(u, slopes @ u) for u in at), trial(np.ones(3), np.full(50, 99.0), refused=True)]
    np.testing.assert_allclose(slopes_among(base, seen), slopes, atol=0.02)


def test_chance_is_not_taken_for_a_slope():
    rng = np.random.default_rng(1)
    at = rng.uniform(-0.3, 0.3, (20, 2))
    noise = rng.standard_normal((20, 400))
    real = 8.0 * np.outer(at[:, 0], np.ones(400))
    base = trial(np.zeros(2), np.zeros(400))
    found = slopes_among(base, [trial(u, level) for u, level in zip(at, real + noise, strict=True)])
    assert np.mean(found[:, 0]) == pytest.approx(8.0, abs=0.8)
    # One difference over 0.25 of unit noise on both sides would give 1.4 / 0.25 = 5.7 there, least squares
    # alone 1 / (0.17 sqrt(20)) = 1.3; shrunk by their own noise they are lower by sqrt(2) or more.
    assert np.sqrt(np.mean(found[:, 1] ** 2)) < 1.0


@pytest.fixture(scope="module")
def spalled():
    """A case with an outer spall, and a model with that cause at a size that is far off."""
    rng = np.random.default_rng(11)
    one = effect(rng, "outer", 1.6)
    bench = toy_case(11, [one])
    yard = yard_of(bench)
    tuned = fit_tuning(bench, yard, Model(TUNING, TUNING.nominal))
    cause = next(each for each in CAUSES if each.name == "outer")
    guess = Extension(cause, {"size": 2.5 * one["values"]["size"]}, context_of(bench)(tuned.trial))
    (start,) = bench.trials([tuned.trial.model.extended(guess)])
    slopes = np.column_stack([np.zeros(yard.stack.size), tuned.slopes])
    return bench, yard, one, judged(yard, start, slopes)


def test_a_size_that_is_far_off_is_found_and_its_interval_holds_the_truth(spalled):
    bench, yard, one, start = spalled
    found = refined(bench, yard, start)
    size = CAUSES[0].parameters[0].prior
    spread = float(np.sqrt(found.posterior.covariance[0, 0]))
    assert yard.value(found.trial.levels, found.at) > yard.value(start.trial.levels, start.at) + 5.0
    assert abs(float(found.at[0]) - size.coordinate(one["values"]["size"])) < 3.0 * spread
    assert spread < 0.2


def test_the_spread_is_that_with_which_the_likelihood_falls(spalled):
    bench, yard, _, start = spalled
    found = refined(bench, yard, start)
    spread = float(np.sqrt(found.posterior.covariance[0, 0]))
    others = found.slopes.copy()
    others[:, 0] = 0.0
    values = []
    for step in (0.0, -2.0 * spread, 2.0 * spread):
        moved = found.at.copy()
        moved[0] += step
        (beside,) = bench.trials([found.trial.model.at(moved)])
        values.append(yard.posterior(beside.levels, others, moved).value)
    # Two standard deviations of a normal distribution: 2 nats on the mean of both sides.
    assert values[0] - 0.5 * (values[1] + values[2]) == pytest.approx(2.0, abs=0.8)


def test_slopes_that_claim_too_much_do_not_make_an_interval_narrow(spalled, monkeypatch):
    bench, yard, _, start = spalled
    plain = refined(bench, yard, start)
    from gearsim_twin import refine

    def boasting(at, seen):
        found = slopes_among(at, seen)
        found[:, 0] *= 3.0
        return found

    monkeypatch.setattr(refine, "slopes_among", boasting)
    boasted = refined(bench, yard, plain)
    narrow, wide = (np.sqrt(each.posterior.covariance[0, 0]) for each in (boasted, plain))
    assert narrow > 0.7 * wide
