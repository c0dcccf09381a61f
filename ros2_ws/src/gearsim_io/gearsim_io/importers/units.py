"""Units of measured signals: accelerations become m/s^2, everything else stays what it is."""

from __future__ import annotations

from functools import cache

from gearsim_io.errors import InputError

STANDARD_GRAVITY = 9.80665
_NONE = ("", "1", "-", "none", "unknown")
# Pint takes g for grams.
_GRAVITY = ("g", "G", "gn", "g_n", "g0", "g's")


@cache
def to_si(where: str, unit: str) -> tuple[float, str]:
    """Factor and unit under which a signal in `unit` is kept; "1" where none is stated.

    Raises
    ------
    InputError
        If nobody knows such a unit.
    """
    text = unit.strip().replace("²", "^2").replace("s2", "s^2")
    if text.lower() in _NONE:
        return 1.0, "1"
    if text in _GRAVITY:
        return STANDARD_GRAVITY, "m/s^2"
    if text == "m/s^2":
        return 1.0, text
    import pint  # here, because it takes a quarter of a second to load

    try:
        quantity = pint.UnitRegistry().Quantity(1.0, text)
    except (pint.PintError, AttributeError, ValueError, AssertionError):
        raise InputError(where, "unit", unit, "g, m/s^2, another unit, or 1 where none is stated") from None
    try:
        return float(quantity.to("m/s^2").magnitude), "m/s^2"
    except pint.PintError:
        return 1.0, text


def to_hz(where: str, value: float, unit: str) -> float:
    """A rotational speed in turns per second."""
    per_minute = ("rpm", "r/min", "rev/min", "1/min")
    if unit in per_minute:
        return value / 60.0
    if unit in ("Hz", "rev/s", "1/s"):
        return value
    raise InputError(where, "speed: unit", unit, "Hz or rpm")
