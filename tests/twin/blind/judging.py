"""Lets the product judge a case: in a process of its own, that sees the records and nothing else."""

from __future__ import annotations

import contextlib
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from blind.rigs import Rig

_WATCHED = Path(__file__).with_name("watched.py")
TESTS = Path(__file__).resolve().parents[2]
# Of this process's environment the judge's has these: where programs and libraries are, and nothing of ours.
_KEPT = (
    "PATH", "HOME", "LANG", "LC_ALL", "TMPDIR", "XDG_CACHE_HOME", "LD_LIBRARY_PATH", "PYTHONPATH",
    "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "VIRTUAL_ENV", "GEARSIM_ROOT",
)  # fmt: skip


class PeekedError(RuntimeError):
    """The judge has opened a file that it must not see."""


@dataclass(frozen=True, eq=False)
class Judged:
    """What came of it: the object of `--json` (or None and the last words), and the time it took."""

    verdict: dict[str, Any] | None
    said: str
    wall_s: float
    cpu_s: float


def judge(
    records: Sequence[Path],
    rig: Rig,
    hidden: Sequence[Path],
    workers: int = 1,
    limit_s: float = 900.0,
    healthy: Sequence[Path] = (),
) -> Judged:
    """Judge records, the last of them held out.

    Parameters
    ----------
    records : sequence of Path
        Bags.
    rig : Rig
    hidden : sequence of Path
        Folders of which nothing may be opened; the tests' folder is always among them.
    workers : int
        Processes of the judge.
    limit_s : float
        After which it is stopped.
    healthy : sequence of Path
        Records of the machine before it had the effects.

    Raises
    ------
    PeekedError
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        log = folder / "opened"
        log.touch()
        command = [sys.executable, str(_WATCHED), "twin", *map(str, records[:-1])]
        command += ["--holdout", str(records[-1]), "--machine", rig.machine, "--model", rig.model]
        if healthy:
            command += ["--healthy", *map(str, healthy)]
        command += ["--workers", str(workers), "--report", str(folder / "report"), "--json"]
        began, before = time.monotonic(), _children_s()
        out, err, code = _run(command, folder, environment(log), limit_s)
        wall, cpu = time.monotonic() - began, _children_s() - before
        peeked = forbidden(log.read_text(encoding="utf-8").splitlines(), [TESTS, *hidden])
    if peeked:
        raise PeekedError(f"the judge opened {peeked[0]}")
    if code != 0:
        last = (err.strip().splitlines() or ["nothing"])[-1]
        return Judged(None, f"exit code {code}: {last}", wall, cpu)
    return Judged(json.loads(out), "", wall, cpu)


def environment(log: Path) -> dict[str, str]:
    """What the judge knows of its surroundings."""
    kept = {name: os.environ[name] for name in _KEPT if name in os.environ}
    tests = str(TESTS)
    entries = [
        one for one in kept.get("PYTHONPATH", "").split(os.pathsep) if one and not one.startswith(tests)
    ]
    return {
        **kept,
        "PYTHONPATH": os.pathsep.join(entries),
        "GEARSIM_WATCH": str(log),
        "OPENBLAS_NUM_THREADS": "1",
    }


def forbidden(opened: Sequence[str], folders: Sequence[Path]) -> list[str]:
    """The opened paths that lie in one of these folders; the watching program itself is no secret."""
    roots = [str(folder.resolve()) for folder in folders]
    allowed = {str(_WATCHED), str(_WATCHED.parent), str(_WATCHED.parent / "__pycache__")}
    return [
        path
        for path in opened
        if path not in allowed and any(path == root or path.startswith(root + os.sep) for root in roots)
    ]


def _run(command: list[str], folder: Path, env: dict[str, str], limit_s: float) -> tuple[str, str, int]:
    """Output, errors and exit code; the whole group of processes ends with this one."""
    process = subprocess.Popen(
        command, cwd=folder, env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        start_new_session=True,
    )  # fmt: skip
    try:
        out, err = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        _end(process)
        return "", f"not done within {limit_s:.0f} s", 124
    except BaseException:
        _end(process)
        raise
    return out, err, process.returncode


def _end(process: subprocess.Popen[str]) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime
