"""The packages' own descriptions: versions, needs, entry points, data files."""

from __future__ import annotations

import ast
import re
import shutil
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gearsim_setup.wheels import normal, pins

PURE = ("gearsim_io", "gearsim_sim", "gearsim_dsp", "gearsim_twin")
PROGRAMS = (*PURE, "gearsim_bringup")
# Modules whose distribution has another name.
DISTRIBUTIONS = {
    "ruamel": "ruamel-yaml",
    "rerun": "rerun-sdk",
    "rerun_cli": "rerun-sdk",
    "paho": "paho-mqtt",
    "pydantic_core": "pydantic",
}
# What `bench --peers` installs into an environment of its own, where alone it is imported.
PEERS = frozenset(["ross"])
# Comes with ROS, or is ours.
ROS = frozenset(
    [
        "rclpy",
        "std_msgs",
        "diagnostic_msgs",
        "rosgraph_msgs",
        "rcl_interfaces",
        "builtin_interfaces",
        "gearsim_msgs",
        "launch",
        "launch_ros",
        "ament_index_python",
        "rosidl_runtime_py",
        "rpyutils",
    ]
)


def source(root: Path, package: str) -> Path:
    return root / "ros2_ws" / "src" / package


def about(root: Path, package: str) -> ElementTree.Element:
    return ElementTree.parse(source(root, package) / "package.xml").getroot()


def imported(folder: Path) -> set[str]:
    """Top names of everything that a package's modules import, at whatever depth."""
    found = set()
    for path in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                found |= {alias.name.split(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                found.add((node.module or "").split(".")[0])
    return found - set(sys.stdlib_module_names)


def setup_call(root: Path, package: str) -> dict[str, ast.expr]:
    tree = ast.parse((source(root, package) / "setup.py").read_text())
    calls = [
        node
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "setup"
    ]
    return {keyword.arg: keyword.value for keyword in calls[-1].keywords if keyword.arg}


def required(root: Path, package: str) -> set[str]:
    """Distributions that `pip install` of a package brings, with its extras."""
    call = setup_call(root, package)
    lists = [call["install_requires"]]
    if "extras_require" in call:
        extras = call["extras_require"]
        assert isinstance(extras, ast.Dict)
        lists += extras.values
    items = [item for part in lists for item in ast.walk(part)]
    names = set()
    for item in items:
        if isinstance(item, ast.Constant) and isinstance(item.value, str):
            match = re.match(r"[A-Za-z][A-Za-z0-9._-]*", item.value)
            if match:
                names.add(normal(match.group()))
    return names


def test_all_packages_have_one_version(root: Path) -> None:
    import gearsim_bringup

    versions = {package: about(root, package).findtext("version") for package in (*PROGRAMS, "gearsim_msgs")}
    assert set(versions.values()) == {gearsim_bringup.__version__}, versions


@pytest.mark.parametrize("package", PROGRAMS)
def test_what_a_package_imports_it_declares_and_the_lock_has(root: Path, package: str) -> None:
    names = imported(source(root, package) / package)
    others = {name for name in names if name.startswith("gearsim_")} - {package, "gearsim_msgs"}
    third = {DISTRIBUTIONS.get(name, normal(name)) for name in names - ROS - PEERS - others - {package}}
    pip = required(root, package)
    assert third | {normal(name) for name in others} <= pip
    pinned = pins(root / "requirements.lock")
    assert {name for name in pip if not name.startswith("gearsim")} <= pinned.keys()
    ros = {element.text for element in about(root, package).iter("exec_depend")}
    assert names & (ROS | others) <= ros, "package.xml lacks an exec_depend"


@pytest.mark.parametrize("package", PROGRAMS)
def test_imports_go_one_way(root: Path, package: str) -> None:
    allowed = {
        "gearsim_io": set(), "gearsim_sim": {"gearsim_io"}, "gearsim_dsp": {"gearsim_io"},
        "gearsim_twin": {"gearsim_io", "gearsim_sim", "gearsim_dsp"}, "gearsim_bringup": set(PURE),
    }[package]  # fmt: skip
    names = {name for name in imported(source(root, package) / package) if name.startswith("gearsim_")}
    assert names - {package, "gearsim_msgs"} <= allowed


@pytest.mark.parametrize("package", PROGRAMS)
def test_each_entry_point_leads_to_a_function(root: Path, package: str) -> None:
    call = setup_call(root, package)
    points = ast.literal_eval(call["entry_points"])["console_scripts"] if "entry_points" in call else []
    assert bool(points) == (
        package == "gearsim_bringup" or (source(root, package) / package / "nodes").is_dir()
    )
    for point in points:
        module, function = point.split("=")[1].strip().split(":")
        tree = ast.parse((source(root, package) / (module.replace(".", "/") + ".py")).read_text())
        assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, point


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The pure packages as pip would install them, built from a copy of their sources."""
    root = Path(__file__).resolve().parents[2]
    work = tmp_path_factory.mktemp("packages")
    unwanted = shutil.ignore_patterns("__pycache__", "build", "*.egg-info")
    shutil.copytree(root / "ros2_ws" / "src", work / "src", ignore=unwanted)
    for package in PURE:
        command = [
            sys.executable,
            "-W",
            "ignore",
            "setup.py",
            "-q",
            "build_py",
            f"--build-lib={work / 'site'}",
        ]
        done = subprocess.run(
            command, cwd=work / "src" / package, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
    return work / "site"


def test_data_files_are_installed_with_the_code(root: Path, installed: Path) -> None:
    for package in PURE:
        data = [
            path for path in (source(root, package) / package).rglob("*") if path.suffix in {".yaml", ".json"}
        ]
        for path in data:
            assert (installed / path.relative_to(source(root, package))).is_file(), path
    messages = {path.name for path in (source(root, "gearsim_msgs") / "msg").glob("*.msg")}
    assert {path.name for path in (installed / "gearsim_io" / "message_definitions").iterdir()} == messages


# Prints what was imported; any touch of ROS or of the source tree is an error.
BLOCKED = """
import importlib, pkgutil, sys
ros = set(sys.argv[2].split(","))
class Block:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in ros:
            raise ModuleNotFoundError(f"{name} needs ROS")
sys.meta_path.insert(0, Block())
sys.path.insert(0, sys.argv[1])
count = 0
for package in sys.argv[3].split(","):
    module = importlib.import_module(package)
    assert module.__file__.startswith(sys.argv[1]), module.__file__
    for found in pkgutil.walk_packages(module.__path__, package + "."):
        if ".nodes" not in found.name:
            importlib.import_module(found.name)
            count += 1
from gearsim_io.definitions import definition
from gearsim_io.machines import load_machine, machine_names
for name in machine_names():
    load_machine(name)
print(count, len(machine_names()), definition("gearsim_msgs/msg/SampleBatch").type_hash[:7])
"""


def test_the_numerics_import_without_ros(installed: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-I", "-c", BLOCKED, str(installed), ",".join(ROS), ",".join(PURE)]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    modules, machines, kind = done.stdout.split()
    assert int(modules) > 40
    assert int(machines) >= 7
    assert kind == "RIHS01_"
