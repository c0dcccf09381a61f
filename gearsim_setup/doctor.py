"""`./gearsim doctor`: what is there, what is missing, and the command that mends it.

Works when nothing is installed: everything is asked from outside, with the standard library alone.
"""

from __future__ import annotations

import json
import os
import platform
import shutil
from collections.abc import Generator, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from gearsim_setup import interpreter, system, wheels
from gearsim_setup.command import ask
from gearsim_setup.environment import program_environment
from gearsim_setup.interpreter import Interpreter
from gearsim_setup.mend import count_unmended
from gearsim_setup.places import Places
from gearsim_setup.problems import LackProblem, SetupProblem, UsageProblem
from gearsim_setup.route import WHEELS, find_route
from gearsim_setup.stamp import Stamp, expected_parts

OK, WARNING, MISSING = "ok", "warning", "missing"
SETUP = "./gearsim setup"
REPAIR = "./gearsim setup --again"
SELF_TEST = "self_test.py"
SELF_TEST_LIMIT_S = 60.0
SHARED_MEMORY = Path("/dev/shm")
SHARED_MEMORY_WANTED_MB = 64
LEFTOVERS_BORNE = 64
DISK_WANTED_GB = 1.0

HELP = """Usage: ./gearsim doctor [--json]

Check the environment: system packages, Python, wheels, the workspace, ROS, the pictures, the records.
Changes nothing. Ends with 0 when everything needed is there, with 3 when something is missing.

  --json   one JSON object on stdout: {"ok": bool, "checks": [{"name", "state", "detail", "mend"}]}

Example: ./gearsim doctor
"""


@dataclass(frozen=True)
class Check:
    """One finding.

    Parameters
    ----------
    name : str
        What was looked at.
    state : str
        "ok", "warning" (something optional is not as it might be) or "missing" (nothing runs without it).
    detail : str
        What was found.
    mend : str
        The command or deed that mends it; empty when there is nothing to mend.
    """

    name: str
    state: str
    detail: str
    mend: str = ""


def run_doctor(places: Places, options: Sequence[str]) -> int:
    """Check everything, tell it on stdout, and return the exit code."""
    if list(options) in (["--help"], ["-h"]):
        print(HELP, end="")
        return 0
    if list(options) not in ([], ["--json"]):
        raise UsageProblem(f"doctor: got {' '.join(options)}, expected nothing or --json")
    checks = list(examine(places))
    well = all(check.state != MISSING for check in checks)
    if options:
        print(json.dumps({"ok": well, "checks": [asdict(check) for check in checks]}))
    else:
        print("\n".join(_lines(checks)))
    return 0 if well else LackProblem.exit_code


def _lines(checks: Sequence[Check]) -> Iterator[str]:
    for check in checks:
        yield f"{check.state:<8}  {check.name:<16}  {check.detail}"
        if check.mend:
            yield f"{'':<28}mend it with: {check.mend}"
    missing = sum(check.state == MISSING for check in checks)
    yield ""
    yield "everything needed is there" if not missing else f"{missing} missing"


def examine(places: Places) -> Iterator[Check]:
    """Run every check, the outer ones first."""
    yield Check("machine", OK, _machine())
    try:
        route = find_route(places)
        python = interpreter.choose(places)
    except SetupProblem as problem:
        remedy = problem.remedy if isinstance(problem, LackProblem) else f"unset {interpreter.CHOICE}"
        lack = problem.lack if isinstance(problem, LackProblem) else str(problem)
        yield Check("python", MISSING, lack, remedy)
        return
    yield Check("python", OK, f"{python.text} ({python.executable})")
    yield Check("ros", OK, route if route != WHEELS else "the wheels of requirements-ros.lock (ROS 2 Kilted)")
    yield _system_packages(python)
    yield _pictures()
    yield _disk(places)
    standing = yield from _environment(places, route, python)
    yield from _shared_memory()
    yield _records(places)
    if standing:
        yield from _self_test(places, route)


def _machine() -> str:
    try:
        name = platform.freedesktop_os_release()["PRETTY_NAME"]
    except (OSError, KeyError):
        name = platform.system()
    memory_gb = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 1e9
    return f"{name}, {platform.machine()}, {len(os.sched_getaffinity(0))} cores, {memory_gb:.0f} GB memory"


def _system_packages(python: Interpreter) -> Check:
    lacks = system.lacking(python)
    if not lacks:
        return Check("system packages", OK, "compiler, make, Python headers, ensurepip")
    packages = [lack.package for lack in lacks if lack.package]
    mend = system.apt_command(packages) if packages else f"{interpreter.CHOICE}=/path/to/another/python3.12"
    return Check("system packages", MISSING, "; ".join(lack.what for lack in lacks), mend)


def _pictures() -> Check:
    if system.has_vulkan():
        return Check("pictures", OK, "a Vulkan driver is registered")
    return Check(
        "pictures", WARNING, "no Vulkan driver, so no PNG", system.apt_command([system.VULKAN_PACKAGE])
    )


def _disk(places: Places) -> Check:
    free_gb = shutil.disk_usage(places.root).free / 1e9
    detail = f"{free_gb:.1f} GB free at {places.root}"
    if free_gb >= DISK_WANTED_GB:
        return Check("disk", OK, detail)
    return Check("disk", WARNING, detail, "free some space: eight channels take 2 MB a second")


def _environment(places: Places, route: str, python: Interpreter) -> Generator[Check, None, bool]:
    """Check what set-up makes; the value of the generator is whether the program can start."""
    stamp, expected = Stamp(places.stamp), expected_parts(places, route)
    if places.venv_minor() != python.minor:
        yield Check("virtual env", MISSING, f"none of Python {python.minor} at {places.venv}", SETUP)
        return False
    locks = [places.requirements, *([places.ros_requirements] if route == WHEELS else [])]
    wanted = {name: version for lock in locks for name, version in wheels.pins(lock).items()}
    site = places.site_packages()
    bad = [*wheels.missing(site, wanted), *wheels.damaged(site, wanted)]
    if bad:
        detail = f"{len(bad)} of {len(wanted)} missing or not whole, such as {bad[0]}"
        yield Check("wheels", MISSING, detail, REPAIR)
        return False
    yield Check("wheels", OK, f"{len(wanted)} pinned, all whole")
    unmended = count_unmended(places.venv / "share")
    if unmended:
        yield Check("ros wheels", MISSING, f"{unmended} CMake files name another machine's folders", REPAIR)
    if not stamp.fits(expected):
        yield Check("workspace", MISSING, "not built, or its sources have changed since", SETUP)
        return False
    yield Check("workspace", OK, f"{len(places.packages())} packages built at {places.install}")
    return True


def _shared_memory() -> Iterator[Check]:
    """Fast DDS moves batches through /dev/shm, and leaves files there when it is killed."""
    if not SHARED_MEMORY.is_dir():
        yield Check("shared memory", WARNING, f"no {SHARED_MEMORY}: messages go over the loopback network")
        return
    free_mb = shutil.disk_usage(SHARED_MEMORY).free / 1e6
    detail = f"{free_mb:.0f} MB free in {SHARED_MEMORY}"
    if free_mb < SHARED_MEMORY_WANTED_MB:
        mend = "docker run --shm-size=512m (in a container), or free it"
        yield Check("shared memory", WARNING, detail, mend)
        return
    left = len(list(SHARED_MEMORY.glob("fastdds_*")))
    if left > LEFTOVERS_BORNE:
        mend = f"rm {SHARED_MEMORY}/fastdds_* /dev/shm/sem.fastdds_* (while no ROS program runs)"
        yield Check("shared memory", WARNING, f"{detail}, {left} files of Fast DDS, perhaps left over", mend)
        return
    yield Check("shared memory", OK, detail)


def _records(places: Places) -> Check:
    """Measured records: looked for where gearsim_io.datasets looks."""
    cache = os.environ.get("GEARSIM_CACHE") or os.path.join(
        os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache"), "gearsim"
    )
    own = os.environ.get("GEARSIM_DATA")
    folders = [Path(own)] if own else []
    folders += [places.root.parent / "shared" / "data", Path(cache)]
    for folder in folders:
        if list(folder.glob("mfpt/*.mat")):
            return Check("records", OK, f"measured records at {folder}")
    return Check(
        "records", WARNING, "no measured records: tests and demo leave them out", "./gearsim data get mfpt"
    )


def _self_test(places: Places, route: str) -> Iterator[Check]:
    """Let the environment's own Python import everything and send one message to itself."""
    env = program_environment(places, route, os.environ)
    script = Path(__file__).with_name(SELF_TEST)
    answer = ask([str(places.python), str(script)], env=env, timeout_s=SELF_TEST_LIMIT_S)
    if answer is None:
        yield Check("imports", MISSING, "the environment's Python does not import the program", REPAIR)
        return
    facts = json.loads(answer.strip().splitlines()[-1])
    yield Check("imports", OK, ", ".join(f"{name} {version}" for name, version in facts["versions"].items()))
    reach = f"domain {env.get('ROS_DOMAIN_ID', '0')}, discovery {env['ROS_AUTOMATIC_DISCOVERY_RANGE']}"
    if facts["round_trip_ms"] is None:
        mend = "a firewall or ROS_* variable in the way? unset ROS_DOMAIN_ID FASTDDS_DEFAULT_PROFILES_FILE"
        yield Check("messages", MISSING, f"a message to ourselves does not arrive ({reach})", mend)
    else:
        yield Check("messages", OK, f"a batch goes round in {facts['round_trip_ms']:.1f} ms ({reach})")
