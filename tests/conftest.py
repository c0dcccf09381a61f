"""Fixtures of all rooms: measured records, and ROS domains with the processes in them."""

from __future__ import annotations

import os
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[1] / "ros2_ws" / "src"
_ROOMS = ("gearsim_io", "gearsim_sim", "gearsim_dsp", "gearsim_twin", "gearsim_bringup")
_FOLDERS = [str(SOURCES / name) for name in _ROOMS]
# The sources are tested, not an older build of them; also in child processes.
sys.path[:0] = _FOLDERS
os.environ["PYTHONPATH"] = os.pathsep.join([*_FOLDERS, os.environ.get("PYTHONPATH", "")]).rstrip(os.pathsep)

from rosproc import RosDomain, reserved_domain  # noqa: E402


@pytest.fixture(scope="session")
def record_dir() -> Path:
    """Folder of the measured records (`mfpt/`, `hit_sm/` ...); skips where there is none."""
    from gearsim_io.datasets import data_folders

    for folder in data_folders():
        if (folder / "mfpt").is_dir():
            return folder
    looked = ", ".join(str(folder) for folder in data_folders())
    pytest.skip(f"no measured records in {looked}; get some with: ./gearsim data get mfpt")


@pytest.fixture(scope="session")
def record_file(record_dir: Path) -> Callable[[str], Path]:
    """`record_file("mfpt/baseline_1.mat")` gives its path; skips where this one record is missing."""
    from gearsim_io.datasets import find_record

    def find(relative: str) -> Path:
        path = find_record(relative)
        if path is None:
            pytest.skip(f"the record {relative} is not in {record_dir}")
        return path

    return find


@pytest.fixture
def ros_domain(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[RosDomain]:
    """A ROS domain that no other test uses, with helpers to start nodes in it; see `rosproc.RosDomain`."""
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed")
    pytest.importorskip("gearsim_msgs.msg", reason="gearsim_msgs is not built (colcon build of ros2_ws)")
    locks = Path(tempfile.gettempdir()) / f"gearsim-test-domains-{os.getuid()}"
    start = zlib.crc32(request.node.nodeid.encode())  # spreads the tests, so that none waits for another
    with pytest.MonkeyPatch.context() as patch, reserved_domain(locks, start) as number:
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        patch.setenv("ROS_DOMAIN_ID", str(number))
        patch.setenv("ROS_LOG_DIR", str(tmp_path / "ros_log"))
        domain = RosDomain(number, tmp_path / "ros_log")
        try:
            yield domain
        finally:
            domain.close()
