"""Position error: the pin of a planet is not where it should be on the carrier."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.planets_alike import of_planets
from gearsim_twin.causes.prior import Normal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["PlanetPositionError"]

_UNIT_M = 5e-6
_BOUNDS = (1e-7, 2e-4)


class PlanetPositionError:
    """A planet whose pin is ahead of its place on the carrier, or further out."""

    name = "planet_position_error"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("ahead_m", "m", Normal(0.0, 1e-5, -2e-4, 2e-4), step=5e-7),
        Parameter("outward_m", "m", Normal(0.0, 1e-5, -2e-4, 2e-4), step=5e-7),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "unequal_load_sharing",
            "a second load: a pin out of its place adds the same force at any load, so that its "
            "share falls. In one record they are one",
        ),
        ("carrier_modulation", "a sensor that turns with the carrier: a pin stands still there"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever planets sit on a carrier."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "planet_position_error"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The planets whose place answers most: ahead, which loads them, and outward, which hardly does."""
        parts = parts_of(context.contents[0], "planet_position_error")
        found = of_planets(context, parts, self._build, _UNIT_M, _BOUNDS)
        return [
            {"component": match.part.name, "ahead_m": match.sign * match.value, "outward_m": 0.0}
            for match in found
        ]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one pin out of its place."""
        numbers = {p.name: float(values[p.name]) for p in self.parameters}
        return with_fault(content, "planet_position_error", str(values["component"]), numbers)

    def signature(self, values: Values) -> str:
        """Lines that planets in their places cancel."""
        return (
            f"the pin of {values['component']} stands {1e6 * float(values['ahead_m']):+.3g} um ahead and "
            f"{1e6 * float(values['outward_m']):+.3g} um outward: lines beside the mesh, at distances of the "
            "carrier's turn, that planets in their places would cancel in their sum"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "planet_position_error", part.name, {"ahead_m": value})
