"""Colours and names, the same in every view."""

from __future__ import annotations

from functools import lru_cache

Rgb = tuple[int, int, int]

WAVEFORM: Rgb = (110, 170, 230)
BEHIND: Rgb = (105, 110, 120)
SPECTRUM: Rgb = (135, 145, 160)
FAULT_RUNNING: Rgb = (240, 140, 60)
NO_FAULT: Rgb = (60, 130, 80)
_FAMILIES: dict[str, Rgb] = {
    "BPFO": (235, 80, 70),
    "BPFI": (250, 180, 60),
    "2xBSF": (190, 110, 230),
    "BSF": (190, 110, 230),
    "FTF": (70, 200, 200),
}
_OTHERS: tuple[Rgb, ...] = (
    (95, 160, 235),
    (240, 140, 60),
    (110, 200, 110),
    (225, 90, 120),
    (170, 130, 230),
    (200, 180, 70),
    (80, 200, 200),
    (190, 190, 190),
)
# Levels of an alarm: word, colour, and rerun's level for the log.
_LEVELS: tuple[tuple[str, Rgb, str], ...] = (
    ("ok", NO_FAULT, "INFO"),
    ("WARNING", (225, 170, 50), "WARN"),
    ("ALARM", (215, 60, 55), "ERROR"),
    ("stale", (110, 110, 110), "WARN"),
)


def other(number: int) -> Rgb:
    """A colour for the n-th of several like things."""
    return _OTHERS[number % len(_OTHERS)]


def level(number: int) -> tuple[str, Rgb, str]:
    """Word, colour and log level of an alarm's level."""
    return _LEVELS[min(max(int(number), 0), len(_LEVELS) - 1)]


def family(label: str) -> Rgb:
    """The colour of a fault family, whatever the case of its name."""
    return next((rgb for name, rgb in _FAMILIES.items() if name.lower() == label.lower()), other(len(label)))


def family_name(stem: str) -> str:
    """`bpfo` as people write it."""
    return next((name for name in _FAMILIES if name.lower() == stem.lower()), stem.upper())


@lru_cache(maxsize=4096)
def entity(*parts: str) -> str:
    """An entity path of free texts; what a path cannot hold becomes `_`."""
    allowed = ("".join(c if c.isalnum() or c in "_-." else " " for c in part) for part in parts)
    return "/".join("_".join(part.split()) or "machine" for part in allowed)
