"""Message definitions without ROS: schemas that others can read, hashes that ROS itself computes."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gearsim_io import definitions
from gearsim_io.errors import InputError

SOURCES = Path(definitions.__file__).resolve().parents[1]


def test_hashes_are_those_of_rosidl():
    """The generators of ROS write their hash beside each message that they build."""
    found = 0
    for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        for path in Path(prefix).glob("share/gearsim_msgs/msg/*.json"):
            name = f"gearsim_msgs/msg/{path.stem}"
            listed = {
                entry["type_name"]: entry["hash_string"]
                for entry in json.loads(path.read_text())["type_hashes"]
            }
            assert definitions.definition(name).type_hash == listed[name], name
            found += 1
    if not found:
        pytest.skip("gearsim_msgs is not built (colcon build of ros2_ws)")
    assert found >= len(definitions.gearsim_texts())


def test_schemas_are_complete_and_readable_by_others():
    from mcap_ros2._dynamic import generate_dynamic

    for name in (
        *definitions.gearsim_texts(),
        "diagnostic_msgs/msg/DiagnosticArray",
        "rosgraph_msgs/msg/Clock",
    ):
        schema = definitions.definition(name).schema
        parts = schema.split("=" * 80 + "\n")
        headed = [part.splitlines()[0] for part in parts[1:]]
        assert all(line.startswith("MSG: ") for line in headed)
        assert len(set(headed)) == len(headed), "each type once"
        assert name in generate_dynamic(name, schema)  # raises if a type is missing


def test_unknown_types_are_named():
    for name in ("nobody_msgs/msg/Thing", "Thing", "gearsim_msgs/msg/Thing"):
        with pytest.raises(InputError, match=name):
            definitions.definition(name)


def test_types_of_installed_packages_are_found(tmp_path, monkeypatch):
    folder = tmp_path / "share" / "toy_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Toy.msg").write_text("# a toy\ntoy_msgs/Part[] parts\nstd_msgs/Header header\nuint8 RED=1\n")
    (folder / "Part.msg").write_text("float64 size\nstring<=5 name\n")
    monkeypatch.setenv("AMENT_PREFIX_PATH", str(tmp_path), prepend=os.pathsep)
    schema = definitions.definition("toy_msgs/msg/Toy").schema
    assert schema.startswith("# a toy\n")
    assert "MSG: toy_msgs/Part" in schema
    assert "MSG: builtin_interfaces/Time" in schema


def test_an_installed_package_carries_its_definitions(tmp_path):
    """As `pip install` and `colcon build` do it; what is built works without source tree and ROS."""
    command = [sys.executable, "setup.py", "-q", "egg_info", "--egg-base", str(tmp_path)]
    command += ["build", "--build-base", str(tmp_path / "base"), "--build-lib", str(tmp_path / "lib")]
    subprocess.run(command, cwd=SOURCES, check=True, capture_output=True)
    assert (tmp_path / "lib" / "gearsim_io" / "machines" / "mfpt.yaml").is_file()
    code = (
        "from gearsim_io import definitions, machines\n"
        "print(definitions.__file__, definitions.definition('gearsim_msgs/msg/Alarm').type_hash)\n"
        "machines.load_machine('mfpt')\n"
    )
    env = {"PATH": os.environ["PATH"], "PYTHONPATH": str(tmp_path / "lib")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=env, cwd=tmp_path, check=True, capture_output=True, text=True
    )
    place, found = done.stdout.split()
    assert place.startswith(str(tmp_path))
    assert found == definitions.definition("gearsim_msgs/msg/Alarm").type_hash
