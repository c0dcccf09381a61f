"""Simulate and diagnose cases, on several processes; results are JSON lines that a later run continues."""

from __future__ import annotations

import json
import math
import os
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from gearsim_bringup.evaluation.cases import Case, draw_case
from gearsim_dsp.diagnose import Diagnosis, diagnose_record
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import Record

__all__ = ["RESULTS", "evaluate", "judge_case", "read_results", "simulate_case"]

RESULTS = "results.jsonl"
Result = dict[str, Any]


def simulate_case(case: Case) -> tuple[Record, Machine]:
    """The record of a case, and the nameplate that a diagnosis is given."""
    from gearsim_sim.scenario import parse_scenario
    from gearsim_sim.simulation import to_record

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"{case.name}.yaml"
        (path.parent / "machine.yaml").write_text(json.dumps(case.machine))  # JSON is YAML
        scenario = parse_scenario(case.scenario, path)
        return to_record(scenario, case.seconds), scenario.machine


def judge_case(case: Case) -> Result:
    """Simulate a case, diagnose it, and say what was true and what was found.

    A machine that the simulator refuses to build is told as `refused` and counts for nothing.
    """
    try:
        record, machine = simulate_case(case)
    except InputError as error:
        return {"name": case.name, "set": case.set_name, "kind": case.kind, "refused": str(error)}
    began = time.process_time()
    diagnosis = diagnose_record(record, machine)
    return _result(case, diagnosis, time.process_time() - began)


def _judge_or_say(case: Case) -> Result:
    """The result; a diagnosis that breaks is told as `crashed` and counts as wrong."""
    try:
        return judge_case(case)
    except Exception as error:
        truths = [asdict(truth) for truth in case.truths]
        said = {"component": "", "fault": "crashed", "confidence": 0.0, "evidence": {"features": {}}}
        return {
            "name": case.name,
            "set": case.set_name,
            "kind": case.kind,
            "truths": truths,
            "facts": case.facts,
            "twin_wheels": False,
            "quality": [],
            "findings": [said],
            "cpu_s": 0.0,
            "crashed": f"{type(error).__name__}: {error}",
        }


def _result(case: Case, diagnosis: Diagnosis, cpu_s: float) -> Result:
    told = diagnosis.to_json()
    mesh = case.machine["nameplate"].get("gear_meshes", {}).get("gears")
    return {
        "name": case.name,
        "set": case.set_name,
        "kind": case.kind,
        "truths": [asdict(truth) for truth in case.truths],
        "facts": case.facts,
        # Wheels that turn at one speed leave the same trace: no diagnosis can tell them apart.
        "twin_wheels": bool(mesh) and mesh["driving_teeth"]["value"] == mesh["driven_teeth"]["value"],
        "speed_hz": told["speed_hz"],
        "quality": told["quality"],
        "findings": told["findings"],
        "doubtful": [one.to_json() for one in diagnosis.doubtful],  # else a fit would see the sure ones only
        "cpu_s": round(cpu_s, 3),
    }


def evaluate(
    set_name: str,
    cases: int,
    seed: int,
    out: Path,
    workers: int = 1,
    tell: Callable[[int, int], None] = lambda _done, _total: None,
) -> list[Result]:
    """Judge the cases 0 to `cases` - 1 of a set that have no result in `out` yet.

    Parameters
    ----------
    set_name : str
        One of `cases.SETS`.
    cases, seed : int
    out : Path
        Folder; results are appended to its `results.jsonl` as they come.
    workers : int
        Processes.
    tell : callable
        Gets the number of cases done and their total.

    Returns
    -------
    list of dict
        Results of this set and seed, old and new, by number.
    """
    out.mkdir(parents=True, exist_ok=True)
    wanted = [draw_case(set_name, seed, number) for number in range(cases)]
    done = {one["name"]: one for one in read_results(out)}
    left = [case for case in wanted if case.name not in done]
    tell(cases - len(left), cases)
    whole = not (out / RESULTS).is_file() or (out / RESULTS).read_bytes()[-1:] in (b"", b"\n")
    with (out / RESULTS).open("a") as file:
        file.write("" if whole else "\n")  # a line that was cut off stays by itself
        for count, result in enumerate(_judged(left, workers), cases - len(left) + 1):
            file.write(json.dumps(_plain(result), allow_nan=False) + "\n")
            file.flush()
            done[result["name"]] = result
            tell(count, cases)
    return [done[case.name] for case in wanted]


def _judged(cases: list[Case], workers: int) -> Iterator[Result]:
    if workers == 1:
        yield from map(_judge_or_say, cases)
        return
    # Fresh processes: compiled loops and thread pools do not survive a fork.
    with ProcessPoolExecutor(min(workers, os.cpu_count() or 1), get_context("spawn")) as pool:
        yield from pool.map(_judge_or_say, cases)


def read_results(out: Path) -> list[Result]:
    """All results in a folder; a last line that was cut off by an interruption is left out."""
    path = out / RESULTS
    if not path.is_file():
        return []
    found = []
    for line in path.read_text().splitlines():
        try:
            found.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return found


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(inner) for inner in value]
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
