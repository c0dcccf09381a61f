"""Spall on one flank of a planet's tooth: only the mesh with the sun, or only that with the ring, has it."""

from __future__ import annotations

from typing import Annotated, Literal

from gearsim_sim.model.contributions import ERROR, MeshMod
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.planets import both_meshes, checked_tooth, planet_index, planet_names, planetary
from gearsim_sim.model.planet_faults import spall_drop
from gearsim_sim.model.planet_geometry import RING, SUN
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.flanks import ToothSpall
from gearsim_sim.params.fields import Count, SiKeyed, Strict


class PlanetToothSpallParams(Strict):
    """The pit; the defaults are the channel of thesis 7.3.2, on the pitch circle.

    `shape` rounded: the other flank dips in as far as its curvature lets it, and a second pair of teeth in
    contact carries it in part. Rectangular: `depth_m` is the transmission error itself, alike in both
    meshes, as thesis Figure 7.10 has it (there a few micrometres at most: teeth do not fall 0.1 mm).
    """

    side: Literal["sun", "ring"] = "sun"
    """Flank that is spalled: the one that meets sun or ring."""
    width_m: Annotated[float, SiKeyed("m", gt=0)] = 1e-3
    """Length of the spall along the profile."""
    depth_m: Annotated[float, SiKeyed("m", gt=0)] = 0.1e-3
    """Depth of the spall."""
    radius_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Radius of its middle on the tooth; the pitch circle if left out."""
    face_fraction: Annotated[float, SiKeyed("", gt=0, le=1)] = 1.0
    """Part of the face width that is spalled."""
    shape: Literal["rounded", "rectangular"] = "rounded"
    """Smooth or rectangular edges."""
    tooth: Count = 1
    """Number of the tooth, from 1."""


def place(params: PlanetToothSpallParams, component: str, plant: Plant, seed: int) -> tuple[MeshMod, ...]:  # noqa: ARG001
    """Transmission error of one mesh."""
    stage = planetary(plant)
    planet, tooth = planet_index(stage, component), checked_tooth(stage, int(params.tooth))
    side = SUN if params.side == "sun" else RING
    spall = ToothSpall(params.width_m, params.depth_m, params.radius_m, params.face_fraction, params.shape)
    drop = spall_drop(stage.params, stage.geometry, side, planet, spall, tooth)
    mesh = both_meshes(stage, planet)[side]
    return (MeshMod(mesh, ERROR, stage.track("planet"), drop),)


KIND = FaultKind(
    name="planet_tooth_spall",
    summary="spall on the sun's or the ring's flank of a planet's tooth (thesis 7.3.2, 7.6)",
    params_model=PlanetToothSpallParams,
    components=planet_names,
    place=place,
    look_for="one impulse for each turn of the planet on the carrier (four for each turn of the carrier in "
    "unsw_planetary); on the ring they come and go with the carrier",
)
