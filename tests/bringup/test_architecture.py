"""The rooms import in one direction, and the numerics without ROS."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

SOURCES = Path(__file__).resolve().parents[2] / "ros2_ws" / "src"
ALLOWED = {
    "gearsim_io": set(),
    "gearsim_sim": {"gearsim_io"},
    "gearsim_dsp": {"gearsim_io"},
    "gearsim_twin": {"gearsim_io", "gearsim_sim", "gearsim_dsp"},
    "gearsim_bringup": {"gearsim_io", "gearsim_sim", "gearsim_dsp", "gearsim_twin"},
}
ROS = ("rclpy", "gearsim_msgs", "std_msgs", "diagnostic_msgs", "rosgraph_msgs", "rcl_interfaces")
NO_ROS = """
import sys, importlib
class Blocked:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {ros!r}:
            raise ImportError(f"{{name}} is blocked")
sys.meta_path.insert(0, Blocked())
for name in {modules!r}:
    importlib.import_module(name)
"""


def imported(file: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names.add(node.module.split(".")[0])
    return names


def modules(package: str) -> list[str]:
    root = SOURCES / package
    files = [file for file in (root / package).rglob("*.py") if "nodes" not in file.parts]
    dotted = [".".join(file.relative_to(root).with_suffix("").parts) for file in files]
    return sorted(name.removesuffix(".__init__") for name in dotted)


@pytest.mark.parametrize("package", sorted(ALLOWED))
def test_imports_go_one_way(package):
    for file in (SOURCES / package / package).rglob("*.py"):
        rooms = {name for name in imported(file) if name in ALLOWED} - {package}
        assert rooms <= ALLOWED[package], f"{file} imports {sorted(rooms - ALLOWED[package])}"


@pytest.mark.parametrize("package", ["gearsim_io", "gearsim_sim", "gearsim_dsp", "gearsim_twin"])
def test_numerics_import_without_ros(package):
    names = modules(package)
    assert len(names) > 10
    script = NO_ROS.format(ros=set(ROS), modules=names)
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
