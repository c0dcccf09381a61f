"""Backlash: the teeth of a mesh part where errors outweigh the load, and strike again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_fault
from gearsim_twin.causes.gear_model import parts_of
from gearsim_twin.causes.matched import simulated_with
from gearsim_twin.causes.prior import LogNormal
from gearsim_twin.causes.spectra_beside import beside

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["BacklashContactLoss"]

_PLAYS_M = (2e-5, 1e-4, 4e-4)
_BOUNDS = (1e-6, 5e-3)
_SECONDS = 2.0
# What parts shakes all bands: a fifth and more of what differs goes. Impacts are no two times the same.
_LEAST_MISFIT, _LEAST_GAIN, _LEAST_PART = 0.5, 30.0, 0.2


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
        record = max(range(len(context.views)), key=lambda k: context.views[k].record.seconds)
        own, model = context.views[record], context.simulated_views[record]
        before = _misfit(own, model)
        if before < _LEAST_MISFIT * max(_bands(own, model), 1):
            return []
        found: list[tuple[float, dict[str, float | str]]] = []
        for mesh in meshes[:1]:
            for play_m in _PLAYS_M:
                content = with_fault(
                    context.contents[record], "gear_backlash", mesh.name, {"backlash_m": play_m}
                )
                made = simulated_with(context, record, content, min(_SECONDS, own.record.seconds))
                gain = before - _misfit(own, made) if made is not None else 0.0
                if gain > _LEAST_GAIN and gain > _LEAST_PART * before:
                    found.append((gain, {"component": mesh.name, "backlash_m": play_m}))
        return [guess for _, guess in sorted(found, key=lambda one: -one[0])]

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


def _misfit(own: View, model: View) -> float:
    """Squares of what levels differ by in bands of all channels, in standard deviations, five at most."""
    both = [beside(own, model, channel) for channel in own.record.channels]
    return sum(float(np.sum(np.minimum((b.ratio_db / b.std_db) ** 2, 25.0))) for b in both if b is not None)


def _bands(own: View, model: View) -> int:
    both = [beside(own, model, channel) for channel in own.record.channels]
    return sum(b.ratio_db.size for b in both if b is not None)
