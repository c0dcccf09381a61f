"""Compilation with numba of the few loops that array operations cannot do, cached on disk where possible.

numba keys its cache by the source file of the function alone: a compiled function must call none that is
compiled in another file.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

__all__ = ["compiled"]

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered and multiply-adds fused, so that loops fill vector registers; NaN and infinity
# keep their meaning. The order is fixed at compile time: one build gives the same bits at each call.
_FAST = {"reassoc", "contract", "nsz"}


def compiled(function: Function, *, fast: bool = True) -> Function:
    """The function compiled, running without the interpreter's lock.

    Parameters
    ----------
    function : callable
    fast : bool
        Whether sums may be reordered.
    """
    options: dict[str, Any] = {"nogil": True, "fastmath": _FAST if fast else False, "error_model": "numpy"}
    try:
        return cast(Function, numba.njit(cache=True, **options)(function))
    except RuntimeError:  # no writable place for the cache
        return cast(Function, numba.njit(**options)(function))
