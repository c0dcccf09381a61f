"""Unequal load sharing: one planet carries more, or less, than its part of the torque.

The cause is a small error of its pin along the circle; how large that must be follows from the stiffness
of the machine at its nominal load.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.contributions import MeshMod
from gearsim_sim.model.faults.kind import MAX_SEVERITY, FaultKind
from gearsim_sim.model.faults.planets import mesh_loads, planet_index, planet_names, planetary, shift_mods
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict

_UNIT = 1e-6


class UnequalLoadSharingParams(Strict):
    """`excess`: how much more than its part the planet carries at the nominal load (0.3: 30 % more)."""

    excess: Annotated[float, SiKeyed("", gt=-1, le=10)] = 0.3
    """Load of this planet above its equal share, as a fraction of it."""


def place(params: UnequalLoadSharingParams, component: str, plant: Plant, seed: int) -> tuple[MeshMod, ...]:  # noqa: ARG001
    """The compression of both meshes that brings the excess about.

    Raises
    ------
    InputError
        If there is but one planet or no load, or another planet would lose contact.
    """
    stage = planetary(plant)
    planet = planet_index(stage, component)
    if stage.params.planets < 2 or stage.limits.load_nm == 0:
        raise InputError("planet", "excess", params.excess, "two planets or more, under load, that can share")
    nominal, change = mesh_loads(stage, planet, _UNIT, _UNIT)
    gain = float(change[planet] / nominal[planet])
    if abs(gain) < 1e-6:
        raise InputError("planet", "excess", params.excess, "a machine that does not even out all loads")
    share = change / nominal / gain
    worst = float(np.min(params.excess * share))
    if worst * MAX_SEVERITY <= -1:
        limit = math.copysign(abs(params.excess / worst) / MAX_SEVERITY, params.excess)
        raise InputError("planet", "excess", params.excess, f"beyond {limit:.3g} teeth part at severity 2")
    error = params.excess / gain * _UNIT
    return shift_mods(stage, planet, error, error)


KIND = FaultKind(
    name="unequal_load_sharing",
    summary="one planet carries more than its part of the load",
    params_model=UnequalLoadSharingParams,
    components=planet_names,
    place=place,
    look_for="lines of the carrier's order around the mesh order, where a perfect stage has only every N-th",
)
