"""Build the colcon workspace: compile the messages, link the Python packages."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

from gearsim_setup.command import ask
from gearsim_setup.environment import build_environment, program_environment
from gearsim_setup.interpreter import Interpreter
from gearsim_setup.job import Job
from gearsim_setup.mend import mend_tree
from gearsim_setup.places import Places
from gearsim_setup.problems import LackProblem, SetupProblem
from gearsim_setup.report import Step
from gearsim_setup.stamp import split_packages
from gearsim_setup.system import apt_command, apt_prefix
from gearsim_setup.system import install as apt_install

BUILD_FOLDERS = ("build", "install", "log")
NUMPY_INCLUDE = Path("numpy") / "_core" / "include"


def mend_wheels(job: Job, python: Interpreter) -> None:
    """Point the ROS wheels' CMake files to this machine's headers."""
    with job.report.step("ROS wheels") as step:
        numpy_include = job.places.site_packages() / NUMPY_INCLUDE
        if not (numpy_include / "numpy" / "arrayobject.h").is_file():
            raise SetupProblem(f"numpy has no headers at {numpy_include}")
        changed = mend_tree(job.places.venv / "share", python.include, numpy_include)
        step.done(f"{changed} CMake files mended" if changed else "mended already")


def clear(places: Places) -> None:
    """Remove what earlier builds left, so that nothing of a cut-off or foreign one is built upon."""
    for name in BUILD_FOLDERS:
        shutil.rmtree(places.workspace / name, ignore_errors=True)


def build(job: Job, python: Interpreter) -> None:
    """Run colcon over the workspace and see that the messages can be imported.

    Raises
    ------
    SetupProblem
        When colcon fails, or what it built does not import.
    LackProblem
        When there is no CMake that runs.
    """
    env = build_environment(job.places, job.route, os.environ)
    with job.report.step("workspace") as step:
        if job.on_wheels:
            _see_to_cmake(job, env, step)
        command = colcon_command(job, python)
        if job.run(command, "workspace", env, cwd=job.places.workspace, on_line=_Progress(step)) != 0:
            raise job.failed("colcon build failed", "workspace")
        _see_it_import(job)
        step.done(f"{len(job.places.packages())} packages built")


def colcon_command(job: Job, python: Interpreter) -> list[str]:
    """The colcon call.

    It is always the virtual environment's colcon, so that the programs it installs start with the
    virtual environment's Python, which has the libraries; the messages are compiled for the Python
    that ROS is for.
    """
    places = job.places
    interpreter = places.python if job.on_wheels else python.executable
    return [
        str(places.python),
        "-m",
        "colcon",
        f"--log-base={places.workspace / 'log'}",
        "build",
        f"--base-paths={places.source}",
        f"--build-base={places.workspace / 'build'}",
        f"--install-base={places.install}",
        "--merge-install",
        "--symlink-install",
        "--event-handlers=console_direct+",
        "--cmake-args",
        f"-DPython3_EXECUTABLE={interpreter}",
        "-DBUILD_TESTING=OFF",
        "-DCMAKE_WARN_DEPRECATED=OFF",
    ]


def _see_to_cmake(job: Job, env: dict[str, str], step: Step) -> None:
    """Leave a `cmake` on the build's PATH that runs: the wheel's, else the system's."""
    wheel = job.places.venv / "bin" / "cmake"
    if ask([str(wheel), "--version"], env=env) is not None:
        return
    # A wheel that does not run here must not stand before one that does.
    wheel.unlink(missing_ok=True)
    if shutil.which("cmake", path=env["PATH"]):
        return
    prefix = apt_prefix()
    if prefix is not None:
        step.now("apt-get install cmake")
        if apt_install(job, ["cmake"], prefix):
            return
    raise LackProblem("missing: a cmake that runs (the one from the wheel does not)", apt_command(["cmake"]))


def _see_it_import(job: Job) -> None:
    interfaces, _ = split_packages(job.places)
    modules = ", ".join(["rclpy", *(f"{path.name}.msg" for path in interfaces)])
    env = program_environment(job.places, job.route, os.environ)
    if job.run([str(job.places.python), "-c", f"import {modules}"], "import", env) != 0:
        raise job.failed("the built workspace does not import", "import")


class _Progress:
    """Shows colcon's lines in short: which package, how much of it is compiled."""

    def __init__(self, step: Step) -> None:
        self._step = step
        self._package = ""

    def __call__(self, line: str) -> None:
        starting = re.match(r"Starting >>> (\S+)", line)
        if starting:
            self._package = starting[1]
            self._step.now(self._package)
        percent = re.match(r"\[ *(\d+)%\]", line)
        if percent:
            self._step.now(f"{self._package}  {percent[1]} % compiled")
