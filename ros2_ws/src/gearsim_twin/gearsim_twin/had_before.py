"""Faults that healthy records show themselves: these are no news, and not looked for."""

from __future__ import annotations

from collections.abc import Sequence

from gearsim_twin.causes.bearing_signs import signs_of
from gearsim_twin.view import View

__all__ = ["had_before"]


def had_before(views: Sequence[View]) -> tuple[str, ...]:
    """What the diagnosis calls a fault in records that are said to be of the healthy machine, for people."""
    found = []
    for view in views:
        faults = dict.fromkeys(
            f"{sign.fault.replace('_', ' ')} of {sign.component}" for sign in signs_of(view) if sign.is_fault
        )
        if faults:
            found.append(
                f"{view.record.source}, said to be healthy, shows a fault itself ({', '.join(faults)}): "
                "what it had already is not told here"
            )
    return tuple(found)
