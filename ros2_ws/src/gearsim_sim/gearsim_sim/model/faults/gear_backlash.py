"""Backlash: the teeth of a mesh can part and meet again on either flank."""

from __future__ import annotations

from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.wheels import geared_mesh_names, mesh_index
from gearsim_sim.model.mesh_terms import BACKLASH, MeshTerm
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict


class GearBacklashParams(Strict):
    """Parameters of the play."""

    backlash_m: Annotated[float, SiKeyed("m", gt=0, le=5e-3)] = 100e-6
    """Play between drive and back flanks along the line of action."""


def place(
    params: GearBacklashParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """One number of the law of contact."""
    return (MeshTerm(mesh_index(plant, component), BACKLASH, params.backlash_m),)


KIND = FaultKind(
    name="gear_backlash",
    summary="play between the teeth: contact loss and impacts, on the back flanks too, where the load is low",
    params_model=GearBacklashParams,
    components=geared_mesh_names,
    place=place,
    look_for=(
        "At low load or with large errors the teeth rattle: broad-band bursts where the torque passes "
        "through zero, subharmonics, a mesh force that stays at zero. At full load nothing at all."
    ),
)
