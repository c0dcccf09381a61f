"""Unequal load sharing: one planet carries more than its part of the load."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.planets_alike import of_planets
from gearsim_twin.causes.prior import Normal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["UnequalLoadSharing"]

_UNIT = 0.3
_BOUNDS = (0.01, 0.9)


class UnequalLoadSharing:
    """One planet carries more than its part of the load, or less."""

    name = "unequal_load_sharing"
    superposes = True
    parameters: tuple[Parameter, ...] = (Parameter("excess", "1", Normal(0.0, 0.4, -0.9, 5.0), step=0.03),)
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "planet_position_error",
            "a second load: a pin out of its place adds the same force at any load, so that its "
            "share falls; what shares unequally by stiffness keeps its share. In one record they are one",
        ),
        (
            "carrier_modulation",
            "a sensor that turns with the carrier: one planet stands still there, a place of the "
            "ring goes round",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever planets share a load."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "unequal_load_sharing"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The planets whose excess answers most of the lines that equal planets cancel."""
        parts = parts_of(context.contents[0], "unequal_load_sharing")
        found = of_planets(context, parts, self._build, _UNIT, _BOUNDS)
        return [{"component": match.part.name, "excess": match.sign * match.value} for match in found]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one planet that carries more or less."""
        params = {"excess": float(values["excess"])}
        return with_fault(content, "unequal_load_sharing", str(values["component"]), params)

    def signature(self, values: Values) -> str:
        """Lines that equal planets cancel."""
        return (
            f"{values['component']} carries {100 * float(values['excess']):+.0f} % against its "
            "equal part: lines "
            "beside the mesh, at distances of the carrier's turn, that equal planets would "
            "cancel in their sum"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "unequal_load_sharing", part.name, {"excess": value})
