"""Wear: the flanks of a wheel have lost material all round, after Archard."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["ToothWear"]

_UNIT_M = 2e-5
_BOUNDS = (1e-7, 5e-4)
_MOST = 3


class ToothWear:
    """Flanks worn in proportion to load and sliding: nothing at the pitch point, most at root and tip."""

    name = "tooth_wear"
    parameters: tuple[Parameter, ...] = (Parameter("depth_m", "m", LogNormal(_UNIT_M, 2.5, *_BOUNDS)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("load_fluctuation", "a torque transducer: wear changes the mesh's lines at a steady torque, too"),
        (
            "transfer_path",
            "a second speed: worn flanks lift multiples of the mesh whatever their frequency; a "
            "profile modification does so as well and is told by another load, as it was made for one",
        ),
        ("gear_runout", "lines beside those of the mesh, which flanks that are all alike do not have"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has wheels with teeth."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "gear_wear"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The wheels whose wear answers most of what the lines of the mesh deviate by."""
        parts = parts_of(context.contents[0], "gear_wear")
        found = matches(context, parts, self._build, _UNIT_M, _BOUNDS, twins=False)
        return [{"component": match.part.name, "depth_m": match.value} for match in found[:_MOST]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With one wheel worn; the scatter from tooth to tooth is the simulator's."""
        return with_fault(
            content, "gear_wear", str(values["component"]), {"depth_m": float(values["depth_m"])}
        )

    def signature(self, values: Values) -> str:
        """Multiples of the mesh."""
        return (
            f"the lines of the mesh of {values['component']} and of its multiples change, "
            "without any tooth that "
            f"stands out: flanks worn by {1e6 * float(values['depth_m']):.3g} um at root and tip"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "gear_wear", part.name, {"depth_m": value, "scatter": 0.0})
