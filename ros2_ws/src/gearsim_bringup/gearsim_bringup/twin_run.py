"""The judge at the command line: its folder, its progress, and its verdict in lines."""

from __future__ import annotations

import json
import os
import secrets
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console

from gearsim_bringup.ui import plain

if TYPE_CHECKING:
    from gearsim_twin.case import Case
    from gearsim_twin.verdict import Verdict

__all__ = ["FILES", "lines", "new_folder", "run_judge"]

FILES = ("twin.json", "extended.yaml", "report.html")
_MOST_WORKERS = 2
_SHOWN = 12
# By so much a thing must be surer than its name for that to be said.
_OPEN = 0.02


def run_judge(case: Case, folder: Path, workers: int | None, seed: int) -> Verdict:
    """Judge a case; verdict, extended model and page are in the folder, which is made, or nothing is.

    Parameters
    ----------
    case : Case
    folder : Path
        Of that name there is nothing yet.
    workers : int, optional
        Processes; by default as many as cores, two at most.
    seed : int
        Of all random numbers.
    """
    from gearsim_bringup.twin_report.page import make_twin_page
    from gearsim_twin.judge import judge
    from gearsim_twin.settings import Settings

    settings = Settings(seed=seed, workers=workers or min(_MOST_WORKERS, os.cpu_count() or 1))
    with _whole(folder):
        with _progress() as tell:
            verdict = judge(case, settings, folder / FILES[1], tell, show=True)
        text = json.dumps(plain(verdict.to_json()), allow_nan=False, indent=1)
        (folder / FILES[0]).write_text(text + "\n", encoding="utf-8")
        (folder / FILES[2]).write_text(make_twin_page(verdict), encoding="utf-8")
    return verdict


@contextmanager
def _whole(folder: Path) -> Iterator[None]:
    """A new folder that stays only if all goes well; nor do folders above it that were made for it."""
    above = [path for path in folder.parents if not path.exists()]
    try:
        folder.mkdir(parents=True)
        yield
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        for path in above:
            with suppress(OSError):  # somebody else has put something there
                path.rmdir()
        raise


def new_folder() -> Path:
    """A name that is free: out/twin_1, out/twin_2 ...; elsewhere where nothing can be written here."""
    here = Path.cwd()
    base = here / "out" if (here / "out").is_dir() else here
    if not os.access(base, os.W_OK | os.X_OK):
        return Path(tempfile.gettempdir()) / f"gearsim_twin_{secrets.token_hex(4)}" / "twin_1"
    return next(path for k in count(1) if not (path := Path("out") / f"twin_{k}").exists())


def lines(verdict: Verdict) -> list[str]:
    """The verdict for people, line by line."""
    content = verdict.to_json()
    told = [f"verdict: {content['verdict'].replace('_', ' ')}", verdict.words(), ""]
    told += [*_score_lines(content["score"]), ""]
    named = [cause for cause in content["causes"] if cause["name"] != "unknown"]
    told += [line for cause in named for line in _cause_lines(cause)]
    told += _rejected_lines(content["rejected"])
    told += _discrepancy_lines(content["discrepancies"])
    if content["extended_model"]:
        told.append(f"extended model: {content['extended_model']}")
        told.append(f"page: {Path(content['extended_model']).with_name(FILES[2])}")
    return told


def _score_lines(score: dict[str, Any]) -> list[str]:
    parts = [
        f"{name.replace('_', ' ')} {score[name]:.2f} dB"
        for name in ("baseline", "tuned_only", "extended", "noise_floor")
        if score.get(name) is not None
    ]
    return ["error on held-out records: " + ", ".join(parts)]


def _cause_lines(cause: dict[str, Any]) -> list[str]:
    place = f" of {cause['component']}" if cause.get("component") else ""
    gain = cause["heldout_gain_db"]
    told = "" if gain is None else f", held-out gain {gain:.2f} dB"
    form = f" by {cause['variant']}" if cause.get("variant") else ""
    found = [f"cause: {cause['name']}{form}{place}, probability {cause['probability']:.2f}{told}"]
    thing = cause.get("thing")
    if thing and thing["probability"] > cause["probability"] + _OPEN:
        found.append(
            f"  sure is {thing['name']} (probability {thing['probability']:.2f}), whichever name it has"
        )
    found.append(f"  {cause['signature']}")
    for name, number in cause["parameters"].items():
        low, high = number["ci95"]
        found.append(f"  {name}: {number['value']:.4g} {number['unit']} (95 %: {low:.4g} to {high:.4g})")
    return found


def _rejected_lines(rejected: list[dict[str, Any]]) -> list[str]:
    return [f"rejected: {one['name']}: {one['why']}" for one in rejected[:_SHOWN]]


def _discrepancy_lines(discrepancies: list[dict[str, Any]]) -> list[str]:
    found = []
    for one in discrepancies[:_SHOWN]:
        cause = f", explained by {one['explained_by']}" if one["explained_by"] else ", not explained"
        found.append(f"differs: {one['where']}: {one['size_db']:+.1f} dB (z {one['z']:+.1f}){cause}")
    more = len(discrepancies) - _SHOWN
    return found + ([f"... and {more} more places, in {FILES[0]}"] if more > 0 else [])


@contextmanager
def _progress() -> Iterator[Callable[[str], None]]:
    """What takes words of progress: one changing line where somebody looks, else lines on stderr."""
    console = Console(stderr=True, markup=False, highlight=False)
    if not console.is_terminal:
        yield lambda words: print(f"twin: {words}", file=sys.stderr, flush=True)
        return
    with console.status("reading") as status:
        yield lambda words: status.update(words)
