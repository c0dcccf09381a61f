"""Tip and root relief: right for one load, wrong for others."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.wheels import error_mod, scale_of, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.flanks import Relief, relief_depth
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.sharing import loaded_error_series
from gearsim_sim.model.tooth.windows import stretched
from gearsim_sim.params.fields import SiKeyed, Strict


class ProfileModificationParams(Strict):
    """Parameters of tip and root relief."""

    tip_m: Annotated[float, SiKeyed("m", ge=0, le=1e-3)] = 10e-6
    """Material taken off at the tip end of the working flank."""
    root_m: Annotated[float, SiKeyed("m", ge=0, le=1e-3)] = 0.0
    """Material taken off at its root end."""
    length: Annotated[float, Si("", gt=0, le=1)] = 0.5
    """How far the relief reaches, over the length of double contact; 1: long, 0.5: short relief."""
    power: Annotated[float, Si("", ge=1, le=4)] = 1.0
    """1: straight, 2: parabolic from where it begins."""
    load_nm: Annotated[float, SiKeyed("N*m", gt=0)] | None = None
    """Load torque at which the pairs share the force; by default that of the start."""


def place(
    params: ProfileModificationParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """Transmission error in each mesh of the wheel that gives its compression under the load."""
    load = plant.limits.load_nm if params.load_nm is None else params.load_nm
    if load <= 0:
        raise InputError(
            component, "load_nm", load, "a load above zero under which the pairs share the force"
        )
    relief = Relief(params.tip_m, params.root_m, params.length, params.power)
    mods = []
    for wheel in wheels_of(plant, component):
        # The teeth of the model may be softer or stiffer than by the potential-energy method.
        force = load * wheel.force_per_load_n_per_nm / scale_of(plant, wheel)
        missing = partial(_missing, wheel.pair, relief, wheel.of_wheel)
        error = loaded_error_series(wheel.pair, missing, force, wheel.sharp_harmonics)
        mods.append(error_mod(wheel, stretched(error, wheel.gear.teeth)))
    return tuple(mods)


def _missing(
    pair: GearPair, relief: Relief, of_wheel: bool, phase: NDArray[np.float64]
) -> NDArray[np.float64]:
    return -relief_depth(pair, relief, phase, of_wheel=of_wheel)


KIND = FaultKind(
    name="profile_modification",
    summary="tip and root relief of all teeth of a gear, under a given load",
    params_model=ProfileModificationParams,
    components=wheel_names,
    place=place,
    look_for=(
        "Only mesh lines change: lower near the load that the relief was made for, higher far from it."
    ),
)
