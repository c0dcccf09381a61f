"""Running blind cases: what a later run continues, interrupts, other machines, a lacking checkout."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
import types
from pathlib import Path
from typing import Any

import pytest

from gearsim_bringup import blind_run
from gearsim_bringup.blind_run import Job, blind_folder, one_case, read_results, run_blind
from gearsim_io.errors import EnvironmentLackError

# Stands in for the generator and the judge: says what it was asked, and counts how often.
PROGRAM = """
import json, os, sys, time
seed, index = int(sys.argv[1]), int(sys.argv[2])
with open(os.environ["BLIND_LOG"], "a") as log:
    log.write(f"{index}\\n")
time.sleep(float(os.environ.get("BLIND_SLEEP", "0")))
if index == 3:
    sys.exit("no such case")
print("compiling ...")
print(json.dumps({"seed": seed, "index": index, "effects": [], "words": sys.argv[3:]}))
"""


@pytest.fixture
def log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkout with that program; the file in which it counts."""
    folder = tmp_path / "checkout" / "tests" / "twin" / "blind"
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "one.py").write_text(PROGRAM, encoding="utf-8")
    monkeypatch.setenv("GEARSIM_ROOT", str(tmp_path / "checkout"))
    monkeypatch.setenv("BLIND_LOG", str(tmp_path / "log"))
    return tmp_path / "log"


def _asked(log: Path) -> list[int]:
    return sorted(int(line) for line in log.read_text(encoding="utf-8").split())


def test_a_run_goes_on_where_another_ended(tmp_path: Path, log: Path) -> None:
    out, told = tmp_path / "out", list[tuple[int, int, int]]()
    run_blind([Job(1, 0), Job(1, 1)], out, 2)
    jobs = [Job(1, index, workers=1, cache="/kept") for index in range(3)]
    results = run_blind(jobs, out, 1, tell=lambda one, done, of: told.append((one["index"], done, of)))
    assert [one["index"] for one in results] == [0, 1, 2]
    assert told == [(2, 3, 3)]
    assert _asked(log) == [0, 1, 2]
    assert results[2]["words"] == ["--workers", "1", "--cache", "/kept"]
    assert read_results(out) == results
    # A case of one rig only is another than that of the same number.
    (other,) = run_blind([Job(1, 0, 1, rig="bearing")], out, 1)
    assert other["words"] == ["--workers", "1", "--rig", "bearing"]
    assert (out / "1-0-bearing.json").is_file()
    assert len(read_results(out)) == 4


def test_a_case_that_breaks_is_a_result_too(tmp_path: Path, log: Path) -> None:  # noqa: ARG001
    (result,) = run_blind([Job(1, 3)], tmp_path / "out", 1)
    assert result["failed"] == "exit code 1: no such case"


def test_an_interrupt_ends_all_processes_and_keeps_what_is_done(tmp_path: Path, log: Path) -> None:
    out = tmp_path / "out"
    code = (
        "from pathlib import Path; from gearsim_bringup.blind_run import *; "
        f"run_blind([Job(1, k) for k in range(4)], Path({str(out)!r}), 2)"
    )
    run_blind([Job(1, 0)], out, 1)
    process = subprocess.Popen(
        [sys.executable, "-c", code], env={**os.environ, "BLIND_SLEEP": "100"}, stderr=subprocess.PIPE
    )
    limit = time.monotonic() + 60
    while len(_asked(log)) < 3 and time.monotonic() < limit:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    began = time.monotonic()
    process.communicate(timeout=60)
    assert process.returncode != 0
    assert time.monotonic() - began < 20  # those that slept would have gone on for 100 s
    assert [path.name for path in out.iterdir()] == ["1-0.json"]
    assert _asked(log) == [0, 1, 2]  # the last was never begun


def test_a_scheduler_of_other_machines_is_asked(
    tmp_path: Path, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []

    class Answer:
        def __init__(self, job: Job) -> None:
            self.result = lambda: one_case(job)

    class Client:
        def __init__(self, address: str, timeout: str) -> None:
            asked.append((address, timeout))

        def submit(self, function: Any, job: Job, *, pure: bool) -> Any:
            assert function is one_case
            assert not pure
            return Answer(job)

        def close(self) -> None:
            asked.append("closed")

    fake = types.ModuleType("distributed")
    fake.Client = Client  # type: ignore[attr-defined]
    fake.as_completed = reversed  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "distributed", fake)
    results = run_blind([Job(2, 0), Job(2, 1)], tmp_path / "out", 1, "tcp://node1:8786")
    assert [one["index"] for one in results] == [0, 1]
    assert asked == [("tcp://node1:8786", "10s"), "closed"]
    assert _asked(log) == [0, 1]


def test_without_dask_the_remedy_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(EnvironmentLackError, match=r"dask.distributed.*pip install"):
        run_blind([Job(1, 0)], tmp_path / "out", 1, "tcp://node1:8786")


def test_without_a_checkout_that_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("GEARSIM_ROOT", raising=False)
    monkeypatch.setattr(blind_run, "__file__", str(tmp_path / "site" / "blind_run.py"))
    with pytest.raises(EnvironmentLackError, match="part of a checkout"):
        blind_folder()


def test_jobs_travel(log: Path) -> None:
    job = pickle.loads(pickle.dumps(Job(5, 1, 2, "/kept")))
    assert one_case(job)["words"] == ["--workers", "2", "--cache", "/kept"]
    assert _asked(log) == [1]
