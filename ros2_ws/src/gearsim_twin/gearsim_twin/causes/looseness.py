"""Looseness: the bolts of a pedestal hold no more; pressed it is stiff, lifted it is soft."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.near_bearing import by_distance
from gearsim_twin.causes.prior import Uniform

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Looseness"]

_UNIT = 0.25
_BOUNDS = (0.05, 0.95)
_MOST = 3
_GUESSES = (0.85, 0.5)


class Looseness:
    """A pedestal's base that is softer while it lifts."""

    name = "looseness"
    superposes = True
    parameters: tuple[Parameter, ...] = (Parameter("reduction", "1", Uniform(0.0, 0.95)),)
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "misalignment",
            "the coupling opened, or the bolts of one foot tightened: which of both changes it; and the "
            "direction across: a foot lifts one way, a coupling out of line shakes all round",
        ),
        (
            "unbalance",
            "levels at multiples of the speed, and whether one foot moves much more than the others",
        ),
        ("casing_resonance", "a run-up: what a foot does follows the speed, a resonance stays"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever bearings stand on pedestals."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "looseness"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The feet whose lifting answers most, with the share of stiffness that is lost.

        What lifts a foot once a turn are run-outs of the wheels, whose angles differ from machine to machine:
        so lines beside the mesh may stand at any. Where there is no mesh, passages in the bearings lift it:
        then the bearing near which noise and envelopes differ is asked for.
        """
        content = context.contents[0]
        teeth = {round(shaft.turns, 9): shaft.teeth for shaft in parts_of(content, "unbalance")}
        feet = [
            replace(foot, teeth=teeth.get(round(foot.turns, 9), 1)) for foot in parts_of(content, "looseness")
        ]
        found = matches(context, feet, self._build, _UNIT, _BOUNDS, angle="any")
        machine = context.case.machine
        if found or machine.gear_meshes or machine.planetary_stages:
            return [{"component": match.part.name, "reduction": match.value} for match in found[:_MOST]]
        bearings = {bearing.name for bearing in machine.bearings}
        near = by_distance(context, [foot.name for foot in feet if foot.name in bearings])[:1]
        return [{"component": name, "reduction": value} for name in near for value in _GUESSES]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one loose foot, whose bolts just hold the static lift."""
        return with_fault(
            content, "looseness", str(values["component"]), {"reduction": float(values["reduction"])}
        )

    def signature(self, values: Values) -> str:
        """Many multiples on one foot."""
        return (
            f"many multiples of the speed at the foot of {values['component']}, most of all in "
            "the direction of "
            f"lifting, where {100 * float(values['reduction']):.0f} % of the stiffness of its "
            "base are missing"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "looseness", part.name, {"reduction": value})
