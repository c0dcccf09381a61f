"""What the methods of this folder ask of a signal."""

from __future__ import annotations

import operator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearsim_io.errors import InputError

__all__ = ["checked_count", "checked_signal"]


def checked_signal(where: str, signal: ArrayLike, least: int, why: str = "") -> NDArray[np.float64]:
    """The signal as a vector of float64 with at least `least` finite samples.

    Raises
    ------
    InputError
        Telling how long the signal must be, or how many of its values are not finite.
    """
    x = np.asarray(signal)
    if x.ndim != 1 or x.dtype.kind not in "fiu":
        raise InputError(where, "signal", f"{x.dtype} of shape {x.shape}", "a vector of real samples")
    if x.size < least:
        need = f"at least {least} samples{f' ({why})' if why else ''}"
        raise InputError(where, "signal", f"{x.size} samples", need)
    x = x.astype(np.float64, copy=False)
    bad = x.size - int(np.count_nonzero(np.isfinite(x)))
    if bad:
        raise InputError(where, "signal", f"{bad} values that are not finite", "finite samples")
    return x


def checked_count(where: str, field: str, value: int, least: int, most: int | None = None) -> int:
    """The value as an int within [least, most]."""
    expected = f"a whole number of {least} or more" if most is None else f"a whole number, {least} to {most}"
    try:
        count = operator.index(value)
    except TypeError:
        raise InputError(where, field, value, expected) from None
    if count < least or (most is not None and count > most):
        raise InputError(where, field, value, expected)
    return count
