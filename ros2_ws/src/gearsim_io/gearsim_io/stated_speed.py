"""The speed of the reference shaft as a person or a file states it: read, checked, and kept in the notes."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.numbers import number

__all__ = [
    "FROM_FILE",
    "FROM_USER",
    "OPTION",
    "check_speed",
    "given_far_off",
    "origin_words",
    "parse_speed",
    "with_speed",
]

OPTION = "--speed"
FROM_USER, FROM_FILE = "given", "stated in the file"
"""Values of the note `speed from`; without it the speed is the nameplate's."""

_FROM, _PLATE = "speed from", "speed on the nameplate"
# Rigs are run at a fraction of their nominal speed and above it; rpm taken for Hz is 60 times.
_FARTHEST = 10.0
_FASTEST_HZ = 500.0  # as scenarios allow
_TEXT = re.compile(r"\s*([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S.*?)?\s*$")
_PER_HZ = {
    "": 1.0,
    "hz": 1.0,
    "rev/s": 1.0,
    "1/s": 1.0,
    "rpm": 60.0,
    "r/min": 60.0,
    "rev/min": 60.0,
    "1/min": 60.0,
}
_EXPECTED = "a speed above 0 in Hz, or with its unit, such as 1796rpm"


def parse_speed(text: str) -> float:
    """The speed in Hz of a text such as `29.9`, `29.9 Hz` or `1796rpm`; ValueError says what is expected."""
    match = _TEXT.match(text)
    per_hz = _PER_HZ.get((match[2] or "").lower()) if match else None
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        value = math.nan
    if per_hz is None or not (math.isfinite(value) and value > 0):
        raise ValueError(f"got {text}, expected {_EXPECTED}")
    return value / per_hz


def check_speed(where: str, speed_hz: float, machine: Machine) -> None:
    """Refuse a speed that the machine cannot mean, as when rpm are taken for Hz.

    Parameters
    ----------
    where : str
        Option or file that states it.
    speed_hz : float
    machine : Machine

    Raises
    ------
    InputError
        If it is ten times the nameplate's or a tenth of it, or above 500 Hz where the nameplate states none.
    """
    nominal = machine.nominal_speed_hz
    known = math.isfinite(nominal) and nominal > 0
    low, high = (nominal / _FARTHEST, nominal * _FARTHEST) if known else (0.0, _FASTEST_HZ)
    if low <= speed_hz <= high:
        return
    limits = f"{number(low, 3)} to {number(high, 3)} Hz, about the nameplate's {number(nominal, 4)} Hz"
    expected = limits if known else f"at most {high:g} Hz"
    got, as_rpm = number(speed_hz, 6), speed_hz / 60.0
    if low <= as_rpm <= high:
        expected += f"; {got} rpm are {number(as_rpm, 4)} Hz: write {OPTION} {got}rpm"
    raise InputError(where, "", f"{got} Hz", expected)


def with_speed(
    notes: Mapping[str, str], speed_hz: float, origin: str, machine: Machine | None
) -> dict[str, str]:
    """The notes of a record with a speed in place of the nameplate's, which is kept beside it."""
    found = {**notes, "speed_hz": f"{speed_hz:.9g}", _FROM: origin}
    if machine is not None and math.isfinite(machine.nominal_speed_hz):
        found[_PLATE] = f"{machine.nominal_speed_hz:.9g} Hz"
    return found


def given_far_off(notes: Mapping[str, str], tolerance: float) -> str:
    """Words on a speed that the user gave more than `tolerance` off the nameplate's; empty for another."""
    if notes.get(_FROM) != FROM_USER or _PLATE not in notes:
        return ""
    given_hz, nominal_hz = float(notes["speed_hz"]), float(notes[_PLATE].split()[0])
    if abs(given_hz / nominal_hz - 1) <= tolerance:
        return ""
    percent = number(100 * (given_hz / nominal_hz - 1), 2, sign=True)
    return (
        f"the {number(given_hz, 4)} Hz given are {percent} % off the nameplate's {number(nominal_hz, 4)} Hz"
    )


def origin_words(notes: Mapping[str, str], speed_hz: float) -> str:
    """The nominal speed with where it comes from, such as `the nameplate's 29.95 Hz`."""
    value = f"{number(speed_hz, 4)} Hz"
    origin = notes.get(_FROM)
    return f"the nameplate's {value}" if origin is None else f"the {value} {origin}"
