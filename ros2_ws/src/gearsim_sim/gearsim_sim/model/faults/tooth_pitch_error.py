"""Teeth that stand a little early or late: one of them, or all at random."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults.kind import FaultKind
from gearsim_sim.model.faults.wheels import check_tooth, error_mod, normal_draws, wheel_names, wheels_of
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.sharing import tooth_error_series
from gearsim_sim.params.fields import Count, SiKeyed, Strict

_STREAM = 12


class ToothPitchErrorParams(Strict):
    """Parameters of teeth that stand early or late."""

    error_m: Annotated[float, SiKeyed("m", ge=-1e-3, le=1e-3)] = 10e-6
    """Error of one tooth along the line of action; positive presses the teeth together."""
    tooth: Count = 1
    """Which tooth, from 1."""
    rms_m: Annotated[float, SiKeyed("m", ge=0, le=1e-3)] = 0.0
    """Standard deviation of random errors of all teeth, drawn by the seed of the run."""


def place(params: ToothPitchErrorParams, component: str, plant: Plant, seed: int) -> tuple[Contribution, ...]:
    """Transmission error in each mesh of the wheel, handed over from tooth to tooth by their load shares."""
    mods = []
    errors = None
    for wheel in wheels_of(plant, component):
        if errors is None:
            errors = params.rms_m * normal_draws(seed, _STREAM, wheel)
            errors[check_tooth(wheel, params.tooth)] += params.error_m
        series = tooth_error_series(
            wheel.pair, np.ones_like, errors, teeth=wheel.gear.teeth, harmonics=wheel.sharp_harmonics
        )
        mods.append(error_mod(wheel, series))
    return tuple(mods)


KIND = FaultKind(
    name="tooth_pitch_error",
    summary="pitch error of a single tooth, random errors of all teeth, or both",
    params_model=ToothPitchErrorParams,
    components=wheel_names,
    place=place,
    look_for=(
        "One tooth: a jolt per turn and flat sidebands of the shaft. All teeth: lines at all multiples of "
        "the shaft's speed, which stay the same from turn to turn."
    ),
)
