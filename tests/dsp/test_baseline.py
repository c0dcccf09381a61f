"""Baselines: learnt, kept on disk, and what a value is worth against them."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy import stats

from gearsim_dsp.streams.baseline import BaselineLearner, load_baseline, save_baseline, speed_step
from gearsim_dsp.streams.feature_kinds import KINDS, kind_of
from gearsim_io.errors import InputError

KEY = ("kurtosis", "b3_y", "", "kurtosis")
LEVEL = ("kurtosis", "b3_y", "", "rms")
STEP = speed_step(10.0)


def learnt(values, key=KEY, step=STEP, machine="rig"):
    learner = BaselineLearner(machine)
    for value in values:
        learner.add(key, step, float(value))
    return learner.finish(60.0)


def test_independent_values_give_mean_spread_and_the_predictive_probability_of_a_normal_sample():
    values = 1e6 + 0.8 * np.random.default_rng(1).standard_normal(400)  # a large mean must not cost digits
    baseline = learnt(values)
    cell = baseline.cells[KEY, STEP]
    assert cell.mean == pytest.approx(values.mean(), rel=1e-12)
    assert cell.spread == pytest.approx(values.std(ddof=1), rel=1e-6)
    assert 300 < cell.effective <= 400
    x = values.mean() + 4.0
    t = 4.0 / (cell.spread * math.sqrt(1 + 1 / cell.effective))
    standing = baseline.standing(KEY, STEP, x)
    assert standing.significance == pytest.approx(-math.log10(stats.t.sf(t, cell.effective - 1)), rel=1e-6)
    assert standing.expected == pytest.approx(values.mean())
    assert standing.deviation == pytest.approx(4.0 / cell.spread, rel=1e-6)
    assert standing.size == pytest.approx(4.0 / kind_of("kurtosis").least)
    assert baseline.standing(KEY, STEP, values.mean() - 9.0).significance < 1e-6  # a fall is no fault


def test_windows_that_overlap_count_for_less():
    """Means over 4 of consecutive values, as of windows that overlap by three quarters: worth a quarter."""
    rng = np.random.default_rng(2)
    worth = []
    for _ in range(20):
        means = np.convolve(rng.standard_normal(403), np.ones(4) / 4, "valid")
        worth.append(learnt(means).cells[KEY, STEP].effective / 400)
    assert 0.08 < np.mean(worth) < 0.25


def test_new_values_of_the_healthy_machine_come_up_as_rarely_as_stated():
    """Short baselines of dependent values: no more than the nominal rate, from 1 in 10 to 1 in 1000."""
    rng = np.random.default_rng(3)
    found = []
    for _ in range(1500):
        means = np.convolve(rng.standard_normal(64), np.ones(4) / 4, "valid")
        baseline = learnt(means[:45])
        found += [baseline.standing(KEY, STEP, value).significance for value in means[50::4]]
    found = np.asarray(found)
    for significance in (1.0, 2.0, 3.0):
        rate = np.mean(found >= significance)
        nominal = 10**-significance
        assert rate < nominal + 3 * math.sqrt(nominal / found.size)
    assert np.mean(found >= 1.0) > 0.03  # not blind either


def test_levels_are_judged_as_ratios_and_their_limit_is_where_an_alarm_would_be():
    rng = np.random.default_rng(4)
    for spread_db in (0.01, 3.0):
        values = 2.5 * 10 ** (spread_db * rng.standard_normal(200) / 20)
        baseline = learnt(values, LEVEL)
        assert baseline.standing(LEVEL, STEP, 2.5).expected == pytest.approx(2.5, rel=0.1)
        limit = baseline.limit(LEVEL, STEP, 6.0)
        at = baseline.standing(LEVEL, STEP, limit * 1.001)
        assert at.significance >= 6.0
        assert at.size >= 1.0
        below = baseline.standing(LEVEL, STEP, limit * 0.999)
        assert below.significance < 6.0 or below.size < 1.0
    assert baseline.limit(LEVEL, STEP, 6.0) > 2 * baseline.standing(LEVEL, STEP, 2.5).expected
    assert baseline.standing(LEVEL, STEP, 0.0) is None
    assert baseline.standing(LEVEL, STEP, math.nan) is None


def test_a_constant_indicator_does_not_make_every_change_a_fault():
    baseline = learnt([3.0] * 50)
    assert baseline.standing(KEY, STEP, 3.01).significance < 1.0
    assert baseline.standing(KEY, STEP, 4.6).significance > 6.0


def test_speeds_are_learnt_apart():
    learner = BaselineLearner("rig")
    rng = np.random.default_rng(5)
    for speed, level in ((10.0, 1.0), (20.0, 4.0)):
        for value in level * (1 + 0.02 * rng.standard_normal(40)):
            learner.add(LEVEL, speed_step(speed), float(value))
    learner.add(LEVEL, speed_step(14.0), 2.0)  # seen once: too little
    baseline = learner.finish(60.0)
    assert baseline.standing(LEVEL, speed_step(10.2), 4.0).significance > 6
    assert baseline.standing(LEVEL, speed_step(20.0), 4.0).significance < 3
    assert baseline.standing(LEVEL, speed_step(14.0), 2.0) is None
    assert baseline.tests == 1
    assert baseline.speeds_hz() == pytest.approx([10, 20], rel=0.05)
    assert baseline.standing(LEVEL, speed_step(10.0) + 1, 4.0).significance > 6  # its neighbour speaks for it
    assert speed_step(math.nan) == speed_step(0.0) != speed_step(1.0)


def test_a_baseline_on_disk_is_the_same_again(tmp_path):
    baseline = learnt(np.random.default_rng(6).standard_normal(50))
    path = tmp_path / "deep" / "rig.json"
    save_baseline(baseline, path)
    again = load_baseline(path, "rig")
    assert again.cells == baseline.cells
    assert (again.machine, again.seconds) == ("rig", 60.0)
    assert [entry.name for entry in path.parent.iterdir()] == ["rig.json"]
    other = learnt([1.0] * 20, LEVEL)
    both = again.extended(other)
    assert set(both.cells) == {(KEY, STEP), (LEVEL, STEP)}
    assert both.seconds == 120.0


def test_a_file_that_is_none_of_it_is_refused_in_one_line(tmp_path):
    path = tmp_path / "rig.json"
    with pytest.raises(InputError, match="a stored baseline"):
        load_baseline(path, "rig")
    path.write_text("{")
    with pytest.raises(InputError, match="a stored baseline"):
        load_baseline(path, "rig")
    save_baseline(learnt([1.0, 2.0] * 10), path)
    with pytest.raises(InputError, match="machine: got rig, expected other"):
        load_baseline(path, "other")
    content = json.loads(path.read_text())
    content["cells"][0]["mean"] = math.nan
    path.write_text(json.dumps(content))
    with pytest.raises(InputError, match="numbers of kurtosis on b3_y"):
        load_baseline(path, "rig")
    path.write_text(json.dumps(content | {"format": "something 9"}))
    with pytest.raises(InputError, match="format: got something 9"):
        load_baseline(path, "rig")


def test_too_few_windows_are_told():
    with pytest.raises(InputError, match="windows: got 4, expected 10 or more"):
        learnt([1.0] * 4)


def test_learning_stays_within_its_memory():
    learner = BaselineLearner("rig")
    for k in range(learner.MOST_CELLS + 500):
        learner.add(("s", str(k), "", "rms"), 0, 1.0)
    assert len(learner._sums) == learner.MOST_CELLS


def test_kinds_know_the_indicators_of_the_nodes():
    assert kind_of("rms").ratio
    assert kind_of("bpfo_modulation").judged
    for name in ("band_rms", "bpfo_snr", "impulsiveness_significance", "something_new"):
        assert not kind_of(name).judged  # the band changes, or a test of their own exists already
    assert all(kind.judged for _, kind in KINDS)
    assert kind_of("rms").plain(kind_of("rms").scaled(3.7)) == pytest.approx(3.7)
