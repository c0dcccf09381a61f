"""Compilation with numba, cached on disk where a writable place can be found.

numba keys its cache by the source file of the function alone; a change in another file that is called
from there would go unnoticed. So the cache folder carries a hash of all sources that are compiled.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numba.core.config

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered and multiply-adds fused, so that loops fill vector registers; NaN and infinity
# keep their meaning. The order is fixed at compile time: one build gives the same bits at each call.
FAST = {"reassoc", "contract", "nsz"}
# The compiler keeps two versions of a loop that writes to one array while it reads another, and takes the
# scalar one where they lie (nearly) end to end. Where these fuse different multiply-adds, bits would hang on
# where the arrays happen to lie; so nothing is fused there.
_UNFUSED = FAST - {"contract"}
_ROOT = Path(__file__).parents[1]
_FOLDERS = ("integrate", "model")
_NOT_COMPILED = _ROOT / "model" / "casing"  # finite elements, in numpy


def compiled(function: Function, *, allocates: bool = True) -> Function:
    """The function compiled, running without the interpreter's lock, cached on disk if possible.

    One that allocates no arrays need not count references to them either. In a loop whose arrays come in
    tuples that counting can cost several times what the work does.
    """
    return _compiled(function, FAST, allocates=allocates)


def compiled_exactly(function: Function, *, allocates: bool = True) -> Function:
    """The same, but for each operation being done as it is written and in that order."""
    return _compiled(function, False, allocates=allocates)


def _compiled(function: Function, fast: set[str] | bool, *, allocates: bool = True) -> Function:
    options: dict[str, Any] = {"nogil": True, "fastmath": fast, "error_model": "numpy"}
    if not allocates:
        options["_nrt"] = False
    folder = cache_folder()
    if folder is None:
        return cast(Function, numba.njit(**options)(function))
    config: Any = numba.core.config
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)  # read when the decorator runs
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    finally:
        config.CACHE_DIR = before


def inlined(function: Function) -> Function:
    """A part of a compiled loop, copied into it: sizes that are constants there become constants here.

    It is read and typed anew with each copy, which is slow: for pieces whose loops need constant sizes.
    """
    return cast(Function, numba.njit(inline="always", fastmath=FAST, error_model="numpy")(function))


def embedded(function: Function) -> Function:
    """A part of a compiled loop that is typed once for all loops and entered into each as machine code.

    As fast as one that is `inlined` where no constant size matters, and compiled in half of the time.
    """
    options: dict[str, Any] = {"nogil": True, "fastmath": FAST, "error_model": "numpy", "_nrt": False}
    return cast(Function, numba.njit(forceinline=True, **options)(function))


def apart(function: Function) -> Function:
    """A part of a compiled loop that is called, not copied; it allocates nothing. For what few steps need."""
    options: dict[str, Any] = {"nogil": True, "fastmath": _UNFUSED, "error_model": "numpy", "_nrt": False}
    return cast(Function, numba.njit(**options)(function))


@cache
def cache_folder() -> Path | None:
    """Where compiled code is kept: below $XDG_CACHE_HOME or ~/.cache, else the temporary folder; or None.

    The folder must belong to this user and not be open to all, since its content is executed.
    """
    stamp = _source_hash()
    home = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    user = f"gearsim-{os.getuid()}" if hasattr(os, "getuid") else "gearsim"
    for base in (Path(home) / "gearsim", Path(tempfile.gettempdir()) / user):
        folder = base / f"numba-{stamp}"
        try:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            with tempfile.TemporaryFile(dir=folder):
                pass
        except OSError:
            continue
        if _is_private(base) and _is_private(folder):
            return folder
    return None


def _is_private(folder: Path) -> bool:
    status = folder.stat()
    return not hasattr(os, "getuid") or (status.st_uid == os.getuid() and not status.st_mode & 0o002)


def _source_hash() -> str:
    digest = hashlib.sha256(numba.__version__.encode())
    for name in _FOLDERS:
        for path in sorted((_ROOT / name).rglob("*.py")):
            if path.is_relative_to(_NOT_COMPILED):
                continue
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]
