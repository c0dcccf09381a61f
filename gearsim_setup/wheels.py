"""The virtual environment and its pinned wheels."""

from __future__ import annotations

import csv
import os
import re
import shutil
from collections.abc import Sequence
from pathlib import Path

from gearsim_setup.command import ask, last_lines
from gearsim_setup.interpreter import Interpreter
from gearsim_setup.job import Job
from gearsim_setup.problems import LackProblem
from gearsim_setup.report import Step

# Named apart: the one source package (empy has no wheel) is built with this one, so it comes first.
BUILDER = "setuptools"
SOURCE_ONLY = "empy"

_PIN = re.compile(r"^([A-Za-z0-9][A-Za-z0-9._-]*)==(\S+)")
_NETWORK = re.compile(
    r"NewConnectionError|NameResolution|Network is unreachable|ConnectTimeout|ReadTimeout|Read timed out|"
    r"ConnectionReset|ConnectionError|ProxyError|SSLError|No matching distribution found",
)
_STRAY = frozenset(
    ("PYTHONHOME", "PYTHONPATH", "PIP_TARGET", "PIP_PREFIX", "PIP_ROOT", "VIRTUAL_ENV", "LD_LIBRARY_PATH")
)
_FULL = re.compile(r"No space left on device|Disk quota exceeded")


def pins(lock: Path) -> dict[str, str]:
    """Names (normalised) and versions that a lock file pins."""
    found = {}
    for line in lock.read_text(encoding="utf-8").splitlines():
        match = _PIN.match(line)
        if match:
            found[normal(match[1])] = match[2]
    return found


def normal(name: str) -> str:
    """A distribution's name as the package index compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def block(lock: Path, name: str) -> str:
    """The lines of a lock file that belong to one distribution, hashes included."""
    lines: list[str] = []
    for line in lock.read_text(encoding="utf-8").splitlines():
        match = _PIN.match(line)
        if match:
            if lines:
                break
            if normal(match[1]) != name:
                continue
        elif not lines:
            continue
        lines.append(line)
    return "\n".join(lines) + "\n"


def make_venv(job: Job, python: Interpreter) -> None:
    """Make the virtual environment, in place of whatever stands there.

    Raises
    ------
    SetupProblem
        When Python cannot make one.
    """
    command = [str(python.executable), "-m", "venv", "--clear"]
    # A distribution's rclpy leans on system packages such as lark and empy.
    command += [] if job.on_wheels else ["--system-site-packages"]
    if job.run([*command, str(job.places.venv)], "venv", quiet_environment()) != 0:
        raise job.failed("the virtual environment could not be made", "venv")


def adoptable(job: Job, python: Interpreter) -> bool:
    """Whether a virtual environment without a stamp is one that can be repaired instead of made anew."""
    places = job.places
    isolated = places.venv_config().get("include-system-site-packages") != "true"
    if isolated != job.on_wheels or places.venv_minor() != python.minor:
        return False
    if os.path.realpath(places.python) != str(python.executable):
        return False
    try:
        # A virtual environment that was moved has scripts that call another place's Python.
        activate = (places.venv / "bin" / "activate").read_text(encoding="utf-8")
    except OSError:
        return False
    if str(places.venv) not in activate:
        return False
    return ask([str(places.python), "-m", "pip", "--version"], env=quiet_environment()) is not None


def quiet_environment() -> dict[str, str]:
    """Our environment for pip and venv: the person's settings of the index, nothing that leads astray."""
    env = {key: value for key, value in os.environ.items() if key not in _STRAY}
    # The ROS wheels re-start every Python for their library path; pip has no need of that.
    env["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] = "1"
    return {**env, "PIP_USER": "0", "PIP_DISABLE_PIP_VERSION_CHECK": "1"}


def damaged(site: Path, wanted: dict[str, str]) -> list[str]:
    """Pinned distributions that pip believes installed but that are not whole.

    pip writes a distribution's RECORD last: one without it was cut off in the middle. With it, every
    file it lists must be there and not cut short. Longer ones are no damage (some sites add their own
    certificates to certifi's); CMake files are mended, and bytecode is Python's own to write.
    """
    bad = []
    for info in sorted(site.glob("*.dist-info")):
        name, _, version = info.name.removesuffix(".dist-info").partition("-")
        if wanted.get(normal(name)) == version and not _whole(info):
            bad.append(info.name)
    return bad


def _whole(info: Path) -> bool:
    try:
        with (info / "RECORD").open(newline="", encoding="utf-8") as file:
            rows = [row for row in csv.reader(file) if len(row) == 3]
    except OSError:
        return False
    for name, _, size in rows:
        if name.endswith(".pyc"):
            continue
        try:
            found = os.stat(info.parent / name).st_size
        except OSError:
            return False
        if size and found < int(size) and not name.endswith(".cmake"):
            return False
    return bool(rows)


def clear_leftovers(site: Path, wanted: dict[str, str]) -> int:
    """Remove what an interrupted pip left, so that the next one installs those distributions again."""
    broken = {site / name for name in damaged(site, wanted)}
    broken |= {path for path in site.glob("~*") if path.is_dir()}
    broken |= {path for path in site.glob("*.dist-info") if not (path / "RECORD").is_file()}
    for path in broken:
        shutil.rmtree(path, ignore_errors=True)
    return len(broken)


def missing(site: Path, wanted: dict[str, str]) -> list[str]:
    """Pinned distributions that are not installed in their pinned version."""
    have = set()
    for info in site.glob("*.dist-info"):
        name, _, version = info.name.removesuffix(".dist-info").partition("-")
        have.add((normal(name), version))
    return sorted(name for name, version in wanted.items() if (name, version) not in have)


def install(job: Job) -> None:
    """Bring the virtual environment to what the lock files say; distributions beyond them stay.

    Raises
    ------
    LackProblem
        When the package index cannot be reached, or the disk is full.
    SetupProblem
        When pip fails otherwise, or an installed distribution is not whole afterwards.
    """
    places = job.places
    locks = [places.requirements, *([places.ros_requirements] if job.on_wheels else [])]
    wanted = {name: version for lock in locks for name, version in pins(lock).items()}
    site = places.site_packages()
    with job.report.step("wheels") as step:
        mended = clear_leftovers(site, wanted)
        todo = missing(site, wanted)
        if todo:
            _install_builder(job)
            _pip(job, [f"--requirement={lock}" for lock in locks], _Progress(step, len(todo)))
        bad = [*missing(site, wanted), *damaged(site, wanted)]
        if bad:
            raise job.failed(f"after pip these wheels are not whole: {', '.join(bad[:5])}", "wheels")
        fresh = f"{len(wanted)} in place, {len(todo)} of them new"
        step.done(f"{fresh}, {mended} half-installed removed first" if mended else fresh)


def _install_builder(job: Job) -> None:
    own = job.places.state / "builder.lock"
    own.write_text(block(job.places.requirements, BUILDER), encoding="utf-8")
    _pip(job, [f"--requirement={own}"], None)
    own.unlink()


def _pip(job: Job, what: Sequence[str], on_line: _Progress | None) -> None:
    command = [str(job.places.python), "-m", "pip", "install", "--no-input", "--progress-bar=off"]
    command += ["--require-hashes", "--no-deps", "--no-compile", "--no-build-isolation"]
    # pip before 23.1 runs setup.py itself for what must not be binary, and leaves no RECORD of it.
    command += ["--only-binary=:all:", f"--no-binary={SOURCE_ONLY}", "--use-pep517", *what]
    # What the system has does not count as installed: the pinned version must be ours.
    command += [] if job.on_wheels else ["--ignore-installed"]
    if job.run(command, "wheels", quiet_environment(), on_line=on_line) == 0:
        return
    said = job.log("wheels").read_text(encoding="utf-8", errors="replace").rsplit("\n$ ", 1)[-1]
    if _FULL.search(said):
        raise LackProblem(f"the disk of {job.places.root} is full", "free 3 GB, then start again")
    if _NETWORK.search(said):
        raise LackProblem(
            f"the wheels cannot be fetched ({last_lines(job.log('wheels'), 1)})",
            "a working network, or PIP_INDEX_URL=<an index that answers>, then start again",
        )
    raise job.failed("pip could not install the wheels", "wheels")


class _Progress:
    """Shows pip's own lines in short: how many of how many, which, how large."""

    def __init__(self, step: Step, total: int) -> None:
        self._step = step
        self._total = total
        self._seen = 0

    def __call__(self, line: str) -> None:
        match = re.match(r"\s*(Collecting|Downloading|Using cached|Installing collected)\s+(\S+)(.*)", line)
        if match is None:
            return
        verb, name, rest = match.groups()
        if verb == "Installing collected":
            self._step.now(f"unpacking {self._total} wheels")
        elif verb == "Collecting":
            self._seen = min(self._seen + 1, self._total)
        else:
            size = re.search(r"\(([\d.]+ ?\w+)\)", rest)
            short = name.rsplit("/", 1)[-1].split("-cp3")[0].split("-py3")[0]
            self._step.now(f"{self._seen} of {self._total}  {short}  {size.group(1) if size else ''}")
