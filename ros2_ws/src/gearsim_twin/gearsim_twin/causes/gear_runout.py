"""Run-out: a wheel's teeth are off the axis of its shaft; the error of the mesh swings once a turn."""

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

__all__ = ["GearRunout"]

_UNIT_M = 3e-5
_BOUNDS = (1e-7, 1e-3)
_MOST = 4
_FIXED = "ring"  # what planets roll in: its run-out is that of the carrier's axis (see carrier_modulation)


class GearRunout:
    """Transmission error of order 1 of a wheel, and its mesh stiffness modulated alike."""

    name = "gear_runout"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("eccentricity_m", "m", LogNormal(_UNIT_M, 3.0, *_BOUNDS)),
        Parameter("phase_rad", "rad", Uniform(-math.pi, math.pi)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "unbalance",
            "a second speed: a run-out's error is the same at any, an unbalance's force grows with its "
            "square; or encoders on both shafts, which see a run-out in the transmission error",
        ),
        (
            "carrier_modulation",
            "encoders on carrier and sun: a wheel's run-out turns with it, the carrier's with it",
        ),
        (
            "tooth_pitch_error",
            "errors that grow along the teeth add up to a run-out; a pitch tester tells both",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has wheels with teeth."""
        return bool(context.contents) and bool(self._parts(context))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The wheels whose run-out answers most of the deviation at their turn and beside their mesh."""
        found = matches(context, self._parts(context), self._build, _UNIT_M, _BOUNDS, angle="any")
        return [self._guess(match) for match in found[:_MOST]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one wheel off its axis."""
        numbers = {p.name: float(values[p.name]) for p in self.parameters}
        return with_fault(content, "gear_eccentricity", str(values["component"]), numbers)

    def signature(self, values: Values) -> str:
        """Lines of the turn and beside the mesh."""
        return (
            f"the mesh of {values['component']} swings once in its turn: a line at that order, "
            "most of all in the "
            "transmission error, and one pair of sidebands beside every line of the mesh; the "
            "wheel runs out by "
            f"{1e6 * float(values['eccentricity_m']):.3g} um"
        )

    @staticmethod
    def _parts(context: Context) -> list[Part]:
        parts = parts_of(context.contents[0], "gear_eccentricity")
        return [part for part in parts if part.name != _FIXED]

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "gear_eccentricity", part.name, {"eccentricity_m": value})

    @staticmethod
    def _guess(match: Match) -> dict[str, float | str]:
        phase = math.remainder(-2 * math.pi * match.angle_turns, 2 * math.pi)
        return {"component": match.part.name, "eccentricity_m": match.value, "phase_rad": phase}
