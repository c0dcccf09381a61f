"""When an environment counts as standing, and what makes it be built again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearsim_setup.main import is_ready
from gearsim_setup.places import Places
from gearsim_setup.route import WHEELS
from gearsim_setup.stamp import PARTS, Stamp, expected_parts


def changed_parts(copy: Path, change) -> set[str]:
    before = expected_parts(Places(copy), WHEELS)
    change()
    after = expected_parts(Places(copy), WHEELS)
    return {part for part in PARTS if before[part] != after[part]}


@pytest.mark.parametrize(
    ("name", "text", "parts"),
    [
        ("requirements.lock", "other", {"wheels"}),
        ("requirements-ros.lock", "other", {"wheels"}),
        ("ros2_ws/src/some_msgs/msg/One.msg", "float32 a\n", {"messages"}),
        ("ros2_ws/src/some_msgs/msg/Two.msg", "float64 a\n", {"messages"}),
        ("ros2_ws/src/some_msgs/CMakeLists.txt", "", {"messages"}),
        ("ros2_ws/src/some_msgs/package.xml", "", {"messages"}),
        ("ros2_ws/src/some_program/setup.py", "", {"packages"}),
        ("ros2_ws/src/some_program/setup.cfg", "", {"packages"}),
        ("ros2_ws/src/some_program/package.xml", "", {"packages"}),
        ("ros2_ws/src/some_program/launch/new.launch.py", "", {"packages"}),
        ("ros2_ws/src/some_program/some_program/code.py", "A = 2\n", set()),
        ("ros2_ws/src/some_program/some_program/more.py", "B = 2\n", set()),
        (".venv/pyvenv.cfg", "home = /elsewhere\nversion = 3.12.3\n", {"venv"}),
    ],
)
def test_only_what_depends_on_a_file_is_made_again(
    standing: Path, name: str, text: str, parts: set[str]
) -> None:
    assert is_ready(Places(standing), WHEELS)
    assert changed_parts(standing, lambda: (standing / name).write_text(text)) == parts
    assert is_ready(Places(standing), WHEELS) == (not parts)


def test_the_content_of_a_linked_file_does_not_matter(standing: Path) -> None:
    launch = standing / "ros2_ws/src/some_program/launch/new.launch.py"
    launch.write_text("a")
    assert changed_parts(standing, lambda: launch.write_text("b")) == set()


def test_a_message_moved_to_another_name_is_a_change(standing: Path) -> None:
    one = standing / "ros2_ws/src/some_msgs/msg/One.msg"
    assert changed_parts(standing, lambda: one.rename(one.with_name("Uno.msg"))) == {"messages"}


def test_another_place_or_another_ros_is_another_environment(copy: Path, tmp_path: Path) -> None:
    here = expected_parts(Places(copy), WHEELS)
    moved = copy.rename(tmp_path / "moved")
    there = expected_parts(Places(moved), WHEELS)
    assert {part for part in PARTS if here[part] != there[part]} == {"venv"}
    assert expected_parts(Places(moved), "jazzy at /opt")["venv"] != there["venv"]


def test_striking_a_part_strikes_all_that_is_built_on_it(tmp_path: Path) -> None:
    stamp = Stamp(tmp_path / "stamp.json")
    for part in PARTS:
        stamp.complete(part, "x")
    stamp.strike("wheels")
    reread = Stamp(tmp_path / "stamp.json")
    assert [part for part in PARTS if reread.has(part, "x")] == ["venv"]
    assert not reread.fits(dict.fromkeys(PARTS, "x"))


def test_an_unknown_part_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="part: got extras"):
        Stamp(tmp_path / "stamp.json").complete("extras", "x")


@pytest.mark.parametrize(
    "content", ["", "{", "[]", '"venv"', json.dumps({"venv": 3, "other": "x"}), "\x00\xff"]
)
def test_a_damaged_stamp_means_that_nothing_is_known(standing: Path, content: str) -> None:
    Places(standing).stamp.write_text(content, encoding="utf-8")
    assert not is_ready(Places(standing), WHEELS)
    stamp = Stamp(Places(standing).stamp)
    stamp.complete("venv", "x")
    assert Stamp(Places(standing).stamp).has("venv", "x")


def test_a_missing_interpreter_or_install_is_noticed(standing: Path) -> None:
    places = Places(standing)
    (places.install / "setup.sh").unlink()
    assert not is_ready(places, WHEELS)
    (places.install / "setup.sh").write_text("")
    assert is_ready(places, WHEELS)
    places.python.unlink()
    places.python.symlink_to("/nowhere/python3.12")
    assert not is_ready(places, WHEELS)
