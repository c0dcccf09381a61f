"""A gear that is not mounted on its own axis: run-out once per turn, and a modulated mesh."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import MAX_SEVERITY, FaultKind
from gearsim_sim.model.faults.wheels import error_mod, scale_of, stiffness_mod, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.runout import eccentricity_error, eccentricity_stiffness
from gearsim_sim.model.tooth.windows import scaled
from gearsim_sim.params.fields import SiKeyed, Strict


class GearEccentricityParams(Strict):
    """Parameters of a gear off its axis."""

    eccentricity_m: Annotated[float, SiKeyed("m", gt=0)] = 50e-6
    """Distance between the axis of the teeth and that of the shaft."""
    phase_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] = 0.0
    """Phase of the run-out at angle zero of the gear."""


def place(
    params: GearEccentricityParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """Error and stiffness in each mesh of the wheel, in phase with the place of the mesh."""
    found: list[Contribution] = []
    for wheel in wheels_of(plant, component):
        found.append(error_mod(wheel, eccentricity_error(params.eccentricity_m, params.phase_rad)))
        stiffness = eccentricity_stiffness(
            wheel.pair,
            params.eccentricity_m,
            params.phase_rad,
            teeth=wheel.gear.teeth,
            harmonics=wheel.harmonics,
        )
        found.append(stiffness_mod(plant, wheel, scaled(stiffness, scale_of(plant, wheel)), MAX_SEVERITY))
    return tuple(found)


KIND = FaultKind(
    name="gear_eccentricity",
    summary="gear off its axis: transmission error of order 1 and modulation of the mesh stiffness",
    params_model=GearEccentricityParams,
    components=wheel_names,
    place=place,
    look_for=(
        "The shaft's line in encoder and torque, and one pair of sidebands at the shaft's speed beside "
        "every mesh line."
    ),
)
