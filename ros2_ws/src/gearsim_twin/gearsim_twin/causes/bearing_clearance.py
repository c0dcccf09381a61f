"""Radial clearance grown by wear: fewer elements carry, and the bearing gives more, and less evenly.

The stiffness across the load falls and what passes through the bearing with it; elements that come and go
push at the BPFO (varying compliance), without impacts as long as the load holds the ring.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.bearing_model import bearings_of, fault_of, most_growth_m
from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.near_bearing import by_distance
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spalls import has_bearings

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["BearingClearance"]

_KIND = "bearing_clearance"
# Which elements carry changes with tenths of a micrometre: between these, smaller ones are tried as `size`.
_GUESSES_M = (1.6e-6, 5e-6, 15e-6)
_ROOM = 0.98
_MOST_BEARINGS = 2


class BearingClearance:
    """Clearance that has grown."""

    name = "bearing_clearance"
    parameters: tuple[Parameter, ...] = (Parameter("growth_m", "m", LogNormal(5e-6, 3.0, 1e-7, 2e-4)),)
    size = "growth_m"
    confused_with: tuple[tuple[str, str], ...] = (
        ("bearing_spall_outer", "kurtosis above 5 kHz: varying compliance pushes without impacts"),
        ("casing_resonance", "a second load: a bearing's stiffness grows with the load, a casing's does not"),
    )

    def applies(self, context: Context) -> bool:
        """Where a bearing is modelled whose load leaves room for a growth."""
        if not has_bearings(context):
            return False
        content = context.contents[0]
        return any(most_growth_m(content, name) > 0 for name in bearings_of(content))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The bearings near which most differs; nowhere if nothing does."""
        content = context.contents[0]
        able = [
            name
            for name in bearings_of(content)
            if fault_of(content, _KIND, name) is None and most_growth_m(content, name) > 0
        ]
        ranked = by_distance(context, able)[:_MOST_BEARINGS]
        return [
            {"component": name, "growth_m": min(growth, 0.8 * most_growth_m(content, name))}
            for growth in _GUESSES_M
            for name in ranked
        ]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """The content with the growth, as far as it leaves a load zone."""
        component = str(values["component"])
        growth = min(float(values["growth_m"]), _ROOM * most_growth_m(content, component))
        return with_fault(content, _KIND, component, {"growth_m": growth})

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"more motion at the BPFO of {values['component']} without impacts, and less stiffness across "
            f"its load: the gap has grown by {1e6 * float(values['growth_m']):.2g} um at each side"
        )
