"""A sample of the blind tests that is small enough to run always: short records of the quickest rig.

The whole table is `./gearsim bench --blind` (docs/blind.md). Seeds and effects were chosen before any was
judged. So few cases can only tell a judge that is broken from one that is not: the bounds are those that a
judge with the rates asked for passes 999 times in 1000.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from blind.bounds import least_right, most_wrong
from blind.making import make, write
from blind.plan import drawn
from blind.rigs import RIGS
from blind.scoring import score

from gearsim_twin.case import load_case
from gearsim_twin.judge import judge
from gearsim_twin.settings import Settings

RIG = RIGS["bearing"]
SECONDS = 1.2
NAMED_FIRST, FALSE = 0.95, 0.02  # shares asked for, of strong effects and of nothing
# Less effort than usual: a round less, and fewer machines to learn chance from.
SETTINGS = Settings(most_causes=2, fits=3, most_guesses=30, seeds=3)
CASES = (
    ("mains_interference", 31),
    ("bearing_spall_outer", 32),
    ("unbalance", 33),
    ("inverter_lines", 34),
    ("", 35),
)


def _score(name: str, seed: int, folder: Path) -> dict[str, Any]:
    made = make(*drawn(RIG.name, ((name, "strong"),) if name else (), (seed,)), seconds=SECONDS)
    first, second, held_out = map(str, write(made, folder))
    case = load_case([first, second], RIG.machine, RIG.model, holdout=[held_out])
    verdict = judge(case, SETTINGS, folder / "extended.yaml").to_json()
    return {"hidden": name, **score(made.truth, "single" if name else "none", verdict)}


@pytest.mark.timeout(900)  # 40 s of an idle processor; loaded ones take their time
def test_strong_effects_are_named_and_nothing_is_not(tmp_path: Path) -> None:
    told = []
    for name, seed in CASES:
        folder = tmp_path / str(seed)
        folder.mkdir()
        told.append(_score(name, seed, folder))
    hidden, none = [one for one in told if one["hidden"]], [one for one in told if not one["hidden"]]
    said = [(one["hidden"], one["word"], one["causes"]) for one in told]
    assert sum(one["strict"] for one in hidden) >= least_right(len(hidden), NAMED_FIRST), said
    assert sum(not one["strict"] for one in none) <= most_wrong(len(none), FALSE), said
