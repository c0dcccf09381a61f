"""Numbers as messages write them: a few significant digits, and no exponent where people use none."""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any

__all__ = ["number", "plural", "written"]

_WRITTEN_OUT = (1e-4, 1e7)
_ALL_THAT_MATTER = 9


def number(value: float, digits: int = _ALL_THAT_MATTER, *, sign: bool = False) -> str:
    """`value` to that many significant digits: 150, not 1.5e+02; 0.3, not 0.30000000000000004.

    Parameters
    ----------
    value : float
    digits : int
        Significant digits; those left of the point are filled with zeros, so 1234 to two of them is 1200.
    sign : bool
        Whether a plus is written too.

    Returns
    -------
    str
        With an exponent only below 0.0001 and from ten millions on.
    """
    plus = "+" if sign else ""
    if not math.isfinite(value):
        return f"{value:{plus}}"
    rounded = float(f"{value:.{digits}g}")
    low, high = _WRITTEN_OUT
    if rounded == 0 or low <= abs(rounded) < high:
        return f"{rounded:{plus}.15g}"
    return f"{value:{plus}.{digits}g}"


def written(value: Any) -> str:
    """`value` as Python writes it; numbers, also in lists and tuples, without their errors of rounding."""
    if isinstance(value, Integral) and not isinstance(value, bool):
        return str(int(value))
    if isinstance(value, Real) and not isinstance(value, bool):
        plain = float(str(value))  # so that 0.3 in single precision is 0.3
        short = number(plain)
        return repr(plain) if float(short) == plain else short
    if isinstance(value, tuple):
        return "(" + ", ".join(map(written, value)) + ")"
    if isinstance(value, list):
        return "[" + ", ".join(map(written, value)) + "]"
    return repr(value)


def plural(count: int, one: str, many: str = "") -> str:
    """Such as `1 gap` and `3 gaps`."""
    return f"{count} {one if count == 1 else many or one + 's'}"
