"""Carrier modulation: the carrier's axis is off the ring's; each planet meets it deeper once a turn."""

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

__all__ = ["CarrierModulation"]

_UNIT_M = 2e-5
_BOUNDS = (1e-7, 1e-3)
_RING = "ring"


class CarrierModulation:
    """The ring off the carrier's axis: errors of order 1 of the carrier in all its meshes."""

    name = "carrier_modulation"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("eccentricity_m", "m", LogNormal(_UNIT_M, 3.0, *_BOUNDS)),
        Parameter("phase_rad", "rad", Uniform(-math.pi, math.pi)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "planet_position_error",
            "a sensor that turns with the carrier: a pin out of place stands still there",
        ),
        (
            "unequal_load_sharing",
            "strain gauges at the ring's teeth: whether one planet always presses more, or "
            "whichever passes one place",
        ),
        ("load_fluctuation", "a torque transducer: whether the torque swings once per turn of the carrier"),
        ("gear_runout", "the ring taken out and turned by some teeth: its own run-out comes along"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever planets roll in a ring."""
        return bool(context.contents) and bool(self._parts(context))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """If the lines beside the mesh, at the carrier's distance, answer to it."""
        found = matches(context, self._parts(context), self._build, _UNIT_M, _BOUNDS, angle="any")
        return [self._guess(match) for match in found[:1]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With the ring off the axis of the carrier."""
        numbers = {p.name: float(values[p.name]) for p in self.parameters}
        return with_fault(content, "gear_eccentricity", _RING, numbers)

    def signature(self, values: Values) -> str:
        """Lines beside those of the mesh."""
        return (
            "every planet presses harder at one place of the ring: lines at the carrier's turn "
            "on both sides of "
            f"those of the mesh; axes {1e6 * float(values['eccentricity_m']):.3g} um apart"
        )

    @staticmethod
    def _parts(context: Context) -> list[Part]:
        parts = parts_of(context.contents[0], "gear_eccentricity")
        return [part for part in parts if part.name == _RING]

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "gear_eccentricity", part.name, {"eccentricity_m": value})

    @staticmethod
    def _guess(match: Match) -> dict[str, float | str]:
        phase = math.remainder(-2 * math.pi * match.angle_turns, 2 * math.pi)
        return {"eccentricity_m": match.value, "phase_rad": phase}
