"""Unbalance: a mass out of the centre of a shaft; its force grows with the square of the speed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import Match, matches
from gearsim_twin.causes.prior import LogNormal, Uniform

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Unbalance"]

_UNIT_KG_M = 0.01
_BOUNDS = (1e-6, 10.0)
_TOP = 3
_MOST = 4


class Unbalance:
    """A rotating force on the wheel's plane of a shaft."""

    name = "unbalance"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("unbalance_kg_m", "kg*m", LogNormal(_UNIT_KG_M, 4.0, *_BOUNDS)),
        Parameter("phase_rad", "rad", Uniform(-math.pi, math.pi)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "gear_runout",
            "a second speed: an unbalance's force grows with its square, a run-out's hardly; and the "
            "direction across the line of action, which teeth do not shake",
        ),
        ("misalignment", "levels at twice the speed, which an unbalance does not have; a run uncoupled"),
        (
            "looseness",
            "all feet side by side: a loose one rattles at many multiples, an unbalance shakes all",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has shafts that can be out of balance."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "unbalance"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The shafts whose unbalance answers most of what comes once per turn, with its direction."""
        parts = parts_of(context.contents[0], "unbalance")
        found = matches(context, parts, self._build, _UNIT_KG_M, _BOUNDS, angle="any", top=_TOP)
        return [self._guess(match) for match in found[:_MOST]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With the unbalance in the plane of the shaft's wheel."""
        numbers = {p.name: float(values[p.name]) for p in self.parameters}
        return with_fault(content, "unbalance", str(values["component"]), numbers)

    def signature(self, values: Values) -> str:
        """Where, and how it follows the speed."""
        return (
            f"one line at the speed of shaft {values['component']}, in every direction across it, that grows "
            f"with the square of the speed: {1e3 * float(values['unbalance_kg_m']):.3g} g m out of balance"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "unbalance", part.name, {"unbalance_kg_m": value})

    @staticmethod
    def _guess(match: Match) -> dict[str, float | str]:
        phase = math.remainder(-2 * math.pi * match.angle_turns, 2 * math.pi)
        return {"component": match.part.name, "unbalance_kg_m": match.value, "phase_rad": phase}
