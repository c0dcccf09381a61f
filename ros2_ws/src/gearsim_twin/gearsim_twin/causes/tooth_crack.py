"""Crack: the root of one tooth is cracked, so that its mesh is softer once a turn."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.gear_model import Part
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.tooth_faults import most_of, tooth_starts, toothed, with_tooth_fault

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

_KIND, _SIZE = "gear_tooth_crack", "depth_m"
__all__ = ["ToothCrack"]

_BOUNDS = (1e-4, 0.02)
_GROWS = 1.2  # what is lost grows with the depth to about this power
_MOST = 3


class ToothCrack:
    """Less stiffness of a mesh while one tooth is in contact."""

    name = "tooth_crack"
    superposes = True
    size = _SIZE
    parameters: tuple[Parameter, ...] = (Parameter("depth_m", "m", LogNormal(2e-3, 1.8, *_BOUNDS)),)
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "tooth_spall",
            "encoders on both shafts: a cracked tooth yields for its whole contact and the more the "
            "greater the load, a pit lets the flank drop as long as it is crossed, at any load",
        ),
        (
            "tooth_pitch_error",
            "a second load: a crack's deflection grows with it, an error of the pitch does not",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has wheels or planets with teeth."""
        return bool(context.contents) and bool(toothed(context.contents[0], _KIND))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The wheels of which one soft tooth answers most, which tooth, and how deep."""
        parts = toothed(context.contents[0], _KIND)
        deepest = min(most_of(context.contents[0], _KIND, part.name) for part in parts)
        unit = 0.5 * deepest
        bounds = (_BOUNDS[0], deepest)
        found = matches(context, parts, self._build, unit, bounds, angle="tooth", power=_GROWS, twins=False)
        return tooth_starts(context, found, parts, _SIZE, unit, _MOST)

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one tooth cracked, at most as deep as leaves a fifth of it."""
        component = str(values["component"])
        depth_m = min(float(values["depth_m"]), most_of(content, _KIND, component))
        tooth, side = int(values.get("tooth", 1)), str(values.get("side", ""))
        return with_tooth_fault(content, _KIND, component, side, tooth, {_SIZE: depth_m})

    def signature(self, values: Values) -> str:
        """Once a turn, as long as a tooth is in contact, and with the load."""
        return (
            f"tooth {values.get('tooth', '1')} of {values['component']} yields as long as it is "
            "in contact, once "
            "for each of its meetings, more under more load: lines at all multiples of its turn, faint in "
            f"accelerations and clear in the transmission error; crack "
            f"{1e3 * float(values['depth_m']):.2g} mm deep"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_tooth_fault(content, _KIND, part.name, part.side, 1, {_SIZE: value})
