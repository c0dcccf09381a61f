"""docs/evaluation.md: what an evaluation measured, written by the command alone."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from typing import Any

from gearsim_bringup.evaluation.score import (
    Rate,
    calibration,
    is_right,
    judged,
    rate,
    rate_of_healthy,
    rates_by_kind,
)

__all__ = ["evaluation_page", "summary"]

Result = dict[str, Any]

_HEAD = """# How often the diagnosis is right

Written by `./gearsim evaluate --page docs/evaluation.md` from the results of the runs below, nothing by hand.
Every case is a machine of its own: random teeth, bearings, masses, springs and gear errors
(`gearsim_bringup/evaluation/machines.py`), random speed (5 to 30 Hz of the input shaft), load and noise,
and no fault, one or two of random kind, place and size. It is simulated and diagnosed from nameplate, tachos,
encoders and accelerometers. Right means component and fault; of wheels that turn at one speed the mesh
counts, of planets the stage. Thresholds and weights were fitted to other seeds than are judged here. Shares
are given with Wilson's interval of 95 %.
"""

_SETS = {
    "random": "Random faults of random size, noise from a laboratory's to one in which weak faults drown.",
    "healthy": "Healthy machines under the same noise.",
    "thesis": "Faults at the sizes of the thesis (spalls of 0.8 mm in bearings; a slot or a 1 mm channel "
    "in a tooth), laboratory sensors.",
    "table77": "Thesis Table 7.7: the planetary insert's own teeth; masses, springs, speed, load, tooth and "
    "planet by the seed.",
}


def evaluation_page(results: Sequence[Result]) -> str:
    """The page for results of any sets and seeds."""
    groups: dict[tuple[str, str], list[Result]] = defaultdict(list)
    for one in results:
        set_name, seed, _ = one["name"].rsplit("-", 2)
        groups[set_name, seed].append(one)
    parts = [_HEAD]
    for set_name in _SETS:
        for (name, seed), own in sorted(groups.items()):
            if name == set_name:
                parts.append(_section(set_name, seed, own))
    return "\n".join(parts)


def summary(results: Sequence[Result]) -> dict[str, Any]:
    """The numbers for programs."""
    fine = judged(results)
    sure = [one for one in calibration(fine) if one.low >= 0.9]
    told = Rate(sum(one.right.hits for one in sure), sum(one.right.trials for one in sure))
    return {
        "cases": len(fine),
        "refused": len(results) - len(fine),
        "solved": rate(fine).value,
        "healthy_with_finding": rate_of_healthy(fine).value,
        "right_of_findings_at_0.9": told.value,
        "findings_at_0.9": told.trials,
    }


def _section(set_name: str, seed: str, results: list[Result]) -> str:
    fine = judged(results)
    lines = [f"## Set `{set_name}`, seed {seed}: {len(fine)} cases", "", _SETS[set_name], ""]
    if len(fine) < len(results):
        refused = len(results) - len(fine)
        lines += [f"{refused} further machines were refused by the simulator and count for nothing.", ""]
    healthy, faulty = rate_of_healthy(fine), [one for one in fine if one["truths"]]
    lines += ["| | |", "|---|---|", f"| healthy machines with a finding | {healthy} |"]
    lines += [f"| faulty machines: exactly the truth found | {rate(faulty)} |"]
    if set_name == "random":
        lines += [f"| of these with two faults | {rate([one for one in faulty if len(one['truths']) > 1])} |"]
    if set_name == "table77":
        lines += _counts(fine)
    if any(truth["side"] for one in fine for truth in one["truths"]):
        lines += _sides(fine)
    lines += [f"| CPU time of a diagnosis, median | {_median([one['cpu_s'] for one in fine]):.2f} s |", ""]
    if faulty:
        lines += _faults(fine) + _confidences(fine)
        if set_name == "random":
            lines += _over(fine, "noise_density", "noise density, m/s^2 per root hertz")
    return "\n".join(lines) + "\n"


def _counts(fine: list[Result]) -> list[str]:
    faulty = [one for one in fine if one["truths"]]
    counts = Rate(sum(_count_is_right(one) for one in faulty), len(faulty))
    return [f"| impulses in four turns of the carrier counted as 32 or 16 | {counts} |"]


def _sides(fine: list[Result]) -> list[str]:
    spalls = [
        (truth["side"], finding["evidence"].get("side"))
        for one in fine
        for truth in one["truths"]
        for finding in one["findings"]
        if truth["side"] and finding["fault"] == truth["fault"]
    ]
    said = [(true, told) for true, told in spalls if told in ("sun", "ring")]
    right = Rate(sum(true == told for true, told in spalls), len(spalls))
    wrong = Rate(sum(true != told for true, told in said), len(said))
    return [
        f"| side of a planet's spall told rightly; the others are wrong or left open | {right} |",
        f"| side told wrongly, of those told | {wrong} |",
    ]


def _count_is_right(result: Result) -> bool:
    wanted = 32 if result["truths"][0]["fault"] == "planet_tooth_crack" else 16
    return any(f["evidence"].get("impulses_per_4_carrier_turns") == wanted for f in result["findings"])


def _faults(fine: list[Result]) -> list[str]:
    lines = ["| fault | found where it was | right where it was said |", "|---|---|---|"]
    lines += [f"| {word} | {found} | {said} |" for word, (found, said) in rates_by_kind(fine).items()]
    return [*lines, ""]


def _confidences(fine: list[Result]) -> list[str]:
    lines = ["| confidence | mean | right |", "|---|---|---|"]
    for one in calibration(fine):
        if one.right.trials:
            lines.append(f"| {one.low:g} to {one.high:g} | {one.mean_confidence:.3f} | {one.right} |")
    return [*lines, ""]


def _over(fine: list[Result], fact: str, words: str) -> list[str]:
    """Four parts of equal number along one of the facts of the cases."""
    faulty = sorted((one for one in fine if one["truths"]), key=lambda one: one["facts"][fact])
    lines = [f"| {words} | exactly the truth found | something false said |", "|---|---|---|"]
    for k in range(4):
        part = faulty[k * len(faulty) // 4 : (k + 1) * len(faulty) // 4]
        if part:
            wrong = Rate(sum(bool(one["findings"]) and not _nothing_false(one) for one in part), len(part))
            low, high = part[0]["facts"][fact], part[-1]["facts"][fact]
            lines.append(f"| {low:.2g} to {high:.2g} | {rate(part)} | {wrong} |")
    return [*lines, ""]


def _nothing_false(result: Result) -> bool:
    return all(is_right(one, result) for one in result["findings"])


def _median(values: list[float]) -> float:
    return sorted(values)[len(values) // 2] if values else math.nan
