"""From the entry script to the running program: see that the environment stands, then hand over."""

from __future__ import annotations

import fcntl
import os
import shutil
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

from gearsim_setup.environment import program_environment
from gearsim_setup.interpreter import standing_fits
from gearsim_setup.places import Places
from gearsim_setup.problems import LackProblem, SetupProblem, UsageProblem
from gearsim_setup.route import find_route
from gearsim_setup.stamp import Stamp, expected_parts

INTERRUPTED = 130
LOCK_PATIENCE_S = 1800.0
LOCK_POLL_S = 0.2

HELP = """Usage: ./gearsim COMMAND [ARGUMENTS]

gearsim is not set up in this folder yet: the first command does that (a few minutes, a network).

  ./gearsim demo            set up, then the main job from end to end
  ./gearsim test            set up, then the whole test suite
  ./gearsim setup           set up, nothing else (--again: check and repair everything)
  ./gearsim doctor          what is there, what is missing, and what mends it

Once set up, ./gearsim --help lists every command. More in README.md and docs/setup.md.
"""
SETUP_HELP = """Usage: ./gearsim setup [--again]

Make the environment: system packages where you may install them, virtual environment, pinned
wheels, the workspace's build. Every other command does the same first, so this is for images
and for machines that will lose their network.

  --again   check every installed file and build the workspace anew, whatever is noted as complete

Example: ./gearsim setup && ./gearsim demo
"""


def main(root: str, argv: Sequence[str]) -> int:
    """Run one command of `./gearsim`; returns only when the program was not started."""
    places = Places(Path(root))
    for number in (signal.SIGTERM, signal.SIGHUP):
        # What nohup has switched off stays off.
        if signal.getsignal(number) == signal.SIG_DFL:
            signal.signal(number, _interrupt)
    try:
        return _dispatch(places, list(argv))
    except KeyboardInterrupt:
        print("gearsim: interrupted; the next start goes on from here", file=sys.stderr)
        return INTERRUPTED
    except SetupProblem as problem:
        print(f"gearsim: {problem}", file=sys.stderr)
        return problem.exit_code
    except OSError as error:
        # A full disk, a folder that may not be written: all that can go wrong in set-up's own file work.
        print(f"gearsim: {error.filename or places.root}: {error.strerror or error}", file=sys.stderr)
        return LackProblem.exit_code


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    raise KeyboardInterrupt


def _dispatch(places: Places, argv: list[str]) -> int:  # noqa: RET503 - the last line never returns
    command = argv[0] if argv else "--help"
    if command == "doctor":
        from gearsim_setup.doctor import run_doctor

        return run_doctor(places, argv[1:])
    if command == "setup":
        return _setup(places, argv[1:])
    route = find_route(places)
    if not is_ready(places, route):
        if command in ("--help", "-h"):
            print(HELP, end="")
            return 0 if argv else UsageProblem.exit_code
        ensure(places, route)
    _hand_over(places, route, argv)


def _setup(places: Places, options: list[str]) -> int:
    if options and options[0] in ("--help", "-h"):
        print(SETUP_HELP, end="")
        return 0
    if options not in ([], ["--again"]):
        raise UsageProblem(
            f"setup: got {' '.join(options)}, expected nothing or --again (see ./gearsim setup --help)"
        )
    route = find_route(places)
    if options:
        with _locked(places):
            Stamp(places.stamp).strike("wheels")
    ensure(places, route)
    print(f"gearsim is set up ({route})", file=sys.stderr)
    return 0


def is_ready(places: Places, route: str) -> bool:
    """Whether the environment stands as the sources want it: the quick check of each start."""
    return (
        os.access(places.python, os.X_OK)
        and (places.install / "setup.sh").is_file()
        and Stamp(places.stamp).fits(expected_parts(places, route))
        and standing_fits(places)
    )


def ensure(places: Places, route: str) -> None:
    """Make the environment stand; quick when it does.

    Raises
    ------
    SetupProblem
        When it cannot be made to stand, with the reason in one line.
    """
    if is_ready(places, route):
        return
    _see_that_it_can_stand_here(places)
    with _locked(places) as descriptor:
        # Another start may have done it while this one waited.
        if not is_ready(places, route):
            from gearsim_setup.job import Job
            from gearsim_setup.steps import assemble

            assemble(Job(places, route, keep_open=(descriptor,)))


def _see_that_it_can_stand_here(places: Places) -> None:
    if ":" in str(places.root) or " " in str(places.root):
        raise LackProblem(
            f"the folder {places.root} has a colon or a space in its path, which ROS and CMake cannot bear",
            "move the repository to a path without them",
        )
    if not os.access(places.root, os.W_OK):
        raise LackProblem(
            f"{places.root} may not be written",
            f"a copy of the repository of your own, or chown {places.root}",
        )
    free_gb = shutil.disk_usage(places.root).free / 1e9
    if not places.venv.is_dir() and free_gb < 3.0:
        raise LackProblem(
            f"{places.root} has {free_gb:.1f} GB left of the 3 GB needed", "a disk with more room"
        )


@contextmanager
def _locked(places: Places) -> Iterator[int]:
    """Hold the set-up lock; a second start waits here. Yields the lock's file descriptor."""
    places.state.mkdir(parents=True, exist_ok=True)
    descriptor = os.open(places.lock, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        _take(descriptor, places)
        yield descriptor
    finally:
        os.close(descriptor)


def _take(descriptor: int, places: Places) -> None:
    begun = time.monotonic()
    told = False
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            return
        except BlockingIOError:
            if not told:
                print("gearsim: another start is setting up here; waiting for it", file=sys.stderr)
                told = True
        if time.monotonic() - begun > LOCK_PATIENCE_S:
            raise SetupProblem(f"another set-up has held {places.short(places.lock)} for half an hour")
        time.sleep(LOCK_POLL_S)


def _hand_over(places: Places, route: str, argv: list[str]) -> NoReturn:
    """Become the program."""
    env = program_environment(places, route, os.environ)
    python = str(places.python)
    if argv and argv[0] == "test":
        command = [python, str(places.root / "gearsim_setup" / "run_tests.py"), *argv[1:]]
    else:
        command = [python, "-m", "gearsim_bringup.cli", *argv]
    sys.stdout.flush()
    sys.stderr.flush()
    os.execve(python, command, env)
