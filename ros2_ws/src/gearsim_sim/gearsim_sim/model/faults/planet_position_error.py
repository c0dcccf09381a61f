"""A planet's pin out of its place: its meshes are pressed together more, or less, than those of the others.

Ahead along the circle of the pins by a and outward by b compresses the mesh with the sun by
a cos(alpha) + b sin(alpha), that with the ring by a cos(alpha) - b sin(alpha).
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.contributions import MeshMod
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.planets import mesh_loads, planet_index, planet_names, planetary, shift_mods
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict


class PlanetPositionErrorParams(Strict):
    """Where the pin is, from where it should be: ahead in the sense in which the carrier drives it."""

    ahead_m: Annotated[float, SiKeyed("m", ge=-1e-3, le=1e-3)] = 2e-6
    """Displacement of the pin in the direction of rotation."""
    outward_m: Annotated[float, SiKeyed("m", ge=-1e-3, le=1e-3)] = 0.0
    """Displacement of the pin away from the centre."""


def place(params: PlanetPositionErrorParams, component: str, plant: Plant, seed: int) -> tuple[MeshMod, ...]:  # noqa: ARG001
    """Constant compressions of both meshes.

    Raises
    ------
    InputError
        If a mesh would lose contact under the nominal load: the model has none.
    """
    stage = planetary(plant)
    planet, angle = planet_index(stage, component), stage.geometry.pressure_angle_rad
    along, across = params.ahead_m * math.cos(angle), params.outward_m * math.sin(angle)
    nominal, change = mesh_loads(stage, planet, along + across, along - across)
    worst = float(np.min(change / nominal))
    if worst <= -1:
        expected = f"less than {abs(params.ahead_m / worst):.3g} m ahead in proportion, or teeth would part"
        raise InputError("planet", "ahead_m", params.ahead_m, expected)
    return shift_mods(stage, planet, along + across, along - across)


KIND = FaultKind(
    name="planet_position_error",
    summary="pin of a planet out of its place on the carrier: unequal loads, less cancels in the sum",
    params_model=PlanetPositionErrorParams,
    components=planet_names,
    place=place,
    look_for="lines of the carrier's order around the mesh order, where a perfect stage has only every N-th",
)
