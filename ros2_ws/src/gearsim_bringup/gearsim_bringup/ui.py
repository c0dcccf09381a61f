"""How the command line speaks: lines for people, one JSON object for programs, progress on stderr."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class JobFailedError(RuntimeError):
    """The job could not be done though the input was good; exit code 1."""


class Voice:
    """Where a command's words go: with `json_mode` stdout carries the result object and nothing else."""

    def __init__(self, *, json_mode: bool) -> None:
        self.json_mode = json_mode
        stream = sys.stderr if json_mode else sys.stdout
        self.console = Console(file=stream, highlight=False, soft_wrap=True, markup=False)

    def say(self, line: str = "") -> None:
        """A line for people, shown at once."""
        self.console.print(line)
        self.console.file.flush()

    def result(self, content: Mapping[str, Any]) -> None:
        """The result for programs; silent without --json."""
        if self.json_mode:
            sys.stdout.write(json.dumps(plain(content), allow_nan=False) + "\n")
            sys.stdout.flush()

    def progress(self) -> Progress:
        """A progress bar on stderr, which disappears when done and stays silent where nobody looks."""
        console = Console(stderr=True)
        return Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not console.is_terminal,
        )


def plain(value: Any) -> Any:
    """`value` with numpy scalars, tuples and non-finite numbers as what JSON knows (NaN becomes null)."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
