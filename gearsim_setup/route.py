"""Where ROS comes from: the wheels of the lock file, or a ROS 2 distribution that is sourced."""

from __future__ import annotations

import os
import sys
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path

from gearsim_setup.places import Places
from gearsim_setup.problems import UsageProblem

WHEELS = "wheels"
CHOICE = "GEARSIM_ROS"


def find_route(places: Places) -> str:
    """Tell where ROS comes from, in a word that goes into the stamp.

    A distribution counts when it is sourced (`ROS_DISTRO`) and its rclpy was built for the Python
    that runs us, as `python3` does where it is installed. `GEARSIM_ROS=wheels` or `=distribution`
    decides it by hand.

    Returns
    -------
    str
        "wheels", or such as "jazzy at /opt/ros/jazzy/lib/python3.12/site-packages".

    Raises
    ------
    UsageProblem
        When the choice by hand is neither of the two, or there is no distribution to choose.
    """
    choice = os.environ.get(CHOICE, "")
    if choice not in ("", WHEELS, "distribution"):
        raise UsageProblem(f"{CHOICE}: got {choice}, expected wheels or distribution")
    if choice == WHEELS:
        return WHEELS
    place = distribution_place(places)
    if place is not None:
        return f"{os.environ['ROS_DISTRO']} at {place}"
    if choice == "distribution":
        raise UsageProblem(
            f"{CHOICE}: got distribution, expected wheels, since no sourced ROS 2 distribution has an rclpy "
            f"for Python {sys.version_info[0]}.{sys.version_info[1]}"
        )
    return WHEELS


def distribution_place(places: Places) -> Path | None:
    """Folder of a sourced distribution's rclpy that this Python can import; None when there is none."""
    if not os.environ.get("ROS_DISTRO"):
        return None
    for entry in sys.path:
        folder = Path(entry or ".").resolve()
        # Our own wheels are no distribution, even if somebody activated the virtual environment.
        if folder.is_relative_to(places.venv):
            continue
        if any((folder / "rclpy" / f"_rclpy_pybind11{suffix}").is_file() for suffix in EXTENSION_SUFFIXES):
            return folder
    return None
