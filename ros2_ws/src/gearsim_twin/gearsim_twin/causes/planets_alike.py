"""First guesses of what stands still on the carrier: planets are alike to all but few sensors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content
from gearsim_twin.causes.gear_model import Part
from gearsim_twin.causes.matched import Match, matches

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["of_planets"]

_BY_MARK = 2


def of_planets(
    context: Context,
    planets: Sequence[Part],
    build: Callable[[Content, Part, float], Content],
    unit: float,
    bounds: tuple[float, float],
) -> list[Match]:
    """Planets that may have an effect that stands still on the carrier, or its opposite.

    First those by the mark of the angle as it stands, then those that a mark anywhere else would tell: which
    planet that is only levels of sensors on the carrier know. Parameters as for `matches`.
    """
    by_mark = matches(context, planets, build, unit, bounds, signed=True)
    anywhere = matches(context, planets, build, unit, bounds, signed=True, any_mark=True)
    found: dict[tuple[str, float], Match] = {}
    for match in (*by_mark[:_BY_MARK], *anywhere):
        found.setdefault((match.part.name, match.sign), match)
    return list(found.values())
