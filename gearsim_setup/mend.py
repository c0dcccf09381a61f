"""Mend the ROS wheels: their exported CMake files name folders of the machine that built them.

Two folders are meant, the C headers of Python and those of numpy. Both stood under /opt/python when
the wheels were built (the layout of the manylinux images); here they are wherever the interpreter
and the virtual environment are.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from gearsim_setup.problems import SetupProblem

_BUILDER = r"/opt/(?:_internal|python)/[^;\"'\s$<>]*?"
_NUMPY = re.compile(_BUILDER + r"/site-packages/numpy/(?:_core|core)/include(?![\w/])")
_PYTHON = re.compile(_BUILDER + r"/include/python3\.\d+t?(?![\w/.])")
_LEFT = re.compile(r"/opt/(?:_internal|python)/[^;\"'\s]*")


def mend_text(text: str, python_include: str, numpy_include: str) -> str:
    """Put the folders of this machine into one CMake file; a mended text comes back as it is."""
    text = _NUMPY.sub(lambda _: numpy_include, text)
    return _PYTHON.sub(lambda _: python_include, text)


def mend_tree(share: Path, python_include: Path, numpy_include: Path) -> int:
    """Mend every CMake file under `share`.

    Parameters
    ----------
    share : Path
        `share` of the virtual environment, which is an ament prefix.
    python_include, numpy_include : Path
        Folders of C headers on this machine.

    Returns
    -------
    int
        How many files had to be changed.

    Raises
    ------
    SetupProblem
        When a file still names a folder of the builder afterwards: then the wheels have changed
        and these two mends no longer are enough.
    """
    changed = 0
    for path in sorted(share.rglob("*.cmake")):
        text = path.read_text(encoding="utf-8")
        if "/opt/" not in text:
            continue
        mended = mend_text(text, str(python_include), str(numpy_include))
        left = _LEFT.search(mended)
        if left is not None:
            raise SetupProblem(f"{path}: names {left.group()}, a folder of the machine that built the wheel")
        if mended != text:
            # Never a half-written file: the original stays until the new one is whole.
            fresh = path.with_name(path.name + ".new")
            fresh.write_text(mended, encoding="utf-8")
            os.replace(fresh, path)
            changed += 1
    return changed


def count_unmended(share: Path) -> int:
    """How many CMake files under `share` still name a folder of the builder."""
    return sum(bool(_LEFT.search(path.read_text(encoding="utf-8"))) for path in share.rglob("*.cmake"))
