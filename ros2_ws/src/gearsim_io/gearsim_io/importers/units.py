"""Units of measured signals: accelerations become m/s^2, everything else stays what it is."""

from __future__ import annotations

from functools import cache
from typing import Any

from gearsim_io.errors import InputError

STANDARD_GRAVITY = 9.80665
_NONE = ("", "1", "-", "none", "unknown")
# Pint takes g for grams.
_GRAVITY = ("g", "G", "gn", "g_n", "g0", "g's")
ACCELERATIONS = ("m/s^2", "mm/s^2", "cm/s^2", "in/s^2", "ft/s^2", "Gal")
OTHERS = ("m/s", "mm/s", "in/s", "m", "mm", "um", "V", "mV", "A", "mA", "Pa", "kPa", "N", "N*m")
"""What else sensors give: velocity, displacement, raw voltage or current, sound, force, torque."""


@cache
def to_si(where: str, unit: str) -> tuple[float, str]:
    """Factor and unit under which a signal in `unit` is kept; "1" where none is stated.

    Any spelling of a unit of `ACCELERATIONS` or `OTHERS` is understood.

    Raises
    ------
    InputError
        If sensors have no such unit.
    """
    text = unit.strip().replace("²", "^2").replace("s2", "s^2")
    if text.lower() in _NONE:
        return 1.0, "1"
    if text in _GRAVITY:
        return STANDARD_GRAVITY, "m/s^2"
    if text in ("mg", "milli-g"):
        return 1e-3 * STANDARD_GRAVITY, "m/s^2"
    if text == "m/s^2":
        return 1.0, text
    if text in OTHERS:
        return 1.0, text
    wanted = _quantity(text)
    if wanted is not None:
        for known in ACCELERATIONS:
            if wanted == _quantity(known):
                return float(wanted.to("m/s^2").magnitude), "m/s^2"
        if any(wanted == _quantity(known) for known in OTHERS):
            return 1.0, text
    expected = f"one of g, mg, {', '.join(ACCELERATIONS + OTHERS)}, or 1 where none is stated"
    raise InputError(where, "unit", unit, expected)


@cache
def _quantity(text: str) -> Any:
    """One of that unit; None where nobody knows it."""
    import pint  # here, because it takes a quarter of a second to load

    try:
        return _registry().Quantity(1.0, text)
    except (pint.PintError, AttributeError, ValueError, AssertionError):
        return None


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def to_hz(where: str, value: float, unit: str) -> float:
    """A rotational speed in turns per second."""
    per_minute = ("rpm", "r/min", "rev/min", "1/min")
    if unit in per_minute:
        return value / 60.0
    if unit in ("Hz", "rev/s", "1/s"):
        return value
    raise InputError(where, "speed: unit", unit, "Hz or rpm")
