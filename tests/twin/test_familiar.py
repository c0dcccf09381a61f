"""What the healthy machine showed, with what a cause changes: against closed forms and drawn signals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array

from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.places import Place
from gearsim_twin.familiar import Familiar
from gearsim_twin.likelihood import Yardstick
from gearsim_twin.stack import levels_of, stack_of
from gearsim_twin.taught import NEAR, Taught

BAND = (1000.0, 2000.0)
LINE = Place("orders", "a", "shaft", 1.0, "order", 0.1, "input")
NOISE = Place("psd", "a", "band", 1500.0, "Hz", 100.0)
LEVEL = Place("statistics", "a", "rms", 1414.0, "Hz", 1000.0, "", BAND)
PEAKS = Place("statistics", "a", "kurtosis", 1414.0, "Hz", 1000.0, "", BAND)
GAUSS_DB = 10 * np.log10(3.0)


def shown(places, level_db, std_db=0.1, speed_hz=10.0, height_db=20.0):
    n = len(places)
    power = np.array([place.kind != "kurtosis" for place in places])
    levels = Levels.of(
        np.asarray(level_db, dtype=float),
        np.full(n, std_db),
        height_db=np.array([height_db if place.domain == "orders" else np.inf for place in places]),
        clear_db=np.array([6.0 if place.domain == "orders" else 0.0 for place in places]),
        frequency_hz=np.where(power, 1500.0, np.nan),
        bandwidth_hz=np.where(power, 100.0, np.nan),
        gauss_db=np.where(power, np.nan, GAUSS_DB),
    )
    return Features(tuple(places), levels, speed_hz)


def healthy(places, level_db, std_db=0.1, repeat_db=0.2, **more):
    made = shown(places, level_db, std_db, **more)
    n = len(places)
    return Familiar(
        replace(made, levels=replace(made.levels, own=np.zeros(n), repeat_db=np.full(n, repeat_db)))
    )


def db(power):
    return 10 * np.log10(power)


def test_noise_adds_in_power_to_what_the_machine_had():
    """The machine has 4, the model 1; a cause that adds 5 gives 9, of which 5 / 9 rest on the model."""
    one, other = (shown([NOISE], [db(x)], 0.3) for x in (1.0, 6.0))
    found = healthy([NOISE], [db(4.0)]).with_cause(one, other, other, other, superposed=True)
    assert found.level_db[0] == pytest.approx(db(9.0))
    assert found.own[0] == pytest.approx(5.0 / 9.0)
    assert found.repeat_db[0] == pytest.approx(0.2 * 4.0 / 9.0)
    assert found.std_db[0] == pytest.approx(np.hypot(0.1 * 4.0 / 9.0, 0.3 * 5.0 / 9.0))


def test_without_a_cause_the_machine_is_as_it_was():
    places = [LINE, NOISE, LEVEL, PEAKS]
    known = healthy(places, [3.0, -2.0, 1.0, 7.0])
    bare = shown(places, [-8.0, 4.0, 0.0, 5.0])
    found = known.with_cause(bare, bare, bare, bare, superposed=True)
    assert found.level_db == pytest.approx([3.0, -2.0, 1.0, 7.0])
    assert found.own == pytest.approx(0.0, abs=1e-9)
    assert found.repeat_db == pytest.approx(0.2)


def test_what_takes_away_and_what_scales_is_a_ratio():
    bare, less, more = (shown([NOISE], [x]) for x in (0.0, -6.0, 9.0))
    known = healthy([NOISE], [20.0])
    assert known.with_cause(bare, less, less, less, superposed=False).level_db[0] == pytest.approx(14.0)
    scaled = known.with_cause(bare, bare, more, more, superposed=False)
    assert scaled.level_db[0] == pytest.approx(29.0)
    assert scaled.own[0] == pytest.approx(1.0 - 10**-0.9)


@pytest.mark.parametrize("strength", [0.05, 0.3, 3.0])
def test_lines_superpose_at_an_angle_that_is_not_known(strength: float):
    """Phasors of machine and model at angles of their own: prediction and scatter are right in the mean."""
    rng = np.random.default_rng(3)
    n = 4000
    places = [replace(LINE, at=float(k + 1)) for k in range(n)]
    machine, model = 2.0, 1.0
    angle = np.exp(2j * np.pi * rng.random((2, n)))
    true = np.abs(machine + strength * angle[0]) ** 2
    whole = shown(places, db(np.abs(model + strength * angle[1]) ** 2), 0.0)
    known = healthy(places, np.full(n, db(machine**2)), 0.0)
    found = known.with_cause(shown(places, np.zeros(n), 0.0), whole, whole, whole, superposed=True)
    predicted = 10 ** (0.1 * found.level_db)
    # Far below and above the line that is there the addition is right in the mean, between nearly so.
    added = np.mean(predicted) - machine**2
    assert 0.5 < added / strength**2 < 2.0
    z = (db(true) - found.level_db) / np.hypot(found.std_db, 0.05)
    assert 0.5 < np.sqrt(np.mean(z**2)) < 1.5


def test_kurtosis_adds_as_cumulants_do():
    """Machine: Gaussian, 4 times the power that the model has. Impulses of the same power dilute the more."""
    rng = np.random.default_rng(4)
    n = 400_000
    quiet, loud = (s * rng.standard_normal(n) for s in (1.0, 2.0))
    impulses = rng.laplace(scale=1.0, size=n)

    def figures(x):
        return [db(np.mean(x**2)), db(np.mean(x**4) / np.mean(x**2) ** 2)]

    places = [LEVEL, PEAKS]
    bare, whole = shown(places, figures(quiet)), shown(places, figures(quiet + impulses))
    found = healthy(places, figures(loud)).with_cause(bare, whole, whole, whole, superposed=True)
    assert found.level_db == pytest.approx(figures(loud + impulses), abs=0.05)
    assert whole.level_db[1] - found.level_db[1] > 0.4


def test_places_that_only_the_cause_has_are_the_models():
    silent, whole = shown([NOISE], [np.nan]), shown([NOISE], [5.0])
    found = healthy([NOISE], [1.0]).with_cause(silent, whole, whole, whole, superposed=False)
    assert found.level_db[0] == 5.0
    assert found.own[0] == 1.0


def places_of(count):
    return [replace(NOISE, at=100.0 * (k + 1)) for k in range(count)]


def taught(rows, conditions, models=None):
    places = places_of(len(rows[0]))
    measured = tuple(shown(places, row) for row in rows)
    model = tuple(shown(places, row) for row in (models or np.zeros((len(rows), len(rows[0])))))
    return Taught(measured, model, tuple(conditions), {"psd": 1.0}, None)


def test_runs_of_one_machine_teach_what_they_differ_by():
    rng = np.random.default_rng(5)
    truth = 5.0 * rng.standard_normal(300)
    rows = [truth + 0.6 * rng.standard_normal(300) + 0.1 * rng.standard_normal(300) for _ in range(3)]
    known = taught(rows, [(10.0, 50.0, 0.0)] * 3)
    assert known.repeat_db["psd"] == pytest.approx(0.6, rel=0.1)
    there = known.familiar(shown(places_of(300), np.zeros(300)), (10.0, 50.0, 0.0))
    assert there is not None
    error = there.healthy.level_db - truth
    assert np.std(error) == pytest.approx(0.61 / np.sqrt(3.0), rel=0.15)
    # A further run differs from the mean of three by its own share and theirs.
    assert there.healthy.repeat_db == pytest.approx(known.repeat_db["psd"] * np.sqrt(4.0 / 3.0), rel=1e-6)


def test_other_conditions_shift_levels_as_the_model_says_and_are_believed_less():
    here = (10.0, 50.0, 0.0)
    known = taught([[3.0, 3.0]], [(10.4, 50.0, 0.0)], [[0.0, 0.0]])
    found = known.familiar(shown(places_of(2), [2.0, 0.0]), here)
    assert found is not None
    assert found.healthy.level_db == pytest.approx([5.0, 3.0])
    alike = taught([[3.0, 3.0]], [here], [[0.0, 0.0]]).familiar(shown(places_of(2), [0.0, 0.0]), here)
    assert alike is not None
    assert found.healthy.repeat_db[0] > found.healthy.repeat_db[1] > alike.healthy.repeat_db[1]


def test_records_under_clearly_other_conditions_teach_no_places():
    far = (10.0 * np.exp(1.1 * NEAR), 50.0, 0.0)
    known = taught([[3.0]], [far], [[0.0]])
    assert known.familiar(shown(places_of(1), [0.0]), (10.0, 50.0, 0.0)) is None


def yard_and_levels(own, repeat_db, residual_db):
    measured = shown(places_of(len(own)), residual_db, 0.05)
    stack = stack_of([measured])
    zero = shown(places_of(len(own)), np.zeros(len(own)), 0.05)
    predicted = levels_of([replace(zero, levels=replace(zero.levels, own=own, repeat_db=repeat_db))])
    one = np.ones(1)
    use = np.ones(stack.size, dtype=bool)
    return Yardstick(stack, one, one, 1.6 * one, use, csr_array((stack.size, 0))), predicted


def test_small_differences_count_where_the_machine_is_known():
    """1 dB at a place known to 0.2 dB speaks against a prediction; it is nothing where models err by 1 dB."""
    rng = np.random.default_rng(6)
    own = np.repeat([0.0, 1.0], 60)
    residual = np.where(own == 0.0, 0.2, 1.0) * rng.standard_normal(120)
    yard, predicted = yard_and_levels(own, np.where(own == 0.0, 0.2, 0.0), residual)
    noise = yard.noise(yard.residual(predicted), predicted)
    assert noise.tau_db[0] == pytest.approx(1.0, rel=0.4)
    assert noise.repeat[0] == pytest.approx(1.0, rel=0.5)
    # Each place counts once, beside what is known of tau and repeatability beforehand (two deviations).
    total = float(yard.loglike(yard.residual(predicted), predicted, noise).sum())
    assert total - 4.0 <= noise.loglike[0] <= total + 1e-6
    cost = []
    for k in (3, 100):
        off, near = (np.where(np.arange(120) == k, x, residual) for x in (1.0, 0.0))
        gain = yard.loglike(near, predicted, noise) - yard.loglike(off, predicted, noise)
        cost.append(float(gain.sum()))
    assert cost[0] > 3.0
    assert cost[1] < 1.0


def test_records_that_repeat_themselves_badly_are_found_to():
    rng = np.random.default_rng(7)
    residual = 1.5 * rng.standard_normal(100)
    yard, predicted = yard_and_levels(np.zeros(100), np.full(100, 0.2), residual)
    noise = yard.noise(yard.residual(predicted), predicted)
    # The core of a t distribution with 5 degrees is narrower than its spread, by up to sqrt(3 / 5), and
    # what is known beforehand pulls.
    assert 0.6 * 1.5 < 0.2 * noise.repeat[0] < 1.2 * 1.5
