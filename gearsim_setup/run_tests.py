"""Run the test suite inside the environment and end with the exit codes of every other command.

Started by the entry script as a file, so nothing of set-up may be imported here.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from pathlib import Path

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


def main(argv: Sequence[str]) -> int:
    """Run pytest in the repository."""
    import pytest

    own = arguments(argv, Path.cwd(), len(os.sched_getaffinity(0)))
    os.chdir(ROOT)
    return EXIT_CODES.get(int(pytest.main(own)), 1)


if __name__ == "__main__":
    # Our own folder is no place to import from: `report` or `system` are names others may use.
    sys.path.pop(0)
    sys.exit(main(sys.argv[1:]))
