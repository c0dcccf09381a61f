"""Root crack of one gear tooth: less mesh stiffness while that tooth is in contact, once per turn."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import MAX_SEVERITY, FaultKind
from gearsim_sim.model.faults.wheels import check_tooth, scale_of, stiffness_mod, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.crack import Crack, crack_stiffness_loss, depth_to_middle_m
from gearsim_sim.model.tooth.windows import scaled
from gearsim_sim.params.fields import Count, Fraction, SiKeyed, Strict


class GearToothCrackParams(Strict):
    """Parameters of a root crack."""

    depth_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Length of the crack from the fillet inwards; by default to the tooth's middle line, as the slot of
    thesis 7.3.2."""
    angle_rad: Annotated[float, SiKeyed("rad", ge=math.radians(10), le=math.pi / 2)] = math.pi / 4
    """Between the crack and the middle line of the tooth (thesis: 45 deg)."""
    width_m: Annotated[float, SiKeyed("m", gt=0)] | None = None
    """Length along the face after which the crack has run out; by default it is as deep all along."""
    tooth: Count = 1
    """Which tooth, from 1; its contact is in the middle at (tooth - 1/2) / teeth turns."""
    opens: bool = True
    """The load pulls the crack open; if not, it presses it shut."""
    closing: Fraction = 0.3
    """Part of the loss of stiffness that is left where the load presses the crack shut; 1 for a slot."""


def place(
    params: GearToothCrackParams,
    component: str,
    plant: Plant,
    seed: int,  # noqa: ARG001
) -> tuple[Contribution, ...]:
    """The loss of stiffness in each mesh of the wheel."""
    mods = []
    for wheel in wheels_of(plant, component):
        depth = params.depth_m
        if depth is None:
            depth = depth_to_middle_m(wheel.gear, params.angle_rad)
        loss = crack_stiffness_loss(
            wheel.pair,
            Crack(depth, params.angle_rad, params.width_m, params.closing),
            of_wheel=wheel.of_wheel,
            tooth=check_tooth(wheel, params.tooth),
            opens=params.opens,
            harmonics=wheel.sharp_harmonics,
        )
        mods.append(stiffness_mod(plant, wheel, scaled(loss, scale_of(plant, wheel)), MAX_SEVERITY))
    return tuple(mods)


KIND = FaultKind(
    name="gear_tooth_crack",
    summary="root crack of one tooth: less mesh stiffness once per turn (potential-energy method)",
    params_model=GearToothCrackParams,
    components=wheel_names,
    place=place,
    look_for=(
        "Once per turn of the cracked gear a short ripple; sidebands of its shaft around the mesh lines; in "
        "the residual of the synchronous average one burst per turn, which grows with the load."
    ),
)
