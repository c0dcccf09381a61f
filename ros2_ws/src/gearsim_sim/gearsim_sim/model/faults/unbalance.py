"""Unbalance: a mass whose centre goes round with the shaft and presses outward, m e w^2."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.on_shaft import plane_of, shaft_names, shaft_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rotating_force import rotating_pair
from gearsim_sim.params.fields import SiKeyed, Strict


class UnbalanceParams(Strict):
    """`plane` is a place along the shaft: its wheel (default) or one of its bearings."""

    # A rotor of 10 kg with its centre of mass 1 mm out of line; balancing to G 6.3 at 10 Hz allows a tenth.
    unbalance_kg_m: Annotated[float, SiKeyed("kg*m", ge=0, le=10)] = 0.01
    """Mass times the distance of its centre from the axis."""
    phase_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] = 0.0
    """Direction of the centre at the shaft's angle zero."""
    plane: str | None = None
    """Place along the shaft: its wheel, or one of its bearings."""


def place(params: UnbalanceParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:  # noqa: ARG001
    """Rotating forces in x and y."""
    shaft = shaft_of(plant, component)
    plane = plane_of(shaft, params.plane)
    return rotating_pair(
        plane.x,
        plane.y,
        shaft.track,
        shaft.rate,
        shaft.sense,
        params.unbalance_kg_m,
        params.phase_rad,
        inertial=True,
    )


KIND = FaultKind(
    name="unbalance",
    summary="mass out of centre on a shaft: a force that turns with it and grows with the speed squared",
    params_model=UnbalanceParams,
    components=shaft_names,
    place=place,
    look_for="a line at the shaft's speed in both directions, a quarter turn apart, growing with the "
    "square of the speed; almost nothing at its multiples or in the envelope",
)
