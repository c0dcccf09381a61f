"""Lead error of a mesh: the teeth touch at one end of the face first."""

from __future__ import annotations

from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.wheels import geared_mesh_names, mesh_index
from gearsim_sim.model.mesh_terms import LEAD_GAP, MeshTerm
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict


class GearMisalignmentParams(Strict):
    """Parameters of a lead error."""

    angle_rad: Annotated[float, SiKeyed("rad", gt=0, le=0.02)] = 0.5e-3
    """Between the flanks in the plane of action; 0.5 mrad leaves a gap of 10 um over 20 mm of face."""


def place(
    params: GearMisalignmentParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """The gap at the far end of the face."""
    mesh = mesh_index(plant, component)
    pair = next(wheel.pair for wheel in plant.wheels if wheel.mesh == mesh)
    width = min(pair.pinion.face_width_m, pair.wheel.face_width_m)
    return (MeshTerm(mesh, LEAD_GAP, params.angle_rad * width),)


KIND = FaultKind(
    name="gear_misalignment",
    summary="lead error: edge contact that spreads over the face as the load grows",
    params_model=GearMisalignmentParams,
    components=geared_mesh_names,
    place=place,
    look_for=(
        "A softer mesh at low load: mesh lines and their harmonics change with the torque; at full contact "
        "only a steady angle is left."
    ),
)
