"""What differs, told with false discoveries under control, merged and in words; and scores."""

from dataclasses import replace

import numpy as np
import pytest
from compare_signals import BPFO_SEEDS, impacts, lines, machine, measured, noise, plan_of, record, view
from scipy import stats

from gearsim_dsp.kinematics import bearing_orders
from gearsim_io.errors import InputError
from gearsim_twin.compare.discrepancy import NU, compare, pooled, significant
from gearsim_twin.compare.features import Features
from gearsim_twin.compare.levels import Levels
from gearsim_twin.compare.merged import base, discrepancies
from gearsim_twin.compare.places import Place
from gearsim_twin.score import score_models

BPFO = bearing_orders(machine().bearings[0]).bpfo
TAU = {"psd": 1.0, "orders": 0.5}
BANDS = tuple(Place("psd", "a", "band", 100.0 * 1.12**k, "Hz", 12.0 * 1.12**k) for k in range(40))
LINES = tuple(Place("orders", "a", "mesh", 32.0 * k, "order", 0.1, f"{k} x mesh gears") for k in range(1, 5))


def by_hand(places, level, std=1.0, height=np.inf, speed_hz=10.0) -> Features:
    level = np.broadcast_to(np.asarray(level, dtype=float), (len(places),)).copy()
    std = np.broadcast_to(np.asarray(std, dtype=float), level.shape).copy()
    height = np.broadcast_to(np.asarray(height, dtype=float), level.shape).copy()
    clear = np.where(np.isinf(height), 0.0, 3.0)
    return Features(places, Levels.of(level, std, height_db=height, clear_db=clear), speed_hz)


def test_differences_are_in_standard_deviations_of_both_sides_and_tau():
    places = (BANDS[0], LINES[0])
    found = compare(by_hand(places, [3.0, 1.0], 0.6), by_hand(places, [0.0, 2.0], 0.8), TAU)
    np.testing.assert_allclose(found.difference_db, [3.0, -1.0])
    expected = np.sqrt(np.array([1.0, 1.0]) + np.array([1.0, 0.25]))
    np.testing.assert_allclose(found.std_db, expected)
    np.testing.assert_allclose(found.z, [3.0, -1.0] / expected)
    loglike = stats.t.logpdf([3.0, -1.0] / expected, NU) - np.log(expected)
    assert found.loglike == pytest.approx(loglike.sum())
    assert found.by_domain["psd"].loglike == pytest.approx(loglike[0])
    assert found.by_domain["orders"].rms_db == pytest.approx(1.0)


def test_lines_in_the_noise_of_both_sides_and_places_that_say_nothing_do_not_count():
    places = (*LINES, BANDS[0])
    real = by_hand(places, [10.0, 0.0, np.nan, 0.0, 0.0], height=[20.0, 1.0, 20.0, 1.0, np.inf])
    model = by_hand(places, [0.0, 5.0, 0.0, 9.0, 0.0], height=[1.0, 1.0, 20.0, 9.0, np.inf])
    found = compare(real, model)
    assert found.counted.tolist() == [True, False, False, True, True]
    assert found.difference_db.tolist() == [10.0, 0.0, 0.0, -9.0, 0.0]
    assert found.z[1] == 0.0
    assert np.all(np.isfinite(found.z))


def test_a_line_off_its_place_by_its_width_counts_six_decibels():
    place = (Place("envelope", "a", "ratio", 4.88, "order", 0.5, "BPFO of b"),)
    found = compare(by_hand(place, -0.75, 0.05), by_hand(place, 0.25, 0.05), {"envelope": 0.0})
    assert found.difference_db[0] == pytest.approx(-12.0)
    assert found.z[0] == pytest.approx(-1.0 / np.hypot(0.05, 0.05))


def test_false_discoveries_are_as_rare_as_asked():
    rng = np.random.default_rng(0)
    shares = []
    for _ in range(200):
        truth = np.where(np.arange(40) < 6, 12.0, 0.0)
        real = by_hand(BANDS, truth + stats.t.rvs(NU, size=40, random_state=rng))
        told = significant(compare(real, by_hand(BANDS, 0.0, 1e-9), {"psd": 0.0}), 0.1)
        assert told[:6].sum() >= 4
        shares.append(told[6:].sum() / max(told.sum(), 1))
    # Benjamini and Hochberg promise 0.1 * 34 / 40; 200 shares are known to 0.02
    assert np.mean(shares) < 0.1
    assert np.mean(shares) > 0.02


def test_neighbours_that_differ_together_are_one():
    level = np.zeros(44)
    level[5:9], level[7], level[9:12], level[41:43] = 15.0, 1.0, -15.0, 20.0
    both = (*BANDS, *LINES)
    found = discrepancies([compare(by_hand(both, level), by_hand(both, 0.0))])
    assert [(d.domain, len(d.places)) for d in found] == [("orders", 2), ("psd", 3), ("psd", 3)]
    assert found[0].size_db == pytest.approx(20.0)
    assert found[0].where == "lines at 640 Hz and 1 more (mesh gears) of a"
    assert {round(d.size_db) for d in found[1:]} == {15, -15}
    assert found[0].words().endswith("measured 20.0 dB above the model")
    assert found[1].id == "d2"
    assert found[0].explained("tooth_wear").to_json() == {
        "id": "d1",
        "domain": "orders",
        "where": found[0].where,
        "size_db": 20.0,
        "z": pytest.approx(found[0].z, abs=0.01),
        "explained_by": "tooth_wear",
    }


def test_one_family_is_one_discrepancy_in_all_channels_and_bands():
    found = [
        Place("envelope", channel, "line", 4.84 * k, "order", 0.1, f"{k} x BPFO of bearing_3", band)
        for channel in ("a", "b")
        for band in ((3e3, 6e3), (6e3, 12e3))
        for k in (1, 2)
    ]
    places = tuple(found)
    (one,) = discrepancies(
        [compare(by_hand(places, np.linspace(9, 20, 8)), by_hand(places, 0.0, height=0.0))]
    )
    assert one.where.startswith(
        "lines at 48.4 Hz and multiples (BPFO of bearing_3) in the envelope of 2 bands"
    )
    assert one.where.endswith("of b, a")
    assert base("2 x mesh gears +1 x input") == "mesh gears"
    assert base("tone at 3 x 50 Hz of a supply") == "tone at 3 x 50 Hz of a supply"


def test_records_are_pooled_without_becoming_surer():
    one = compare(by_hand(BANDS, 3.0), by_hand(BANDS, 0.0))
    both = pooled([one, one])
    np.testing.assert_allclose(both.z, one.z)
    np.testing.assert_allclose(both.difference_db, one.difference_db)
    with pytest.raises(InputError, match="places"):
        pooled([one, compare(by_hand(LINES, 0.0), by_hand(LINES, 0.0))])
    with pytest.raises(InputError, match="places"):
        compare(by_hand(BANDS, 0.0), by_hand(LINES, 0.0))


def test_a_spall_that_the_model_lacks_is_told_first_and_by_its_frequency():
    struck = [record(noise(s) + lines() + impacts(s, BPFO)) for s in BPFO_SEEDS[:2]]
    plan = plan_of(*(view(one) for one in struck))
    sound = [measured(record(noise(s) + lines()), plan) for s in BPFO_SEEDS[2:4]]
    found = discrepancies([compare(measured(a, plan), b) for a, b in zip(struck, sound, strict=True)])
    assert "48.9 Hz and multiples (BPFO of bearing_1" in found[0].where
    assert found[0].size_db > 10
    assert all(d.size_db > 0 for d in found)
    assert not [d for d in found if d.domain == "orders" and d.places[0].kind in ("mesh", "shaft")]


def test_scores_are_weighted_differences_over_the_noise_floor():
    real = by_hand(BANDS, 0.0, 0.6)
    model = by_hand(BANDS, np.where(np.arange(40) % 2, 2.0, -2.0), 0.8)
    better = replace(by_hand(BANDS, 1.0, 0.8))
    scores = score_models([real], {"baseline": [model], "extended": [better]})
    psd = scores.by_domain["psd"]
    assert psd.models["baseline"].value == pytest.approx(2.0)
    assert psd.noise_floor == pytest.approx(1.0)
    assert psd.places == 40
    assert scores.overall.models["extended"].value == pytest.approx(1.0)
    assert scores.closed("baseline", "extended", "psd") == pytest.approx(1.0)
    low, high = psd.models["baseline"].ci95
    assert low <= 2.0 <= high
    assert np.isnan(scores.closed("extended", "baseline"))


def test_all_models_are_scored_at_the_same_places_and_silence_is_bounded():
    real = by_hand(LINES, 0.0, height=[20.0, 1.0, 1.0, 1.0])
    silent = by_hand(LINES, -300.0, height=0.0)
    noisy = by_hand(LINES, 5.0, height=[20.0, 20.0, 1.0, 1.0])
    scores = score_models([real], {"silent": [silent], "noisy": [noisy]})
    assert scores.overall.places == 2
    assert scores.overall.models["silent"].value == pytest.approx(40.0)
    with pytest.raises(InputError, match="noisy"):
        score_models([real, real], {"noisy": [noisy]})


def test_a_lone_place_is_told_by_how_little_the_others_of_this_model_differ():
    rng = np.random.default_rng(4)
    level = 0.4 * rng.standard_normal(40)
    level[17] = 5.5
    known = {"psd": 0.0}

    def told(shown):
        return [
            p.at
            for d in discrepancies([compare(by_hand(BANDS, shown), by_hand(BANDS, 0.0, 1e-9), known)])
            for p in d.places
        ]

    # Of tails as heavy as for any model 5.5 standard deviations at one of 40 places are no certainty.
    assert told(level) == [BANDS[17].at]
    # The same of a model that errs by twice as much as is assumed of any.
    assert told(5.0 * level * (np.arange(40) != 17) + np.where(np.arange(40) == 17, 5.5, 0.0)) == []


def test_an_effect_that_fills_a_domain_is_no_error_of_the_model():
    assert len(discrepancies([compare(by_hand(BANDS, 15.0), by_hand(BANDS, 0.0))])[0].places) == 40


def test_few_places_do_not_hide_one_that_differs():
    tones = [replace(line, kind="tone", label="tone") for line in LINES[:2]]
    places = (*BANDS, *tones)
    level = np.concatenate([np.full(40, 0.2), [9.0, 0.3]])
    (one,) = discrepancies([compare(by_hand(places, level), by_hand(places, 0.0, 0.1))])
    assert one.places == (tones[0],)


def test_lines_of_the_machine_itself_are_told_by_what_any_model_errs_by_and_strange_ones_by_this_one():
    strange = Place("orders", "a", "tone", 411.0, "Hz", 3.0, "tone")
    own = replace(strange, at=811.0, label="10 x BPFO of bearing_1")
    level = np.concatenate([np.full(40, 0.1), [5.5, 5.5]])
    places = (*BANDS, strange, own)
    found = discrepancies([compare(by_hand(places, level), by_hand(places, 0.0, 1e-9), {})])
    assert [each.places for each in found] == [(strange,)]
