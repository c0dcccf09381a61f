"""The variables that the program and the build run with, and where ROS comes from."""

from __future__ import annotations

import os
import subprocess
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from importlib.util import find_spec
from pathlib import Path

import pytest

from gearsim_setup.environment import build_environment, program_environment, wheel_libraries
from gearsim_setup.places import Places
from gearsim_setup.problems import UsageProblem
from gearsim_setup.route import WHEELS, distribution_place, find_route

# Somebody who has sourced a distribution that is for another Python, and keeps things of their own.
FOREIGN = {
    "HOME": "/home/me",
    "ROS_DISTRO": "humble",
    "AMENT_PREFIX_PATH": "/home/me/ws/install:/opt/ros/humble",
    "CMAKE_PREFIX_PATH": "/opt/ros/humble",
    "COLCON_PREFIX_PATH": "/home/me/ws/install",
    "PATH": "/opt/ros/humble/bin:/usr/bin:/bin",
    "LD_LIBRARY_PATH": "/opt/ros/humble/lib:/home/me/ws/install/lib:/usr/local/cuda/lib64",
    "PYTHONPATH": "/opt/ros/humble/lib/python3.10/site-packages:/home/me/tools",
    "PYTHONHOME": "/usr",
    "RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp",
}


def test_a_distribution_for_another_python_does_not_leak_in(standing: Path) -> None:
    places = Places(standing)
    for env in (program_environment(places, WHEELS, FOREIGN), build_environment(places, WHEELS, FOREIGN)):
        assert not [name for name, value in env.items() if "humble" in value and name != "ROS_DISTRO"]
        assert not [name for name, value in env.items() if "/home/me/ws" in value]
        assert "PYTHONHOME" not in env
        assert env["PATH"].endswith("/usr/bin:/bin")
        assert env["LD_LIBRARY_PATH"].endswith("/usr/local/cuda/lib64")
    assert program_environment(places, WHEELS, FOREIGN)["PYTHONPATH"].endswith("/home/me/tools")
    assert program_environment(places, WHEELS, FOREIGN)["RMW_IMPLEMENTATION"] == "rmw_fastrtps_cpp"
    assert "PYTHONPATH" not in build_environment(places, WHEELS, FOREIGN)
    assert build_environment(places, WHEELS, FOREIGN)["CMAKE_PREFIX_PATH"] == str(places.venv)


def test_a_distribution_that_is_used_stays_underneath(standing: Path) -> None:
    places = Places(standing)
    env = program_environment(
        places, "jazzy at /opt/ros/jazzy", {**FOREIGN, "PYTHONPATH": "/opt/ros/jazzy/lib"}
    )
    assert env["AMENT_PREFIX_PATH"] == f"{places.install}:/home/me/ws/install:/opt/ros/humble"
    assert env["PYTHONPATH"].endswith(":/opt/ros/jazzy/lib")
    assert env["RMW_IMPLEMENTATION"] == "rmw_cyclonedds_cpp"
    assert "_ROS_WHEELS_BOOTSTRAP_COMPLETE" not in env
    assert str(places.venv) not in env["LD_LIBRARY_PATH"]


def test_entering_twice_adds_nothing(standing: Path) -> None:
    once = program_environment(Places(standing), WHEELS, {"PATH": "/usr/bin"})
    assert program_environment(Places(standing), WHEELS, once) == once


@pytest.mark.skipif(
    find_spec("ros_wheels_bootstrapper") is None, reason="the ROS wheels are not installed here"
)
def test_the_library_path_is_the_one_that_the_wheels_would_set_themselves() -> None:
    from gearsim_setup.environment import _join

    places = Places(Path(sys.prefix).parent)
    if places.venv != Path(sys.prefix):
        pytest.skip("the virtual environment of these tests is not the repository's")
    code = "import ros_wheels_bootstrapper as b; print(b.get_ros_paths())"
    env = {"PATH": os.environ["PATH"], "_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1"}
    done = subprocess.run([sys.executable, "-c", code], env=env, capture_output=True, text=True, check=True)
    theirs = {os.path.realpath(path) for path in done.stdout.strip().split(":")}
    ours = {os.path.realpath(path) for path in _join(wheel_libraries(places), None).split(":")}
    assert ours == theirs


@pytest.fixture
def distribution(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A sourced distribution whose rclpy is for the Python of these tests."""
    folder = tmp_path / "opt" / "lib" / "site-packages"
    (folder / "rclpy").mkdir(parents=True)
    (folder / "rclpy" / f"_rclpy_pybind11{EXTENSION_SUFFIXES[0]}").write_text("")
    monkeypatch.setenv("ROS_DISTRO", "jazzy")
    monkeypatch.delenv("GEARSIM_ROS", raising=False)
    monkeypatch.setattr(
        sys, "path", [str(folder), *(path for path in sys.path if "site-packages" not in path)]
    )
    return folder


def test_a_sourced_distribution_is_used(
    copy: Path, distribution: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert find_route(Places(copy)) == f"jazzy at {distribution}"
    monkeypatch.setenv("GEARSIM_ROS", "wheels")
    assert find_route(Places(copy)) == WHEELS
    monkeypatch.setenv("GEARSIM_ROS", "distribution")
    assert find_route(Places(copy)) == f"jazzy at {distribution}"


def test_a_distribution_that_is_not_sourced_or_for_another_python_is_not(
    copy: Path, distribution: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = next((distribution / "rclpy").iterdir())
    other = library.rename(library.with_name("_rclpy_pybind11.cpython-310-x86_64-linux-gnu.so"))
    assert find_route(Places(copy)) == WHEELS
    monkeypatch.setenv("GEARSIM_ROS", "distribution")
    with pytest.raises(UsageProblem, match="GEARSIM_ROS: got distribution"):
        find_route(Places(copy))
    other.rename(library)
    monkeypatch.delenv("ROS_DISTRO")
    assert distribution_place(Places(copy)) is None


def test_our_own_wheels_are_no_distribution(
    copy: Path, distribution: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Somebody works with the virtual environment activated and ROS_DISTRO set."""
    site = copy / ".venv" / "lib" / "site-packages"
    site.parent.mkdir(parents=True)
    distribution.rename(site)
    monkeypatch.setattr(sys, "path", [str(site)])
    assert find_route(Places(copy)) == WHEELS
