"""numba's compiler with a cache on disk of this generator's own."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import numba.core.config

Function = TypeVar("Function", bound=Callable[..., Any])
_FAST = {"reassoc", "contract", "nsz"}


def compiled(function: Function) -> Function:
    """The function compiled; kept in a private folder of the user, if one can be written."""
    options: dict[str, Any] = {"nogil": True, "fastmath": _FAST, "error_model": "numpy"}
    folder = Path(tempfile.gettempdir()) / f"gearsim-blind-{os.getuid()}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        usable = folder.stat().st_uid == os.getuid()
    except OSError:
        usable = False
    if not usable:
        return cast(Function, numba.njit(**options)(function))
    config: Any = numba.core.config
    before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    finally:
        config.CACHE_DIR = before
