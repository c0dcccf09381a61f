"""Which Python the environment is built with."""

from __future__ import annotations

import json
import os
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from gearsim_setup.command import ask
from gearsim_setup.places import Places
from gearsim_setup.problems import LackProblem, UsageProblem

OLDEST, NEWEST = (3, 11), (3, 13)
CHOICE = "GEARSIM_PYTHON"

# Asked of a Python that is not ours yet, hence no import beyond its own library.
_PROBE = """
import importlib.util, json, os, platform, sys, sysconfig
print(json.dumps({
    "executable": os.path.realpath(getattr(sys, "_base_executable", None) or sys.executable),
    "version": list(sys.version_info[:3]),
    "include": sysconfig.get_paths()["include"],
    "ensurepip": importlib.util.find_spec("ensurepip") is not None,
    "implementation": sys.implementation.name,
    "threads": "t" in getattr(sys, "abiflags", ""),
    "platform": sys.platform,
    "machine": platform.machine(),
    "libc": platform.libc_ver()[0],
}))
"""


@dataclass(frozen=True)
class Interpreter:
    """What set-up needs to know of a Python.

    Parameters
    ----------
    executable : Path
        The interpreter itself, no link, and never one inside a virtual environment.
    version : tuple of int
        Major, minor, micro.
    include : Path
        Where its C headers belong.
    has_ensurepip : bool
        Whether virtual environments made by it get a pip (Debian packs that apart).
    """

    executable: Path
    version: tuple[int, int, int]
    include: Path
    has_ensurepip: bool

    @property
    def minor(self) -> str:
        """Such as "3.12"."""
        return f"{self.version[0]}.{self.version[1]}"

    @property
    def text(self) -> str:
        """Such as "3.12.1"."""
        return ".".join(str(part) for part in self.version)

    @property
    def from_apt(self) -> bool:
        """Whether the distribution's package manager provides its headers and ensurepip."""
        return self.executable.parent == Path("/usr/bin") and shutil.which("apt-get") is not None


def probe(python: str) -> Interpreter:
    """Ask a Python about itself.

    Raises
    ------
    UsageProblem
        When `python` does not run.
    LackProblem
        When it runs but nothing can be built on it: version, implementation or machine.
    """
    answer = ask([python, "-c", _PROBE], env={**os.environ, "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"})
    if answer is None:
        raise UsageProblem(f"{CHOICE}: got {python}, expected the path of a Python 3.11, 3.12 or 3.13")
    facts = json.loads(answer.strip().splitlines()[-1])
    version = tuple(facts["version"])
    if not OLDEST <= version[:2] <= NEWEST or facts["implementation"] != "cpython" or facts["threads"]:
        raise LackProblem(
            f"needs CPython 3.11, 3.12 or 3.13, found {facts['implementation']} "
            f"{'.'.join(str(part) for part in version)} ({facts['executable']})",
            f"install one of them, or set {CHOICE}=/path/to/python3.12",
        )
    if (facts["platform"], facts["machine"], facts["libc"]) != ("linux", "x86_64", "glibc"):
        raise LackProblem(
            f"the ROS wheels exist for Linux on x86-64 with glibc only, this is {facts['platform']} on "
            f"{facts['machine']} with {facts['libc'] or 'another C library'}",
            "source a ROS 2 distribution of this machine first, or use an x86-64 Debian or Ubuntu",
        )
    return Interpreter(
        executable=Path(facts["executable"]),
        version=(version[0], version[1], version[2]),
        include=Path(facts["include"]),
        has_ensurepip=bool(facts["ensurepip"]),
    )


def standing_fits(places: Places) -> bool:
    """Whether the virtual environment's Python is the one that is asked for.

    Without `GEARSIM_PYTHON` any supported one will do: the `python3` that happens to come
    first on the PATH must not cause a rebuild.
    """
    minor = places.venv_minor()
    if minor not in {f"3.{number}" for number in range(OLDEST[1], NEWEST[1] + 1)}:
        return False
    choice = os.environ.get(CHOICE)
    if not choice:
        return True
    found = shutil.which(choice)
    if found is None:
        raise UsageProblem(f"{CHOICE}: got {choice}, expected the path of a Python 3.11, 3.12 or 3.13")
    standing = os.path.realpath(places.python)
    # The name may be a wrapper (pyenv): then only the Python itself can tell.
    return os.path.realpath(found) == standing or str(probe(found).executable) == standing


def choose(places: Places) -> Interpreter:
    """Find the Python to build with: `GEARSIM_PYTHON`, the one that stands, the one we run on."""
    choice = os.environ.get(CHOICE)
    if choice:
        return probe(choice)
    if standing_fits(places):
        return probe(str(places.python))
    return probe(sys.executable)
