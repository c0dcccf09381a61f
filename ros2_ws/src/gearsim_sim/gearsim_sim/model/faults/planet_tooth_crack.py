"""Root crack of a planet's tooth: both meshes of the planet get softer while that tooth is in contact.

The load of one mesh pulls the crack open, that of the other, on the other flank, presses it shut.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

from gearsim_sim.model.contributions import STIFFNESS, MeshMod
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.planets import both_meshes, checked_tooth, planet_index, planet_names, planetary
from gearsim_sim.model.planet_faults import crack_loss
from gearsim_sim.model.planet_geometry import RING, SUN
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.crack import Crack, depth_to_middle_m
from gearsim_sim.params.fields import Count, SiKeyed, Strict


class PlanetToothCrackParams(Strict):
    """The crack; without `depth_m` it reaches the middle of the tooth, as the slot of thesis 7.3.2.

    `closing` is the part of the loss that is left in the mesh that presses the crack shut: 1 for a slot.
    """

    opens_towards: Literal["sun", "ring"] = "sun"
    """Mesh that pulls the crack open."""
    depth_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Length of the crack; to the middle of the tooth if left out."""
    angle_rad: Annotated[float, SiKeyed("rad", gt=0, le=math.pi / 2)] = math.pi / 4
    """Angle between the crack and the tooth's centre line."""
    width_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Part of the face width that is cracked; all if left out."""
    closing: Annotated[float, SiKeyed("", ge=0, le=1)] = 0.3
    """Share of the loss that is left in the mesh that presses the crack shut."""
    tooth: Count = 1
    """Number of the tooth, from 1."""


def place(params: PlanetToothCrackParams, component: str, plant: Plant, seed: int) -> tuple[MeshMod, ...]:  # noqa: ARG001
    """Loss of stiffness in the meshes with sun and ring."""
    stage = planetary(plant)
    planet, tooth = planet_index(stage, component), checked_tooth(stage, int(params.tooth))
    gear = stage.geometry.sun.pinion
    depth = depth_to_middle_m(gear, params.angle_rad) if params.depth_m is None else params.depth_m
    crack = Crack(depth, params.angle_rad, params.width_m, params.closing)
    track = stage.track("planet")
    mods = []
    for side, name, mesh in zip((SUN, RING), ("sun", "ring"), both_meshes(stage, planet), strict=True):
        opens = params.opens_towards == name
        loss = crack_loss(stage.params, stage.geometry, side, planet, crack, tooth, opens=opens)
        mods.append(MeshMod(mesh, STIFFNESS, track, loss))
    return tuple(mods)


KIND = FaultKind(
    name="planet_tooth_crack",
    summary="root crack of a planet's tooth: softer meshes with sun and ring (thesis 7.3.2, 7.9)",
    params_model=PlanetToothCrackParams,
    components=planet_names,
    place=place,
    look_for="two impulses for each turn of the planet on the carrier (eight for each turn of the carrier in "
    "unsw_planetary), strong and weak in turn if the crack closes; on the ring they come and go with it",
)
