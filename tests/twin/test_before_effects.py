"""Records from before an effect, of the blind tests: the same machine and sensors in other runs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from blind.judging import judge
from blind.making import Hidden, make, write
from blind.page import page
from blind.plan import planned
from blind.rigs import RIGS

SEED, SECONDS = (401, 5), 0.2


def test_records_from_before_are_of_the_same_machine_without_its_effects(tmp_path: Path) -> None:
    hidden = make(Hidden("bearing", (("bearing_spall_outer", 1e-3),)), SEED, 1, SECONDS, healthy=1)
    sound = make(Hidden("bearing", ()), SEED, 1, SECONDS, healthy=1)
    assert np.array_equal(hidden.healthy[0].data, sound.healthy[0].data)
    assert not np.array_equal(hidden.records[0].data, sound.records[0].data)
    # Another run: its own angle, speed and noise.
    other, own = (one.tachos[0].samples for one in (sound.healthy[0], sound.records[0]))
    assert not np.allclose(other[:5], own[:5], atol=0.5)
    assert hidden.truth["effects"]
    places = write(hidden, tmp_path)
    assert [place.name for place in places] == ["run_1"]
    assert sorted(each.name for each in tmp_path.iterdir()) == ["before_1", "run_1"]


def test_which_cases_have_records_from_before() -> None:
    cases = [planned(401, index) for index in range(240)]
    assert not any(case.healthy for case in cases if case.rig == "bearing" or case.kind == "outside")
    geared = [case for case in cases if case.rig != "bearing"]
    assert all(case.healthy in (1, 2) for case in geared if case.kind == "none")
    names = {name: case.healthy for case in geared if case.kind == "single" for name, _ in case.effects}
    assert all(names[name] for name in ("tooth_crack", "unbalance"))
    assert not any(names[name] for name in ("clipping", "speed_fluctuation"))


def test_the_judge_gets_them(tmp_path: Path) -> None:
    """A name that is not there is refused by the judge itself, under the option that it came by."""
    judged = judge([tmp_path / "a", tmp_path / "b"], RIGS["parallel"], [], healthy=[tmp_path / "c"])
    assert judged.verdict is None
    for name in ("a", "b"):
        (tmp_path / name).write_text("x")
    judged = judge([tmp_path / "a", tmp_path / "b"], RIGS["parallel"], [], healthy=[tmp_path / "gone"])
    assert str(tmp_path / "gone") in judged.said


def test_the_page_tells_what_they_are_worth() -> None:
    score = {
        "word": "explained", "causes": ["tooth_crack"], "first": "tooth_crack", "second": "", "false": [],
        "strict": True, "lenient": True, "says_unknown": False, "parameters": {},
        "gap_db": 2.0, "closed": 0.9,
        "closed_by_tuning": 0.4, "gain_db": 1.0,
    }  # fmt: skip
    plain = {
        "seed": 401, "index": 0, "kind": "single", "rig": "parallel", "effects": [["tooth_crack", "medium"]],
        "severity": "medium", "only": "", "truth": {"effects": []}, "score": score, "verdict": {},
        "detector": {"largest_db": 0.0}, "wall_s": 1.0, "cpu_s": 1.0,
    }  # fmt: skip
    assert "With and without" not in page([plain], "today", "bench")
    missed = {**score, "strict": False, "lenient": False, "causes": [], "first": "", "closed": 0.1}
    text = page([{**plain, "without_healthy": missed}], "today", "bench")
    rows = [line for line in text.splitlines() if line.startswith("| single effect: named first | 1 of 1")]
    assert len(rows) == 1
    assert "0 of 1" in rows[0]
