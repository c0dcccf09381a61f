"""The page that tells how the judge did."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from blind.detector import THRESHOLD_DB
from blind.effects import TARGETS_DB
from blind.tally import Share, closed, confusion, coverage, judged, lost, mild_enough, of_kind, right, share

Result = dict[str, Any]
_FEW = 300


def page(results: Sequence[Result], when: str, command: str) -> str:
    """Markdown of all results.

    Parameters
    ----------
    results : sequence of dict
        As `blind.one` gives them.
    when : str
        Dates of the runs.
    command : str
        That makes them anew.
    """
    parts = [_head(results, when, command), _goals(results), _baselines(results), _before(results)]
    parts = [part for part in [*parts, _severities(results)] if part]
    return "\n\n".join([*parts, _confusion(results), _coverage(results), _lost(results)]).rstrip() + "\n"


def _head(results: Sequence[Result], when: str, command: str) -> str:
    runs: dict[str, list[int]] = {}
    for one in results:
        of_rig = f", {one['only']} rig only" if one.get("only") else ""
        runs.setdefault(f"seed {one['seed']}{of_rig}", []).append(one["index"])
    ranges = "; ".join(f"{run}: {_numbers(indices)}" for run, indices in sorted(runs.items()))
    counted = Counter(one["rig"] for one in results)
    rigs = ", ".join(f"{name} {n}" for name, n in counted.most_common())
    few = (
        f"\n\n**{len(results)} cases are fewer than the {_FEW} that are asked for: the intervals say how "
        "sure the shares are.**"
        if len(results) < _FEW
        else ""
    )
    levels = ", ".join(f"{db:g}" for db in TARGETS_DB)
    return f"""# Blind tests of the judge

Written by `{command}`, nothing by hand.

{len(results)} cases ({ranges}), run {when}; by rig: {rigs}.{few}

Each case is a machine with something hidden in it, or with nothing, made by a simulator that is not the
product's (`tests/twin/blind`): Runge-Kutta of fourth order at 131 kHz, numbers of the machine some per cent
off, teeth, noise, gain, speed, load and angles of its own; two records to learn from, one held out. The judge
is `gearsim twin`, in a process that sees the records only; each file it opens is checked. *Mild*, *medium*,
*strong* stand {levels} dB out of noise and machine on the very machine of the case, by one yardstick for all
effects (`tests/twin/blind/severity.py`, `sizing.py`); gains are 6, 12, 19.8 dB; labels, swings of the speed,
clipping, dropouts and play have given sizes. Where a machine shows no more than four fifths of the decibels
at any size (a pit wider than what a ball bridges), that is enough; what stays below is not hidden there.
`oil_film` is not among the effects: on sound bearings it changes what is below any sensor's noise. What
shapes the vibration of the bearing rig (gains, roll-off, resonances of sensor and casing) is measured with
quiet sensors (10 ug/sqrt(Hz)), its spalls in a loud hall. Of a noise floor the judge cannot know how high it
should be: those hidden differ by their colour.
Of machines with gears the judge gets one or two records from before (`--healthy`: other runs of the same
machine and sensors, without effects), where an effect is of the machine, and where there is none.
Shares are given with Wilson's interval of 95 %. A case that ends without a verdict counts as wrong."""


def _numbers(indices: Sequence[int]) -> str:
    """Numbers of cases, neighbours joined: 0-3, 7."""
    parts: list[list[int]] = []
    for index in sorted(indices):
        if parts and index == parts[-1][-1] + 1:
            parts[-1].append(index)
        else:
            parts.append([index])
    return "cases " + ", ".join(f"{part[0]}-{part[-1]}" if len(part) > 1 else str(part[0]) for part in parts)


def _goals(results: Sequence[Result]) -> str:
    sure = of_kind(results, "single", "medium", "strong")
    mild, none = of_kind(results, "single", "mild"), of_kind(results, "none")
    pairs, outside = of_kind(results, "pair"), of_kind(results, "outside")
    missed = [one for one in mild if not right("strict")(one)]
    all_of_them, _ = coverage(results)
    wall = np.array([one["wall_s"] for one in results if "wall_s" in one] or [np.nan])
    cpu = np.array([one["cpu_s"] for one in results if "cpu_s" in one] or [np.nan])
    gap = closed(results)
    rows = [
        ("single effect, medium or strong: named first", share(sure, right("strict")), "95 %"),
        ("- the same, families told as one (below)", share(sure, right("lenient")), ""),
        ("single effect, mild: named first", share(mild, right("strict")), "80 %"),
        ("- of the rest: nothing said, or the right one second", share(missed, mild_enough), "most"),
        ("none: false causes", share(none, lambda one: bool(one.get("score", {}).get("causes"))), "<= 2 %"),
        ("outside the library: says that it does not know all", share(outside, right("strict")), ""),
        ("- and tells the frequency", share(outside, right("lenient")), "90 %"),
        ("two effects: both among the causes", share(pairs, right("strict")), "85 %"),
        ("- or told as what could stand in another's place", share(pairs, right("lenient")), ""),
        ("95 % intervals of parameters that hold the truth", all_of_them, "90 to 98 %"),
        (
            "any case: a cause named that is not hidden",
            share(judged(results), lambda one: bool(one["score"]["false"])),
            "",
        ),
        ("gap closed by 80 % and more, of gaps over 0.5 dB", Share(int(np.sum(gap >= 0.8)), gap.size), "all"),
    ]
    lines = ["## Against the goals", "", "| | found | goal |", "|---|---|---|"]
    lines += [f"| {name} | {value} | {goal} |" for name, value, goal in rows]
    middle = float(np.median(gap)) if gap.size else float("nan")
    lines += [
        f"| share of the gap closed, median | {middle:.2f} | 0.8 |",
        f"| time of a case, median and longest | {_times(wall)} | 60 s |",
        f"| processor time of a case, median and longest | {_times(cpu)} | |",
    ]
    lines += ["", _alike()]
    return "\n".join(lines)


def _times(seconds: np.ndarray) -> str:
    return f"{np.nanmedian(seconds):.0f} and {np.nanmax(seconds):.0f} s"


def _alike() -> str:
    from blind.scoring import ALIKE

    pairs = "; ".join(" and ".join(sorted(family)) for family in ALIKE)
    return f"Told as one, since records at one speed and load cannot part them: {pairs}."


def _baselines(results: Sequence[Result]) -> str:
    done = judged(results)
    hidden = [one for one in done if one["kind"] != "none"]
    none = [one for one in done if one["kind"] == "none"]
    tuned, extended = closed(results, "closed_by_tuning"), closed(results)

    def alarm(one: Result) -> bool:
        return one.get("detector", {}).get("largest_db", 0.0) > THRESHOLD_DB[one["rig"]]

    def speaks(one: Result) -> bool:
        return one["score"]["word"] != "consistent"

    def middle(values: np.ndarray) -> str:
        return f"{np.median(values):.2f}" if values.size else "-"

    return "\n".join(
        [
            "## Beside two baselines, on the same cases",
            "",
            "| | the judge | tuning of parameters only | third octaves and crest against a threshold |",
            "|---|---|---|---|",
            f"| something hidden: says that something differs | {share(hidden, speaks)} | says nothing | "
            f"{share(hidden, alarm)} |",
            f"| nothing hidden: says that something differs | {share(none, speaks)} | says nothing | "
            f"{share(none, alarm)} |",
            f"| names the right cause first (single) | {share(of_kind(done, 'single'), right('strict'))} | "
            "names none | names none |",
            f"| share of the held-out gap closed, median | {middle(extended)} | {middle(tuned)} | - |",
        ]
    )


def _before(results: Sequence[Result]) -> str:
    """What records from before are worth: cases that were judged with and without them."""
    both = [one for one in judged(results) if one.get("without_healthy")]
    if not both:
        return ""
    alone = [{**one, "score": one["without_healthy"]} for one in both]
    lines = [
        "## With and without records of the healthy machine",
        "",
        f"{len(both)} cases, every third of those that have such records, were judged without them as well.",
        "",
        "| | with | without |",
        "|---|---|---|",
    ]
    rows: list[tuple[str, str, Callable[[Result], bool]]] = [
        ("single effect: named first", "single", right("strict")),
        ("two effects: both among the causes", "pair", right("strict")),
        ("none: false causes", "none", lambda one: bool(one["score"]["causes"])),
    ]
    for name, kind, counted in rows:
        sides = [share(of_kind(each, kind), counted) for each in (both, alone)]
        lines.append(f"| {name} | {sides[0]} | {sides[1]} |")
    gaps = [closed(each) for each in (both, alone)]
    middle = [f"{np.median(gap):.2f}" if gap.size else "-" for gap in gaps]
    lines.append(f"| share of the gap closed, median | {middle[0]} | {middle[1]} |")
    return "\n".join(lines)


def _severities(results: Sequence[Result]) -> str:
    lines = ["## By cause", "", "| hidden | mild | medium | strong | parameters in their intervals |"]
    lines += ["|---|---|---|---|---|"]
    singles = of_kind(results, "single")
    for name in sorted({one["effects"][0][0] for one in singles}):
        own = [one for one in singles if one["effects"][0][0] == name]
        cells = []
        for severity in ("mild", "medium", "strong"):
            counted = share([one for one in own if one["severity"] == severity], right("strict"))
            cells.append(f"{counted.hits} of {counted.of}" if counted.of else "-")
        inside, _ = coverage(own)
        cells.append(f"{inside.hits} of {inside.of}" if inside.of else "-")
        lines.append(f"| {name} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _confusion(results: Sequence[Result]) -> str:
    lines = ["## What was named first", "", "| hidden | named first, or the verdict |", "|---|---|"]
    for hidden, said in confusion(results).items():
        lines.append(f"| {hidden} | " + ", ".join(f"{name} {n}" for name, n in said.most_common()) + " |")
    return "\n".join(lines)


def _coverage(results: Sequence[Result]) -> str:
    lines = ["## Intervals", "", "| parameter | hold the truth |", "|---|---|"]
    lines += [f"| {name} | {value.hits} of {value.of} |" for name, value in coverage(results)[1].items()]
    return "\n".join(lines)


def _lost(results: Sequence[Result]) -> str:
    gone = lost(results)
    if not gone:
        return ""
    lines = ["## Without a verdict", "", "| seed, case | hidden | why |", "|---|---|---|"]
    for one in gone:
        names = ", ".join(name for name, _ in one["effects"]) or "nothing"
        lines.append(f"| {one['seed']}, {one['index']} | {names} ({one['rig']}) | {one.get('failed', '')} |")
    return "\n".join(lines)
