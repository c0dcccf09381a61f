"""The evaluation: cases follow from numbers, runs go on where they stopped, scores count what is right."""

import json
import math

import pytest
from click.testing import CliRunner

from gearsim_bringup.commands.evaluate import command
from gearsim_bringup.evaluation import rejudge, run
from gearsim_bringup.evaluation.cases import SETS, draw_case
from gearsim_bringup.evaluation.page import evaluation_page, summary
from gearsim_bringup.evaluation.rejudge import rejudged
from gearsim_bringup.evaluation.score import (
    Rate,
    calibration,
    is_right,
    rate,
    rate_of_healthy,
    rates_by_kind,
    solved,
)
from gearsim_io.errors import InputError


@pytest.mark.parametrize("set_name", SETS)
def test_a_case_follows_from_its_number(set_name):
    assert draw_case(set_name, 3, 5) == draw_case(set_name, 3, 5)
    assert draw_case(set_name, 3, 5).scenario["seed"] != draw_case(set_name, 4, 5).scenario["seed"]


def test_sets_hold_what_they_say():
    assert all(draw_case("healthy", 1, k).truths == () for k in range(10))
    kinds = {draw_case("thesis", 1, k).kind for k in range(5)}
    assert kinds == {
        "outer_race",
        "inner_race",
        "planet_tooth_crack",
        "planet_tooth_spall",
        "gear_tooth_spall",
    }
    drawn = [draw_case("random", 1, k) for k in range(60)]
    assert {len(one.truths) for one in drawn} == {0, 1, 2}
    assert all(5.0 * 32 / 90 <= one.facts["speed_hz"] <= 30.0 for one in drawn)


def test_an_unknown_set_is_refused():
    with pytest.raises(InputError, match="random"):
        draw_case("nonsense", 1, 0)


def finding(component, fault, confidence=0.95, **evidence):
    return {"component": component, "fault": fault, "confidence": confidence, "evidence": evidence}


def result(findings, truths=(), twin=False, name="random-1-0"):
    rows = [{"component": c, "fault": f, "side": "", "size_mm": None} for c, f in truths]
    facts = {"noise_density": 1e-3}
    return {
        "name": name,
        "truths": rows,
        "twin_wheels": twin,
        "findings": findings,
        "facts": facts,
        "cpu_s": 1.0,
    }


def test_what_counts_as_right():
    outer = [("bearing_1", "outer_race")]
    assert is_right(finding("bearing_1", "outer_race"), result([], outer))
    assert not is_right(finding("bearing_2", "outer_race"), result([], outer))
    assert not is_right(finding("bearing_1", "inner_race"), result([], outer))
    assert is_right(
        finding("insert.planet", "planet_tooth_crack"), result([], [("planet_2", "planet_tooth_crack")])
    )
    crack = [("gears.pinion", "gear_tooth_crack")]
    assert is_right(finding("gears", "gear_tooth_crack"), result([], crack, twin=True))
    assert not is_right(finding("gears.gear", "gear_tooth_crack"), result([], crack))
    assert is_right(finding("", "unknown"), result([], outer))
    assert not is_right(finding("", "unknown"), result([]))


def test_solved_needs_all_faults_and_nothing_else():
    both = [("bearing_1", "outer_race"), ("bearing_4", "inner_race")]
    right = [finding(*one) for one in both]
    assert solved(result(right, both))
    assert not solved(result(right[:1], both))
    assert not solved(result([*right, finding("bearing_3", "cage")], both))
    assert solved(result([]))
    assert not solved(result([finding("bearing_3", "cage")]))


def test_rates_and_calibration():
    results = [
        result([finding("bearing_1", "outer_race", 0.97)], [("bearing_1", "outer_race")]),
        result([finding("bearing_2", "outer_race", 0.55)], [("bearing_1", "outer_race")]),
        result([]),
        result([finding("", "unknown", 0.6)]),
    ]
    assert (rate(results).hits, rate(results).trials) == (2, 4)
    assert (rate_of_healthy(results).hits, rate_of_healthy(results).trials) == (1, 2)
    found, said = rates_by_kind(results)["outer_race"]
    assert (found.hits, found.trials, said.hits, said.trials) == (1, 2, 1, 2)
    bins = {(one.low, one.high): one for one in calibration(results)}
    assert (bins[0.95, 1.0].right.hits, bins[0.95, 1.0].right.trials) == (1, 1)
    assert (bins[0.5, 0.7].right.hits, bins[0.5, 0.7].right.trials) == (0, 2)


def test_wilsons_interval():
    """Of 95 in 100: 0.888 to 0.978 (tables of the score interval)."""
    low, high = Rate(95, 100).ci95
    assert (low, high) == (pytest.approx(0.8882, abs=1e-3), pytest.approx(0.9785, abs=1e-3))
    assert math.isnan(Rate(0, 0).value)
    assert Rate(0, 0).ci95 == (0.0, 1.0)


@pytest.fixture
def quick(monkeypatch):
    """Judgements without simulating: every case is answered with its own truths."""
    asked = []

    def answer(case):
        asked.append(case.name)
        found = [finding(truth.component, truth.fault, features={}) for truth in case.truths]
        rows = [{"component": t.component, "fault": t.fault, "side": t.side} for t in case.truths]
        return {**result(found, (), name=case.name), "set": case.set_name, "kind": case.kind, "truths": rows}

    monkeypatch.setattr(run, "judge_case", answer)
    return asked


def test_a_run_goes_on_where_it_stopped(quick, tmp_path):
    run.evaluate("random", 3, 1, tmp_path)
    with (tmp_path / run.RESULTS).open("a") as file:
        file.write('{"name": "random-1-3", "tru')  # cut off
    results = run.evaluate("random", 5, 1, tmp_path)
    assert quick == [f"random-1-{k}" for k in range(5)]
    assert [one["name"] for one in results] == quick
    assert len(run.read_results(tmp_path)) == 5


def test_a_diagnosis_that_breaks_counts_as_wrong(monkeypatch, tmp_path):
    def broken(_case):
        raise RuntimeError("no")

    monkeypatch.setattr(run, "judge_case", broken)
    results = run.evaluate("random", 2, 1, tmp_path)
    assert all("crashed" in one for one in results)
    assert rate(results).hits == 0


def test_the_command_writes_page_and_numbers(quick, tmp_path):
    page = tmp_path / "page.md"
    arguments = ["--cases", "8", "--seed", "2", "--out", str(tmp_path / "o"), "--page", str(page), "--json"]
    answer = CliRunner().invoke(command, arguments)
    assert answer.exit_code == 0, answer.output
    numbers = json.loads(answer.stdout)
    assert numbers["cases"] == len(quick) == 8
    text = page.read_text()
    assert "Set `random`, seed 2: 8 cases" in text
    assert "nan" not in text


def test_results_are_rejudged_with_the_present_weights():
    old = result(
        [finding("gears", "gear_tooth_crack", 0.1, kind_features=[2.0, 0.0, 0.3, 1.0, 0.3], features={})]
    )
    new = rejudged(old)
    assert old["findings"][0]["confidence"] == 0.1
    assert new["findings"][0]["confidence"] != 0.1
    assert new["findings"][0]["fault"] in ("gear_tooth_crack", "gear_tooth_spall")


def test_what_was_doubtful_is_weighed_anew_too(monkeypatch):
    old = result([])
    old["doubtful"] = [finding("gears", "gear_wear", 0.1, features={})]
    monkeypatch.setattr(rejudge, "confidence", lambda _fault, _features: 0.8)
    assert [one["fault"] for one in rejudged(old)["findings"]] == ["gear_wear"]
    monkeypatch.setattr(rejudge, "confidence", lambda _fault, _features: 0.2)
    assert rejudged(old)["findings"] == []


def test_a_refused_machine_counts_for_nothing():
    refused = {"name": "random-1-9", "set": "random", "kind": "x", "refused": "teeth: got 3"}
    assert summary([refused, result([])])["cases"] == 1
    assert "1 further machines were refused" in evaluation_page([refused, result([])])


def spall(name, side, told, count=16):
    evidence = {"features": {}, "side": told, "impulses_per_4_carrier_turns": count}
    said = {"component": "insert.planet", "fault": "planet_tooth_spall", "confidence": 0.9}
    one = result([{**said, "evidence": evidence}], [("planet_1", "planet_tooth_spall")], name=name)
    one["truths"][0]["side"] = side
    return one


def test_the_page_tells_sides_apart_from_those_left_open():
    cases = [("sun", "sun"), ("ring", "ring"), ("ring", "undecided"), ("ring", "sun")]
    results = [spall(f"table77-1-{k}", *one) for k, one in enumerate(cases)]
    text = evaluation_page(results)
    assert "wrong or left open | 2 of 4 (50.0 %" in text
    assert "of those told | 1 of 3 (33.3 %" in text
    assert "counted as 32 or 16 | 4 of 4" in text
    results[0]["findings"][0]["evidence"]["impulses_per_4_carrier_turns"] = 32
    assert "counted as 32 or 16 | 3 of 4" in evaluation_page(results)
