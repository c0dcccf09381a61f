"""Spall: a pit in the working flank of one tooth, into which the other flank drops."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.gear_model import Part
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.tooth_faults import most_of, tooth_starts, toothed, with_tooth_fault

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

_KIND, _SIZE = "gear_tooth_spall", "width_m"
__all__ = ["ToothSpall"]

_UNIT_M = 1e-3
# How far a pit has grown is not known: any size from the least to a flank of 3 mm, every octave alike, has
# this geometric mean, and exp(ln(60) / sqrt(12)) for its standard deviation.
_USUAL_M, _FACTOR = 4e-4, 3.3
_BOUNDS = (5e-5, 0.01)
_GROWS = 2.0  # the flank drops by the square of the width as long as the floor is not reached
_MOST = 3


class ToothSpall:
    """A transmission error once a turn while the other flank rolls over a pit."""

    name = "tooth_spall"
    superposes = True
    size = _SIZE
    parameters: tuple[Parameter, ...] = (Parameter("width_m", "m", LogNormal(_USUAL_M, _FACTOR, *_BOUNDS)),)
    confused_with: tuple[tuple[str, str], ...] = (
        (
            "tooth_crack",
            "encoders on both shafts: a cracked tooth yields for its whole contact and the more the "
            "greater the load, a pit lets the flank drop as long as it is crossed, at any load",
        ),
        (
            "tooth_pitch_error",
            "encoders on both shafts, or a look at the flank: the error of a pit is shorter than a pitch",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has wheels or planets with teeth."""
        return bool(context.contents) and bool(toothed(context.contents[0], _KIND))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The wheels on which a pit in one flank answers most, which tooth, and how wide."""
        parts = toothed(context.contents[0], _KIND)
        widest = min(most_of(context.contents[0], _KIND, part.name) for part in parts)
        bounds = (_BOUNDS[0], widest)
        found = matches(context, parts, self._build, _UNIT_M, bounds, angle="tooth", power=_GROWS)
        return tooth_starts(context, found, parts, _SIZE, 0.3 * widest, _MOST)

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With a pit in one flank, at most as wide as the flank that works."""
        component = str(values["component"])
        width_m = min(float(values["width_m"]), most_of(content, _KIND, component))
        tooth, side = int(values.get("tooth", 1)), str(values.get("side", ""))
        return with_tooth_fault(content, _KIND, component, side, tooth, {_SIZE: width_m})

    def signature(self, values: Values) -> str:
        """Once a turn, short and hard."""
        return (
            f"a short knock each time that tooth {values.get('tooth', '1')} of "
            f"{values['component']} is met, at any "
            "load: lines at all multiples of its turn, far up; a pit of "
            f"{1e3 * float(values['width_m']):.2g} mm along the flank"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_tooth_fault(content, _KIND, part.name, part.side, 1, {_SIZE: value})
