"""Wear of all flanks of a gear: material lost where the flanks slide, least at the pitch point."""

from __future__ import annotations

from functools import partial
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.wheels import error_mod, normal_draws, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.flanks import wear_depth
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.sharing import tooth_error_series
from gearsim_sim.params.fields import Fraction, SiKeyed, Strict

_STREAM = 11


class GearWearParams(Strict):
    """Parameters of worn flanks."""

    depth_m: Annotated[float, SiKeyed("m", gt=0)] = 20e-6
    """Depth where the drive flanks have lost most, near root or tip."""
    scatter: Fraction = 0.1
    """Standard deviation from tooth to tooth, over the depth; drawn by the seed of the run."""


def place(params: GearWearParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:
    """Transmission error in each mesh of the wheel; the teeth have the same wear in all of them."""
    mods = []
    draws = None
    for wheel in wheels_of(plant, component):
        if draws is None:
            draws = normal_draws(seed, _STREAM, wheel)
        series = tooth_error_series(
            wheel.pair,
            partial(_missing, wheel.pair, wheel.of_wheel),
            params.depth_m * np.maximum(0.0, 1 + params.scatter * draws),
            teeth=wheel.gear.teeth,
            harmonics=wheel.sharp_harmonics,
        )
        mods.append(error_mod(wheel, series))
    return tuple(mods)


def _missing(pair: GearPair, of_wheel: bool, phase: NDArray[np.float64]) -> NDArray[np.float64]:
    return -wear_depth(pair, phase, of_wheel=of_wheel)


KIND = FaultKind(
    name="gear_wear",
    summary="uniform wear of a gear's flanks after Archard, zero at the pitch point",
    params_model=GearWearParams,
    components=wheel_names,
    place=place,
    look_for=(
        "Higher mesh lines, the second and third above all; with scatter between the teeth also low lines "
        "of the shaft."
    ),
)
