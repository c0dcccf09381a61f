"""`gearsim bench`: figures of speed and size, each beside its baseline."""

from __future__ import annotations

import os
import platform
import time
from pathlib import Path
from typing import Any

import click

from gearsim_bringup.options import ANY_PATH, example, json_option
from gearsim_bringup.ui import Voice

EXAMPLE = """
./gearsim bench
./gearsim bench --only sim --only dsp --json
./gearsim bench --only sim --peers
./gearsim bench --blind 300 --seed 1 --workers 2 --out out/blind --page docs/blind.md
./gearsim bench --blind 60 --rig bearing --out out/blind_bearing
./gearsim bench --blind 300 --scheduler tcp://node1:8786
"""


@click.command("bench", epilog=example(EXAMPLE))
@click.option(
    "--only", "groups", multiple=True, help="Group, repeatable (default: all but casing and setup)."
)
@click.option(
    "--peers", is_flag=True, help="Install other programs (ROSS) beside this one first, to be measured too."
)
@click.option(
    "--blind",
    type=click.IntRange(1),
    metavar="N",
    help="Let `twin` judge N machines with something hidden in them instead, and write the table.",
)
@click.option("--seed", default=1, show_default=True, type=click.IntRange(0), help="Of the blind cases.")
@click.option(
    "--rig",
    type=click.Choice(("bearing", "parallel", "planetary")),
    help="Blind cases of this rig only (default: of all three).",
)
@click.option(
    "--first", default=0, show_default=True, type=click.IntRange(0), help="Number of the first blind case."
)
@click.option(
    "--workers", default=1, show_default=True, type=click.IntRange(1, 256), help="Blind cases at a time."
)
@click.option("--scheduler", metavar="ADDRESS", default="", help="Dask scheduler that runs the blind cases.")
@click.option(
    "--out",
    type=ANY_PATH,
    default="out/blind",
    show_default=True,
    help="Folder of the blind cases' results; a run there is continued.",
)
@click.option("--page", type=ANY_PATH, help="Write the table of all results in the folder to this page.")
@click.option("--cache", type=ANY_PATH, help="Keep the records of blind cases here, and use those kept.")
@json_option
def command(
    groups: tuple[str, ...],
    peers: bool,
    blind: int | None,
    seed: int,
    first: int,
    rig: str | None,
    workers: int,
    scheduler: str,
    out: Path,
    page: Path | None,
    cache: Path | None,
    json_mode: bool,
) -> int:
    """Measure what the project promises: every figure as a ratio to a baseline of the same run.

    Groups: sim, dsp, bags, alarms, stream, casing, which takes minutes, and setup, which clones the project
    and sets it up anew.
    """
    if blind is not None:
        voice = Voice(json_mode=json_mode)
        numbers = range(first, first + blind)
        return _blind(voice, numbers, seed, rig or "", workers, scheduler, out, page, cache)
    from gearsim_bringup.bench.groups import DEFAULT, GROUPS
    from gearsim_bringup.bench.peers import install

    unknown = [name for name in groups if name not in GROUPS]
    if unknown:
        raise click.BadParameter(
            f"got {unknown[0]!r}, expected one of {', '.join(GROUPS)}", param_hint="--only"
        )
    voice = Voice(json_mode=json_mode)
    if peers:
        install(voice)
    figures = []
    for name in groups or DEFAULT:
        voice.say(f"{name} ...")
        for figure in GROUPS[name](voice):
            figures.append(figure)
            compared = ""
            if figure.baseline is not None:
                compared = f", {figure.ratio:.3g} of {figure.baseline[0]} ({figure.baseline[1]:.4g})"
            verdict = "met" if figure.met else "NOT MET"
            voice.say(
                f"  {figure.name:32} {figure.value:10.4g} {figure.unit}{compared}; goal {figure.goal}: "
                f"{verdict}"
            )
    voice.result({"machine": _machine(), "figures": [figure.as_json() for figure in figures]})
    return 0


def _blind(
    voice: Voice,
    numbers: range,
    seed: int,
    rig: str,
    workers: int,
    scheduler: str,
    out: Path,
    page: Path | None,
    cache: Path | None,
) -> int:
    """Run the blind cases and write their page, if one is asked for, else beside the results."""
    from gearsim_bringup.blind_run import Job, read_results, run_blind, write_page

    kept = "" if cache is None else str(cache.absolute())
    # One case has all cores; of several at a time each has one.
    own = min(2, os.cpu_count() or 1) if workers == 1 else 1
    jobs = [Job(seed, index, own, kept, rig) for index in numbers]

    def tell(result: dict[str, Any], done: int, total: int) -> None:
        hidden = ", ".join(f"{name} ({how})" for name, how in result.get("effects", ())) or "nothing"
        told = result.get("score")
        said = result.get("failed", "") if told is None else ", ".join(told["causes"]) or told["word"]
        voice.say(f"{done}/{total}: {hidden}: {said} ({result.get('wall_s', 0):.0f} s)")

    results = run_blind(jobs, out, workers, scheduler, tell)
    target = page or out / "blind.md"
    dates = sorted(
        {time.strftime("%Y-%m-%d", time.localtime(f.stat().st_mtime)) for f in out.glob("*-*.json")}
    )
    only = f" --rig {rig}" if rig else ""
    line = f"./gearsim bench --blind {len(numbers)} --seed {seed}{only} --out {out} --page {target}"
    write_page(read_results(out), target, " to ".join(dict.fromkeys((dates[0], dates[-1]))), line)
    voice.say(f"written: {target}")
    voice.result({"cases": len(results), "page": str(target), "results": str(out)})
    return 0


def _machine() -> dict[str, Any]:
    model = ""
    try:
        with open("/proc/cpuinfo") as lines:
            model = next(
                (line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), ""
            )
    except OSError:
        pass
    return {
        "processor": model or platform.processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "python": platform.python_version(),
    }
