"""Shaft bow: a shaft that is bent where its wheel sits presses like a spring that turns, K times the bow.

The bent shaft would be free of force with its wheel off the line of its bearings. Each bending spring k
between wheel and bearing takes the elongation x_wheel - x_seat - bow cos(phi); so k bow acts on the wheel
and -k bow on the seat, whatever the speed (Nicholas, Gunter and Allaire, J. Eng. Power 98, 1976, 171).
"""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.on_shaft import bending_shaft_names, shaft_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rotating_force import rotating_pair
from gearsim_sim.model.shafts import Shaft
from gearsim_sim.params.fields import SiKeyed, Strict


class ShaftBowParams(Strict):
    """Distance of the wheel's centre from the line of the bearings, and its direction."""

    bow_m: Annotated[float, SiKeyed("m", ge=0, le=1e-2)] = 50e-6
    """Distance of the wheel's centre from the line of the bearings, free of force."""
    phase_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] = 0.0
    """Its direction at the shaft's angle zero."""


def place(params: ShaftBowParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:  # noqa: ARG001
    """Rotating forces between wheel and seats, in x and y."""
    shaft = shaft_of(plant, component)
    return rotating_pair(
        _bending(shaft, "x"),
        _bending(shaft, "y"),
        shaft.track,
        shaft.rate,
        shaft.sense,
        params.bow_m,
        params.phase_rad,
        inertial=False,
    )


def _bending(shaft: Shaft, axis: str) -> Vector:
    """Forces on wheel and seats per metre of bow."""
    result: dict[str, float] = {}
    for name, stiffness in shaft.bends.items():
        for plane, sign in ((shaft.wheel, 1.0), (name, -1.0)):
            for dof, share in getattr(shaft.planes[plane], axis).items():
                result[dof] = result.get(dof, 0.0) + sign * stiffness * share
    return result


KIND = FaultKind(
    name="shaft_bow",
    summary="bent shaft: its elastic force turns with it, at any speed the same",
    params_model=ShaftBowParams,
    components=bending_shaft_names,
    place=place,
    look_for="a line at the shaft's speed that does not grow with speed, and a mean shift of the load "
    "in the bearings; told from unbalance by a change of speed",
)
