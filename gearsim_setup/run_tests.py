"""Run the test suite inside the environment and end with the exit codes of every other command.

Started by the entry script as a file, so nothing of set-up may be imported here.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
MOST_WORKERS = 4

# pytest: 0 passed, 1 failures, 2 interrupted, 3 internal error, 4 wrong usage, 5 nothing collected, 6 too
# many warnings.
EXIT_CODES = {0: 0, 1: 1, 2: 130, 3: 1, 4: 2, 5: 2, 6: 1}


def arguments(argv: Sequence[str], cwd: Path, cores: int) -> list[str]:
    """What pytest is called with: our options first, so that a person's own ones win.

    Parameters
    ----------
    argv : sequence of str
        What was typed after `test`.
    cwd : Path
        Where it was typed; paths that exist from there are meant from there.
    cores : int
        Processor cores that we may use.
    """
    ours = ["-n", str(max(1, min(cores, MOST_WORKERS))), "--dist", "loadgroup"]
    return [*ours, *(_absolute(argument, cwd) for argument in argv)]


def _absolute(argument: str, cwd: Path) -> str:
    path, separator, rest = argument.partition("::")
    if path.startswith("-") or not path or not (cwd / path).exists():
        return argument
    return f"{(cwd / path).resolve()}{separator}{rest}"


class Interruption:
    """A pytest plugin that notes whether somebody pressed Ctrl-C.

    pytest-xdist ends a run that stops at a failure (`-x`) with the code of an interrupted one.
    """

    def __init__(self) -> None:
        self.pressed = False

    def pytest_keyboard_interrupt(self, excinfo: Any) -> None:
        """Called by pytest with whatever ended the run early."""
        self.pressed = excinfo.type is KeyboardInterrupt


def exit_code(code: int, pressed: bool) -> int:
    """Our exit code for pytest's."""
    known = EXIT_CODES.get(code, 1)
    return known if known != EXIT_CODES[2] or pressed else 1


def main(argv: Sequence[str]) -> int:
    """Run pytest in the repository."""
    import pytest

    own = arguments(argv, Path.cwd(), len(os.sched_getaffinity(0)))
    os.chdir(ROOT)
    interruption = Interruption()
    code = pytest.main(own, plugins=[interruption])
    return exit_code(int(code), interruption.pressed)


if __name__ == "__main__":
    # Our own folder is no place to import from: `report` or `system` are names others may use.
    sys.path.pop(0)
    sys.exit(main(sys.argv[1:]))
