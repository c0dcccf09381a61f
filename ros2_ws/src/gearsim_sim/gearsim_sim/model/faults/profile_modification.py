"""Tip and root relief: right for one load, wrong for others."""

from __future__ import annotations

from typing import Annotated

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import MAX_SEVERITY, FaultKind
from gearsim_sim.model.faults.wheels import error_mod, scale_of, stiffness_mod, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.flanks import Relief, relief_depth
from gearsim_sim.model.tooth.sharing import loaded_series
from gearsim_sim.model.tooth.windows import scaled, stretched
from gearsim_sim.params.fields import SiKeyed, Strict


class ProfileModificationParams(Strict):
    """`tip_m` and `root_m`: material taken off at the ends of the working flank; `length`: how far that
    reaches, over the length of double contact (1: long, 0.5: short relief); `power` 1: straight, 2:
    parabolic; `load_nm`: load torque at which pairs share the force (default: that of the start)."""

    tip_m: Annotated[float, SiKeyed("m", ge=0, le=1e-3)] = 10e-6
    root_m: Annotated[float, SiKeyed("m", ge=0, le=1e-3)] = 0.0
    length: Annotated[float, Si("", gt=0, le=1)] = 0.5
    power: Annotated[float, Si("", ge=1, le=4)] = 1.0
    load_nm: Annotated[float, SiKeyed("N*m", gt=0)] | None = None


def place(
    params: ProfileModificationParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """Stiffness and transmission error under the load, in each mesh of the wheel."""
    load = plant.limits.load_nm if params.load_nm is None else params.load_nm
    if load <= 0:
        raise InputError(
            component, "load_nm", load, "a load above zero under which the pairs share the force"
        )
    relief = Relief(params.tip_m, params.root_m, params.length, params.power)
    found: list[Contribution] = []
    for wheel in wheels_of(plant, component):
        stiffness, error = loaded_series(
            wheel.pair,
            lambda phase, wheel=wheel: -relief_depth(wheel.pair, relief, phase, of_wheel=wheel.of_wheel),
            load * wheel.force_per_load_n_per_nm,
            wheel.harmonics,
        )
        teeth, scale = wheel.gear.teeth, scale_of(plant, wheel)
        found.append(stiffness_mod(plant, wheel, stretched(scaled(stiffness, scale), teeth), MAX_SEVERITY))
        found.append(error_mod(wheel, stretched(error, teeth)))
    return tuple(found)


KIND = FaultKind(
    name="profile_modification",
    summary="tip and root relief of all teeth of a gear, under a given load",
    params_model=ProfileModificationParams,
    components=wheel_names,
    place=place,
    look_for="Only mesh lines change: lower near the load that the relief was made for, higher far from it.",
)
