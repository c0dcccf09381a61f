from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# Set-up is no installed package: the entry script imports it from its own folder, and so do these tests.
sys.path.insert(0, str(ROOT))


@pytest.fixture
def root() -> Path:
    return ROOT


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A repository that nobody has set up yet: the entry, set-up, the locks and two small packages."""
    place = tmp_path / "repository"
    place.mkdir()
    for name in ("gearsim", "requirements.lock", "requirements-ros.lock"):
        shutil.copy2(ROOT / name, place / name)
    shutil.copytree(
        ROOT / "gearsim_setup", place / "gearsim_setup", ignore=shutil.ignore_patterns("__pycache__")
    )
    messages, program = (place / "ros2_ws" / "src" / name for name in ("some_msgs", "some_program"))
    for package in (messages, program):
        package.mkdir(parents=True)
        (package / "package.xml").write_text("<package/>")
    (messages / "CMakeLists.txt").write_text("project(some_msgs)")
    (messages / "msg").mkdir()
    (messages / "msg" / "One.msg").write_text("float64 a\n")
    (program / "setup.py").write_text("from setuptools import setup\n")
    (program / "launch").mkdir()
    (program / "some_program").mkdir()
    (program / "some_program" / "code.py").write_text("A = 1\n")
    return place


@pytest.fixture
def standing(copy: Path) -> Path:
    """The same repository, looking as if it had been set up; its Python tells how it was called."""
    from gearsim_setup.places import Places
    from gearsim_setup.route import WHEELS
    from gearsim_setup.stamp import PARTS, Stamp, expected_parts

    places = Places(copy)
    (places.venv / "bin").mkdir(parents=True)
    (places.venv / "lib" / "python3.12" / "site-packages" / "ros_some.libs").mkdir(parents=True)
    (places.venv / "pyvenv.cfg").write_text("home = /usr/bin\nversion = 3.12.3\n")
    places.python.write_text(
        '#!/bin/sh\nprintf "%s\\n" "$@" > "$SAID.arguments"\nenv > "$SAID.environment"\n'
        'grep SigIgn /proc/self/status > "$SAID.ignored"\n'
    )
    places.python.chmod(0o755)
    (places.install / "lib" / "python3.12" / "site-packages").mkdir(parents=True)
    (places.install / "setup.sh").write_text("")
    stamp = Stamp(places.stamp)
    for part in PARTS:
        stamp.complete(part, expected_parts(places, WHEELS)[part])
    return copy


@pytest.fixture
def plain_environment() -> dict[str, str]:
    """The environment of somebody who has sourced and set nothing."""
    stray = (
        "GEARSIM_",
        "ROS_",
        "AMENT_",
        "CMAKE_",
        "COLCON_",
        "PYTHON",
        "_ROS",
        "LD_LIBRARY",
        "RMW_",
        "VIRTUAL_",
    )
    env = {key: value for key, value in os.environ.items() if not key.startswith(stray)}
    return {**env, "PYTHONDONTWRITEBYTECODE": "1", "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
