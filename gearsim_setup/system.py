"""What must come from the system itself: compiler, headers, ensurepip, a Vulkan driver.

Each is judged by whether it works, not by the name of a package, so that compilers and Pythons from
elsewhere count too.
"""

from __future__ import annotations

import os
import shlex
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gearsim_setup.command import ask, last_lines
from gearsim_setup.interpreter import CHOICE, Interpreter
from gearsim_setup.job import Job
from gearsim_setup.problems import LackProblem

# Set to 0 to forbid set-up to install system packages.
APT_SWITCH = "GEARSIM_APT"
VULKAN_PACKAGE = "mesa-vulkan-drivers"
VULKAN_FOLDERS = ("/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d", "/etc/vulkan/icd.d")

_SAMPLE = """
#include <Python.h>
#include <string>
int main() { return std::string().size() + PY_MAJOR_VERSION > 99; }
"""


@dataclass(frozen=True)
class Lack:
    """Something the system does not have.

    Parameters
    ----------
    what : str
        In words.
    package : str
        Debian package that has it; empty when it is not the distribution's to give.
    """

    what: str
    package: str


def lacking(python: Interpreter) -> list[Lack]:
    """Find what is missing to make a virtual environment of `python` and to compile against it."""
    lacks = []
    if not python.has_ensurepip:
        package = f"python{python.minor}-venv" if python.from_apt else ""
        lacks.append(Lack(f"ensurepip of {python.executable}", package))
    tools = (("CC", "cc", "gcc"), ("CXX", "c++", "g++"), ("MAKE", "make", "gmake"))
    absent = [names[1] for names in tools if not _found(*names)]
    if absent:
        lacks.append(Lack(f"a C and C++ compiler with make (no {', '.join(absent)})", "build-essential"))
    if not (python.include / "Python.h").is_file():
        package = f"python{python.minor}-dev" if python.from_apt else ""
        lacks.append(Lack(f"the C headers of Python {python.minor} ({python.include}/Python.h)", package))
    if not lacks and not compiles(python):
        lacks.append(Lack("a C++ compiler that works (the one found fails on two lines)", "build-essential"))
    return lacks


def _found(variable: str, *names: str) -> bool:
    own = os.environ.get(variable, "").split()
    return any(shutil.which(name) for name in (own[:1] or names))


def compiles(python: Interpreter) -> bool:
    """Whether a program that uses the C++ library and Python's headers compiles."""
    compiler = os.environ.get("CXX") or shutil.which("c++") or shutil.which("g++")
    if compiler is None:
        return False
    script = f'printf %s "$0" | {compiler} -fsyntax-only -x c++ -I"$1" -'
    argv = ["sh", "-c", script, _SAMPLE, str(python.include)]
    return ask(argv) is not None


def has_vulkan() -> bool:
    """Whether a Vulkan driver is registered, which the pictures of `view` and `demo` need."""
    named = os.environ.get("VK_DRIVER_FILES") or os.environ.get("VK_ICD_FILENAMES")
    if named:
        return any(Path(path).is_file() for path in named.split(":"))
    return any(path for folder in VULKAN_FOLDERS for path in Path(folder).glob("*.json"))


def apt_prefix() -> list[str] | None:
    """How we may call apt-get: nothing before it, `sudo -n`, or None when we may not."""
    if os.environ.get(APT_SWITCH) == "0" or shutil.which("apt-get") is None:
        return None
    if os.geteuid() == 0:
        return []
    if shutil.which("sudo") and ask(["sudo", "-n", "true"], timeout_s=10) is not None:
        return ["sudo", "-n"]
    return None


def apt_command(packages: Sequence[str]) -> str:
    """The command for a person to type."""
    sudo = [] if os.geteuid() == 0 else ["sudo"]
    return shlex.join([*sudo, "apt-get", "install", "-y", "--no-install-recommends", *packages])


def install(job: Job, packages: Sequence[str], prefix: Sequence[str]) -> bool:
    """Install Debian packages; True when apt-get says that it did."""
    # `env` because sudo drops our environment; the timeout waits for another apt to finish.
    apt = [*prefix, "env", "DEBIAN_FRONTEND=noninteractive", "apt-get", "-o", "DPkg::Lock::Timeout=120"]
    job.run([*apt, "update"], "apt", os.environ)
    return job.run([*apt, "install", "-y", "--no-install-recommends", *packages], "apt", os.environ) == 0


def provide(job: Job, python: Interpreter) -> bool:
    """Put missing system packages there, or say what to type.

    Returns
    -------
    bool
        True when packages were installed, so that the Python must be asked again what it has.

    Raises
    ------
    LackProblem
        When something needed is missing and cannot be installed from here.
    """
    lacks = lacking(python)
    foreign = [lack.what for lack in lacks if not lack.package]
    if foreign:
        raise LackProblem(
            f"missing: {'; '.join(foreign)}",
            f"a complete Python {python.minor} in its place, or {CHOICE}=/path/to/another/python3.12",
        )
    wanted = [lack.package for lack in lacks]
    pictures = [] if has_vulkan() else [VULKAN_PACKAGE]
    prefix = apt_prefix() if wanted or pictures else None
    if prefix is None:
        if wanted:
            raise LackProblem(f"missing: {'; '.join(lack.what for lack in lacks)}", apt_command(wanted))
        if pictures:
            job.report.line(f"  no Vulkan driver: pictures are left out until: {apt_command(pictures)}")
        return False
    _apt_step(job, wanted, pictures, prefix)
    return True


def _apt_step(job: Job, wanted: Sequence[str], pictures: Sequence[str], prefix: Sequence[str]) -> None:
    with job.report.step("system packages") as step:
        step.now(f"apt-get install {' '.join([*wanted, *pictures])}")
        if wanted and not install(job, wanted, prefix):
            why = last_lines(job.log("apt"))
            raise LackProblem(f"apt-get could not install {' '.join(wanted)} ({why})", apt_command(wanted))
        # Apart from the rest: nothing but the pictures may fail for its lack.
        drawn = not pictures or install(job, pictures, prefix)
        done = [*wanted, *(pictures if drawn else [])]
        step.done(f"installed {' '.join(done)}" if done else f"no {VULKAN_PACKAGE} to be had: no pictures")
