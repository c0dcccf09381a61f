"""From an empty clone to a finished demo, and a second start. Needs the package index; takes minutes."""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import JobFailedError, Voice

# What this program was started with and a fresh clone must not inherit.
_OWN = ("VIRTUAL_ENV", "PYTHONPATH", "AMENT_PREFIX_PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH")


def measure(_voice: Voice) -> Iterator[Figure]:
    """Clone the checkout that this program runs from, set it up and run its demo."""
    root = os.environ.get("GEARSIM_ROOT")
    if root is None:
        raise JobFailedError("the group setup needs ./gearsim of a checkout")
    with tempfile.TemporaryDirectory(prefix="gearsim_setup_") as name:
        clone = Path(name) / "gearsim"
        subprocess.run(["git", "clone", "-q", root, str(clone)], check=True)
        began = time.monotonic()
        _gearsim(clone, "demo", "--no-real")
        yield Figure("setup.demo_s", time.monotonic() - began, "s", Goal("<=", 360))
        began = time.monotonic()
        _gearsim(clone, "--version")
        second = time.monotonic() - began
        began = time.monotonic()
        _run([str(clone / ".venv/bin/python"), "-c", "pass"], clone)
        yield Figure(
            "setup.second_start_s", second, "s", Goal("<=", 2), ("python -c pass", time.monotonic() - began)
        )


def _gearsim(clone: Path, *words: str) -> None:
    _run([str(clone / "gearsim"), *words], clone)


def _run(command: list[str], clone: Path) -> None:
    environment = {
        key: value for key, value in os.environ.items() if key not in _OWN and not key.startswith("GEARSIM_")
    }
    done = subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        lines = (done.stderr or done.stdout).strip().splitlines()
        raise JobFailedError(
            f"{' '.join(command)} ended with {done.returncode}: {lines[-1] if lines else ''}"
        )
