"""Backlash: the teeth of a mesh part where errors outweigh the load, and strike again."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import Part, parts_of
from gearsim_twin.causes.matched import matches
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["BacklashContactLoss"]

_PLAYS_M = (2e-5, 1e-4, 4e-4)
_BOUNDS = (1e-6, 5e-3)
_LEAST_GAIN = 30.0  # of chi^2, as for other effects


class BacklashContactLoss:
    """Teeth that can part: no force while they do, and impacts on the back flanks where the play is small."""

    name = "backlash_contact_loss"
    parameters: tuple[Parameter, ...] = (Parameter("backlash_m", "m", LogNormal(1e-4, 3.0, *_BOUNDS)),)
    confused_with: tuple[tuple[str, str], ...] = (
        ("tooth_wear", "a higher load: teeth that are pressed together do not part, worn flanks stay worn"),
        (
            "load_fluctuation",
            "a torque transducer: torque that swings through zero lets teeth part, play without "
            "need of it does not",
        ),
    )

    def applies(self, context: Context) -> bool:
        """Wherever the model has meshes whose teeth are known."""
        return bool(context.contents) and bool(parts_of(context.contents[0], "gear_backlash"))

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """Plays with which the model parts its teeth as the record does; none where it would not."""
        meshes = parts_of(context.contents[0], "gear_backlash")
        found: list[tuple[float, dict[str, float | str]]] = []
        for play_m in _PLAYS_M:
            for match in matches(context, meshes, self._build, play_m, (1e-12, 1.0), angle="power"):
                strength = match.value / play_m
                # Of the squares, with the effect as it is and not scaled.
                gain = match.drop * (2.0 * strength - 1.0) / strength**2
                if gain > _LEAST_GAIN:
                    found.append((gain, {"component": match.part.name, "backlash_m": play_m}))
        return [guess for _, guess in sorted(found, key=lambda one: -one[0])[:3]]

    def extend(self, content: Content, values: Values, context: Context) -> Content:  # noqa: ARG002
        """With play in one mesh."""
        params = {"backlash_m": float(values["backlash_m"])}
        return with_fault(content, "gear_backlash", str(values["component"]), params)

    def signature(self, values: Values) -> str:
        """Impacts under low load."""
        return (
            f"the teeth of {values['component']} part and strike again, the more the lower the "
            "load: lines of the "
            "mesh far up, jumps of the level with load or speed; play of "
            f"{1e6 * float(values['backlash_m']):.3g} um along the line of action"
        )

    @staticmethod
    def _build(content: Content, part: Part, value: float) -> Content:
        return with_fault(content, "gear_backlash", part.name, {"backlash_m": value})
