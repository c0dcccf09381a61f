"""Pitch error: one tooth stands too far ahead or behind, so that its pair carries too much or too little."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.prior import Normal
from gearsim_twin.causes.tooth_faults import tooth_starts

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["ToothPitchError"]

_UNIT_M = 1e-5
_BOUNDS = (1e-7, 1e-3)
_MOST = 3


class ToothPitchError:
    """The transmission error of one tooth, handed over by its share of the load."""

    name = "tooth_pitch_error"
    size = "error_m"
    superposes = True
    parameters: tuple[Parameter, ...] = (
        Parameter("error_m", "m", Normal(0.0, 2e-5, -1e-3, 1e-3), step=1e-6),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "tooth_spall",
            "encoders on both shafts, or another load: a pitch error lasts as long as its tooth is in "
            "contact, a pit only as long as the edge of the other flank rolls over it",
        ),
        ("tooth_crack", "a second load: a crack's deflection grows with it, an error of the pitch does not"),
        ("tooth_wear", "whether one tooth stands out in the average over its turn, or all are alike"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has wheels with teeth."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "tooth_pitch_error"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The wheels of which one tooth out of its place answers most, and which tooth."""
        parts = parts_of(context.contents[0], "tooth_pitch_error")
        found = matches(context, parts, self._build, _UNIT_M, _BOUNDS, angle="tooth", signed=True)
        return tooth_starts(context, found, parts, "error_m", _UNIT_M, _MOST)

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one tooth out of its place."""
        params = {"error_m": float(values["error_m"]), "tooth": int(values.get("tooth", 1))}
        return with_fault(content, "tooth_pitch_error", str(values["component"]), params)

    def signature(self, values: Values) -> str:
        """Once a turn, as long as a tooth is in contact."""
        return (
            f"tooth {values.get('tooth', '1')} of {values['component']} is met "
            f"{1e6 * float(values['error_m']):.3g} "
            "um too early: once a turn two jolts a pitch apart, lines at all multiples of the wheel's turn"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "tooth_pitch_error", part.name, {"error_m": value, "tooth": 1})
