"""Looseness: bolts of a pedestal or foot hold no more; stiff when pressed, soft when lifted (`LooseFoot`)."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.loose_foot import LooseFoot
from gearsim_sim.model.plant import Moment, Plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params.fields import SiKeyed, Strict

_STATIC_TURNS = 0.5


class LoosenessParams(Strict):
    """The joint opens where the lifting force on the base reaches `clamp_n`.

    Without `clamp_n` that is the static force of the nominal operating point: the joint just holds.
    """

    reduction: Annotated[float, SiKeyed("", ge=0, le=0.95)] = 0.6
    """Share of the base's stiffness that is missing while the foot lifts."""
    gap_m: Annotated[float, SiKeyed("m", gt=0, le=1e-2)] = 50e-6
    """Lift at which the bolt's head stops it."""
    clamp_n: Annotated[float, SiKeyed("N", ge=-1e6, le=1e6)] | None = None
    """Lifting force at which the joint opens; without it the static one at nominal load."""
    rounding_m: Annotated[float, SiKeyed("m", gt=0, le=1e-4)] = 0.1e-6
    """Half width of the rounded corners of the force: asperities of the joint."""


def components(plant: Plant) -> tuple[str, ...]:
    """Bearings that stand on a pedestal of their own, or mounts of a flexible casing."""
    return tuple(plant.mounts)


def place(params: LoosenessParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:  # noqa: ARG001
    """The loose foot of a bearing's pedestal, or of a casing."""
    mount = plant.mounts[component]
    if params.clamp_n is None:
        opens_at = _static_lift(plant, component)
    else:
        opens_at = params.clamp_n / mount.stiffness_n_per_m
    return (
        LooseFoot(
            direction=mount.lift,
            stiffness_n_per_m=mount.stiffness_n_per_m,
            damping_ns_per_m=mount.damping_ns_per_m,
            reduction=params.reduction,
            opens_at_m=opens_at,
            gap_m=params.gap_m,
            rounding_m=params.rounding_m,
        ),
    )


def _static_lift(plant: Plant, component: str) -> float:
    """Lift of the foot of the healthy machine, standing under its nominal load."""
    moment = Moment(_STATIC_TURNS, 0.0)
    u = plant.known_inputs(plant.limits.load_nm)
    standing = plant.standing(_STATIC_TURNS)
    rest = static_equilibrium(standing, complex_modes(standing.system), moment, u)
    return float(np.dot(plant.system.direction(plant.mounts[component].lift), rest))


KIND = FaultKind(
    name="looseness",
    summary="loose bolts of a pedestal or foot: soft when lifted, stiff when pressed: multiples of the speed",
    params_model=LoosenessParams,
    components=components,
    place=place,
    look_for="a waveform cut off on one side, and many multiples of the shaft's speed, halves among "
    "them; mostly at the loose pedestal and in the direction of lifting",
)
