"""`gearsim bench --blind`: runs the blind tests of a checkout, here or elsewhere, and writes their page.

The generator of the tests lives below `tests/`, which no installed package carries; it is run as a program of
its own, one process for each case, and hands back one JSON object.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from gearsim_io.errors import EnvironmentLackError

__all__ = ["Job", "blind_folder", "one_case", "read_results", "run_blind", "write_page"]

Result = dict[str, Any]
_PROGRAM = "blind/one.py"
_SCHEDULER_HINT = "pip install 'distributed>=2024.1'"


class Job:
    """A case to be run, plain enough to travel to another machine.

    Parameters
    ----------
    seed, index : int
    workers : int
        Processes of the judge.
    cache : str
        Folder that keeps records and truths; "" for none.
    rig : str
        That all cases of the run are of; "" for all rigs.
    """

    def __init__(self, seed: int, index: int, workers: int = 2, cache: str = "", rig: str = "") -> None:
        self.seed, self.index, self.workers, self.cache, self.rig = seed, index, workers, cache, rig

    def words(self) -> list[str]:
        """Arguments of the tests' program."""
        words = [str(self.seed), str(self.index), "--workers", str(self.workers)]
        words += ["--rig", self.rig] if self.rig else []
        return [*words, "--cache", self.cache] if self.cache else words

    def file(self, out: Path) -> Path:
        """Where its result is kept."""
        return out / ("-".join([str(self.seed), str(self.index), *filter(None, [self.rig])]) + ".json")


def blind_folder() -> Path:
    """`tests/twin` of the checkout that this program runs from.

    Raises
    ------
    EnvironmentLackError
        If there is none, as where the packages were installed without a checkout.
    """
    roots = [Path(os.environ["GEARSIM_ROOT"])] if "GEARSIM_ROOT" in os.environ else []
    roots += list(Path(__file__).resolve().parents)
    for root in roots:
        if (root / "tests" / "twin" / _PROGRAM).is_file():
            return root / "tests" / "twin"
    lack = "the blind tests are part of a checkout (tests/twin/blind), and this program runs from none"
    raise EnvironmentLackError(lack, "run ./gearsim bench --blind in a clone of the repository")


_running: set[subprocess.Popen[str]] = set()
_lock = threading.Lock()
_stopped = threading.Event()


def one_case(job: Job) -> Result:
    """Make, judge and score a case in a process of its own; what goes wrong is told as `failed`."""
    if _stopped.is_set():
        return {"seed": job.seed, "index": job.index, "failed": "interrupted"}
    folder = blind_folder()
    path = os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH", "")])])
    process = subprocess.Popen(
        [sys.executable, "-m", "blind.one", *job.words()],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    with _lock:
        _running.add(process)
    try:
        out, err = process.communicate()
    finally:
        with _lock:
            _running.discard(process)
    if process.returncode != 0:
        last = (err.strip().splitlines() or ["nothing"])[-1]
        return {"seed": job.seed, "index": job.index, "failed": f"exit code {process.returncode}: {last}"}
    result: Result = json.loads(out.strip().splitlines()[-1])
    return result


def run_blind(
    jobs: Sequence[Job],
    out: Path,
    workers: int,
    scheduler: str = "",
    tell: Callable[[Result, int, int], None] = lambda _result, _done, _total: None,
) -> list[Result]:
    """Run the cases that have no result in `out` yet; a later run goes on where this one ends.

    Parameters
    ----------
    jobs : sequence of Job
    out : Path
        Folder; each case leaves `<seed>-<index>.json`, of one rig only `<seed>-<index>-<rig>.json`.
    workers : int
        Cases at a time, here.
    scheduler : str
        Address of a dask scheduler, whose workers have a checkout each, in place of `workers`.
    tell : callable
        Gets each new result, the number of cases done and their total.

    Returns
    -------
    list of dict
        Results of all jobs, by number.
    """
    out.mkdir(parents=True, exist_ok=True)
    left = [job for job in jobs if not job.file(out).is_file()]
    done = len(jobs) - len(left)
    with _pool(workers, scheduler) as submit:
        waiting = {submit(job): job for job in left}
        for future, job in _as_they_come(waiting):
            result = future.result()
            if result.get("failed") == "interrupted":
                continue
            _write(job.file(out), json.dumps(result) + "\n")
            done += 1
            tell(result, done, len(jobs))
    return [json.loads(job.file(out).read_text(encoding="utf-8")) for job in jobs]


@contextmanager
def _pool(workers: int, scheduler: str) -> Iterator[Callable[[Job], Any]]:
    """Something that takes jobs; leaving it early ends all that was begun."""
    if scheduler:
        client = _client(scheduler)
        try:
            yield lambda job: client.submit(one_case, job, pure=False)
        finally:
            client.close()  # the scheduler cancels what only this client wanted
        return
    _stopped.clear()
    pool = ThreadPoolExecutor(workers)
    try:
        yield lambda job: pool.submit(one_case, job)
    except BaseException:
        _stopped.set()
        with _lock:
            for process in _running:
                _interrupt(process)
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _interrupt(process: subprocess.Popen[str]) -> None:
    """Let a case end its judge and go."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGINT)


def _client(scheduler: str) -> Any:
    import importlib

    try:
        distributed = importlib.import_module("distributed")  # an extra, see requirements.in
    except ImportError:
        lack = "other machines are reached through dask.distributed, which is not installed"
        raise EnvironmentLackError(lack, _SCHEDULER_HINT) from None
    try:
        return distributed.Client(scheduler, timeout="10s")
    except (OSError, ValueError) as error:
        lack = f"there is no dask scheduler at {scheduler} ({error or type(error).__name__})"
        raise EnvironmentLackError(lack, "dask scheduler, and dask worker on each machine") from None


def _as_they_come(waiting: dict[Any, Job]) -> Iterator[tuple[Any, Job]]:
    left: set[Any] = set(waiting)
    if left and not isinstance(next(iter(left)), Future):
        import importlib

        for future in importlib.import_module("distributed").as_completed(list(left)):
            yield future, waiting[future]
        return
    while left:
        finished, left = wait(left, return_when=FIRST_COMPLETED)
        for future in finished:
            yield future, waiting[future]


def _write(path: Path, text: str) -> None:
    """All or nothing, so that a run that is stopped leaves no half result."""
    draft = path.with_suffix(".part")
    draft.write_text(text, encoding="utf-8")
    draft.replace(path)


def read_results(out: Path) -> list[Result]:
    """All results in a folder, by seed and number."""
    found = [json.loads(path.read_text(encoding="utf-8")) for path in out.glob("*-*.json")]
    return sorted(found, key=lambda one: (one["seed"], one.get("only", ""), one["index"]))


def write_page(results: Sequence[Result], page: Path, when: str, command: str) -> None:
    """The page of these results, by the tests' own code."""
    import importlib

    folder = str(blind_folder())
    if folder not in sys.path:
        sys.path.insert(0, folder)
    make = importlib.import_module("blind.page").page
    page.parent.mkdir(parents=True, exist_ok=True)
    _write(page, make(results, when, command))
