"""Names of sites that are seen through frequency responses of the casing."""

from __future__ import annotations

_PREFIX = "frf:"


def through_responses(site: str) -> str:
    """Name of a place's acceleration as the casing's frequency responses give it."""
    return _PREFIX + site


def place_of(name: str) -> str | None:
    """The place that such a name stands for; None for a site of the model itself."""
    return name.removeprefix(_PREFIX) if name.startswith(_PREFIX) else None
