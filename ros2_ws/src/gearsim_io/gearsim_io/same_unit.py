"""Values of errors in the unit of the bound that they miss."""

from __future__ import annotations

import math
import re
from numbers import Real

from gearsim_io.numbers import number, written

_BOUND = re.compile(r"[0-9] (mm|um|deg)\b")
_PER_SI = {"mm": 1e3, "um": 1e6, "deg": 180 / math.pi}
# Units that keys carry at their end, as they are written beside numbers.
_KEYED = {"m": "m", "rad": "rad", "n": "N", "hz": "Hz", "nm": "N m"}


def in_unit_of(expected: str, value: Real, field: str) -> str:
    """A number in SI units as the text of an error, in the unit in which `expected` tells its bound.

    Where `expected` names no unit of its own, the key does: 0.03 of `width_m` is `0.03 m`.
    """
    bound = _BOUND.search(expected)
    if bound is not None:
        return f"{number(float(value) * _PER_SI[bound[1]], 6)} {bound[1]}"
    unit = _KEYED.get(field.rpartition("_")[2]) if "_" in field else None
    return f"{number(float(value))} {unit}" if unit else written(value)
