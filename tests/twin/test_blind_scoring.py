"""How verdicts of blind cases are scored, counted and told."""

from __future__ import annotations

import math
from typing import Any

import pytest
from blind.bounds import least_right, most_wrong
from blind.page import page
from blind.scoring import alike, score, tells
from blind.tally import Share, closed, coverage
from scipy.stats import binom


def _verdict(*names: str, word: str = "explained", where: str = "", **parameters: Any) -> dict[str, Any]:
    domain = {"baseline": 6.0, "tuned_only": 5.0, "extended": 2.0, "noise_floor": 1.0}
    causes = [
        {
            "name": name,
            "parameters": parameters if name == names[0] else {},
            "heldout_gain_db": 3.0,
            "probability": 0.9,
            "signature": "",
            "domain": "orders",
        }
        for name in names
    ]
    return {
        "verdict": word,
        "score": {"by_domain": {"orders": domain}},
        "discrepancies": [{"where": where, "explained_by": None}],
        "causes": causes,
        "rejected": [],
    }


def _truth(*names: str, hz: tuple[float, ...] = (), **parameters: float) -> dict[str, Any]:
    effects = [{"name": name, "parameters": parameters, "hz": list(hz)} for name in names]
    return {"effects": effects, "speed_hz": 10.0}


def _result(kind: str, verdict: dict[str, Any], truth: dict[str, Any], severity: str = "medium") -> Any:
    names = [(one["name"], severity) for one in truth["effects"]]
    told = {"seed": 1, "index": 0, "kind": kind, "severity": severity, "effects": names, "rig": "parallel"}
    return {**told, "score": score(truth, kind, verdict), "wall_s": 30.0, "cpu_s": 40.0, "verdict": verdict}


def test_a_single_effect_must_be_named_first() -> None:
    truth = _truth("unbalance")
    assert score(truth, "single", _verdict("unbalance", "mains_interference"))["strict"]
    late = score(truth, "single", _verdict("mains_interference", "unbalance"))
    assert (late["strict"], late["first"], late["second"]) == (False, "mains_interference", "unbalance")
    assert late["false"] == ["mains_interference"]
    assert not score(truth, "single", _verdict(word="consistent"))["strict"]


def test_families_count_apart_and_as_one() -> None:
    told = score(_truth("cage_slip"), "single", _verdict("bearing_geometry"))
    assert (told["strict"], told["lenient"], told["false"]) == (False, True, [])
    assert not alike("unbalance", "misalignment")


def test_a_cause_that_could_only_stand_in_for_another_is_not_named_first() -> None:
    verdict = _verdict("bearing_geometry", "cage_slip")
    verdict["causes"][0]["instead_of"] = "cage_slip"
    assert score(_truth("cage_slip"), "single", verdict)["strict"]


def test_nothing_hidden_allows_no_cause() -> None:
    assert score(_truth(), "none", _verdict(word="consistent"))["strict"]
    assert not score(_truth(), "none", _verdict("unbalance"))["strict"]
    assert score(_truth(), "none", _verdict("unknown", word="unknown"))["strict"]


def test_both_of_a_pair_must_be_named() -> None:
    truth = _truth("unbalance", "mains_interference")
    assert score(truth, "pair", _verdict("mains_interference", "unbalance"))["strict"]
    assert not score(truth, "pair", _verdict("unbalance"))["strict"]


@pytest.mark.parametrize(
    ("where", "told"),
    [
        ("lines at 147.2 Hz and multiples", True),
        ("lines at order 14.71 of the input shaft", True),
        ("lines at 0.1471 kHz", True),
        ("lines at 160 Hz", False),
        ("in the band 2-4 kHz", False),
    ],
)
def test_what_is_unknown_must_be_told_with_its_frequency(where: str, told: bool) -> None:
    assert tells(_verdict("unknown", word="unknown", where=where), [147.1], 10.0) is told
    result = score(
        _truth("unknown", hz=(147.1,)), "outside", _verdict("unknown", word="unknown", where=where)
    )
    assert result["strict"]
    assert result["lenient"] is told


def test_a_frequency_in_what_has_been_explained_does_not_count() -> None:
    verdict = _verdict("unbalance", where="lines at 147.1 Hz")
    verdict["discrepancies"][0]["explained_by"] = "unbalance"
    assert not tells(verdict, [147.1], 10.0)


def test_intervals_and_gaps_are_counted() -> None:
    number = {"value": 1.1, "unit": "1", "ci95": [0.9, 1.3]}
    inside = _result(
        "single", _verdict("unbalance", unbalance_kg_m=number), _truth("unbalance", unbalance_kg_m=1.0)
    )
    outside = _result(
        "single", _verdict("unbalance", unbalance_kg_m=number), _truth("unbalance", unbalance_kg_m=2.0)
    )
    total, by_name = coverage([inside, outside])
    assert (total.hits, total.of) == (1, 2)
    assert list(by_name) == ["unbalance.unbalance_kg_m"]
    assert closed([inside]).tolist() == [pytest.approx(0.8)]
    assert closed([inside], "closed_by_tuning").tolist() == [pytest.approx(0.2)]


def test_shares_come_with_wilsons_interval() -> None:
    low, high = Share(8, 10).interval
    assert (low, high) == (pytest.approx(0.4902, abs=1e-4), pytest.approx(0.9433, abs=1e-4))
    assert math.isnan(Share(0, 0).value)


def test_bounds_pass_a_judge_that_reaches_its_target_999_times_in_1000() -> None:
    for count in (1, 4, 12, 60):
        bound = least_right(count, 0.95)
        assert binom.sf(bound - 1, count, 0.95) >= 0.999
        assert bound == count or binom.sf(bound, count, 0.95) < 0.999
        wrong = most_wrong(count, 0.02)
        assert binom.cdf(wrong, count, 0.02) >= 0.999
        assert wrong == 0 or binom.cdf(wrong - 1, count, 0.02) < 0.999


def test_the_page_counts_lost_cases_as_wrong_and_says_when_there_are_few() -> None:
    good = _result("single", _verdict("unbalance"), _truth("unbalance"))
    gone = {
        "seed": 1,
        "index": 9,
        "kind": "single",
        "severity": "strong",
        "rig": "parallel",
        "failed": "too late",
    }
    gone["effects"] = [("unbalance", "strong")]
    text = page([good, gone], "2026-01-01", "./gearsim bench --blind 2")
    assert "named first | 1 of 2 (50.0 %" in text
    assert "are fewer than the 300" in text
    assert "too late" in text
    assert "seed 1: cases 0, 9" in text
    assert "| unbalance | unbalance 1, (not done) 1 |" in text
