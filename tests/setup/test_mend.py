"""The two mends of the ROS wheels' CMake files."""

from __future__ import annotations

from pathlib import Path

import pytest

from gearsim_setup.mend import count_unmended, mend_text, mend_tree
from gearsim_setup.problems import SetupProblem

HEADERS, NUMPY = "/usr/include/python3.12", "/home/me/.venv/lib/python3.12/site-packages/numpy/_core/include"
# What CMake writes when a target is exported, with the folders of the wheels' builder.
EXPORT = """set_target_properties(std_msgs::std_msgs__rosidl_generator_py PROPERTIES
  INTERFACE_INCLUDE_DIRECTORIES "${{_IMPORT_PREFIX}}/include/std_msgs;{python};{numpy}"
  INTERFACE_LINK_LIBRARIES "std_msgs::std_msgs__rosidl_generator_c;rcutils::rcutils"
)
"""
BUILDERS = [
    ("/opt/python/cp311-cp311", "3.11", "_core"),
    ("/opt/python/cp312-cp312", "3.12", "_core"),
    ("/opt/python/cp313-cp313", "3.13", "_core"),
    ("/opt/python/cp310-cp310", "3.10", "core"),
    ("/opt/_internal/cpython-3.12.11", "3.12", "_core"),
]


def builder_text(prefix: str, minor: str, core: str) -> str:
    numpy = f"{prefix}/lib/python{minor}/site-packages/numpy/{core}/include"
    return EXPORT.format(python=f"{prefix}/include/python{minor}", numpy=numpy)


@pytest.mark.parametrize(("prefix", "minor", "core"), BUILDERS)
def test_both_folders_become_those_of_this_machine(prefix: str, minor: str, core: str) -> None:
    mended = mend_text(builder_text(prefix, minor, core), HEADERS, NUMPY)
    assert mended == EXPORT.format(python=HEADERS, numpy=NUMPY)
    assert mend_text(mended, HEADERS, NUMPY) == mended


def test_order_and_repetition_of_the_folders_do_not_matter() -> None:
    numpy = "/opt/python/cp311-cp311/lib/python3.11/site-packages/numpy/_core/include"
    python = "/opt/python/cp311-cp311/include/python3.11"
    text = f'set(a "{numpy};{python};{numpy}")\nset(b {python})\n'
    assert mend_text(text, "/P", "/N") == 'set(a "/N;/P;/N")\nset(b /P)\n'


@pytest.mark.parametrize(
    "text",
    [
        'set(a "/opt/pythons/include/python3.11")',
        'set(a "/usr/include/python3.11;/opt/ros/kilted/include")',
        'set(a "${_IMPORT_PREFIX}/include/python3.11")',
    ],
)
def test_other_folders_stay(text: str) -> None:
    assert mend_text(text, "/P", "/N") == text


def test_backslashes_in_a_path_are_taken_literally() -> None:
    assert "/a\\1b" in mend_text(builder_text(*BUILDERS[0]), "/a\\1b", "/N")


def test_a_tree_is_mended_once_and_whole(tmp_path: Path) -> None:
    for index, builder in enumerate(BUILDERS[:3]):
        path = tmp_path / f"pkg{index}" / "cmake" / "export.cmake"
        path.parent.mkdir(parents=True)
        path.write_text(builder_text(*builder))
    (tmp_path / "pkg0" / "other.txt").write_text(builder_text(*BUILDERS[0]))
    (tmp_path / "plain.cmake").write_text("set(a 1)\n")
    # A mend that was cut off before it took the file's place.
    (tmp_path / "pkg1" / "cmake" / "export.cmake.new").write_text("set_target_prop")
    assert count_unmended(tmp_path) == 3
    assert mend_tree(tmp_path, Path(HEADERS), Path(NUMPY)) == 3
    assert mend_tree(tmp_path, Path(HEADERS), Path(NUMPY)) == 0
    assert count_unmended(tmp_path) == 0
    assert (tmp_path / "pkg1" / "cmake" / "export.cmake").read_text() == EXPORT.format(
        python=HEADERS, numpy=NUMPY
    )
    assert "/opt/python" in (tmp_path / "pkg0" / "other.txt").read_text()


def test_a_folder_that_the_mends_do_not_know_is_told(tmp_path: Path) -> None:
    path = tmp_path / "export.cmake"
    text = 'set(a "/opt/python/cp311-cp311/lib/libpython3.11.a;/opt/python/cp311-cp311/include/python3.11")\n'
    path.write_text(text)
    with pytest.raises(
        SetupProblem, match=r"export\.cmake: names /opt/python/cp311-cp311/lib/libpython3\.11\.a"
    ):
        mend_tree(tmp_path, Path(HEADERS), Path(NUMPY))
    assert path.read_text() == text
