"""Spall on one flank of a gear tooth: the other flank dips in, a geometric error once per turn."""

from __future__ import annotations

from typing import Annotated, Literal

import numpy as np

from gearsim_io.quantities import Si
from gearsim_sim.model.contributions import ERROR, Contribution
from gearsim_sim.model.faults.kind import MAX_SEVERITY, FaultKind
from gearsim_sim.model.faults.wheels import (
    check_tooth,
    error_mod,
    scale_of,
    stiffness_mod,
    wheel_names,
    wheels_of,
)
from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.model.mesh_terms import MeshPulse
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.flanks import ToothSpall, spall_contact_loss, spall_error, spall_extent
from gearsim_sim.model.tooth.sharing import handovers, shares
from gearsim_sim.model.tooth.windows import scaled
from gearsim_sim.params.fields import Count, Fraction, SiKeyed, Strict


class GearToothSpallParams(Strict):
    """Parameters of a spall on the drive flank; by default that of thesis 7.3.2."""

    width_m: Annotated[float, SiKeyed("m", gt=0)] = 1e-3
    """Length along the profile."""
    depth_m: Annotated[float, SiKeyed("m", gt=0)] = 0.1e-3
    """Depth of its floor."""
    radius_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Distance of its middle from the gear's axis; by default on the pitch circle."""
    face_fraction: Fraction = 1.0
    """Part of the face width that it takes."""
    shape: Literal["rounded", "rectangular"] = "rounded"
    """rounded: the other flank rolls over the edges as deep as its curvature lets it; rectangular: down to
    the floor at once (thesis Figure 7.10), with exact means of the jumps."""
    contact_loss: Annotated[float, Si("", ge=0, le=0.9)] = 0.0
    """Part of the contact line that the Hertz stiffness loses while the spall is crossed."""
    tooth: Count = 1
    """Which tooth, from 1."""


def place(
    params: GearToothSpallParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """Transmission error, and loss of stiffness if asked for, in each mesh of the wheel."""
    spall = ToothSpall(params.width_m, params.depth_m, params.radius_m, params.face_fraction, params.shape)
    found: list[Contribution] = []
    for wheel in wheels_of(plant, component):
        tooth = check_tooth(wheel, params.tooth)
        if params.shape == "rectangular":
            found += _pulses(wheel, spall, tooth)
        else:
            error = spall_error(
                wheel.pair, spall, of_wheel=wheel.of_wheel, tooth=tooth, harmonics=wheel.sharp_harmonics
            )
            found.append(error_mod(wheel, error))
        if params.contact_loss > 0:
            loss = spall_contact_loss(
                wheel.pair,
                spall,
                params.contact_loss,
                of_wheel=wheel.of_wheel,
                tooth=tooth,
                harmonics=wheel.sharp_harmonics,
            )
            found.append(stiffness_mod(plant, wheel, scaled(loss, scale_of(plant, wheel)), MAX_SEVERITY))
    return tuple(found)


def _pulses(wheel: GearWheel, spall: ToothSpall, tooth: int) -> list[MeshPulse]:
    """Rectangles: between the hand-overs of the load the drop counts with the share at the middle."""
    first, _, last = spall_extent(wheel.pair, spall, of_wheel=wheel.of_wheel)
    edges = np.array([first, *sorted(p for p in handovers(wheel.pair) if first < p < last), last])
    share = shares(wheel.pair, (edges[1:] + edges[:-1]) / 2)
    teeth = wheel.gear.teeth
    ends = (edges + tooth + 0.5) / teeth
    starts = (np.minimum(wheel.sense * ends[:-1], wheel.sense * ends[1:]) + wheel.start_turns) % 1.0
    heights = -spall.depth_m * spall.face_fraction * share
    return [
        MeshPulse(wheel.mesh, ERROR, wheel.track, float(start), float(width), float(height))
        for start, width, height in zip(starts, np.diff(edges) / teeth, heights, strict=True)
    ]


KIND = FaultKind(
    name="gear_tooth_spall",
    summary="pit in one flank of one tooth: transmission error once per turn of the gear (thesis 7.3.2)",
    params_model=GearToothSpallParams,
    components=wheel_names,
    place=place,
    look_for=(
        "One sharp double event per turn of the gear, when contact enters and leaves the pit; many "
        "sidebands of the shaft around mesh lines and resonances; hardly any dependence on load, unlike a "
        "crack."
    ),
)
