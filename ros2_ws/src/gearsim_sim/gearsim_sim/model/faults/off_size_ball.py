"""A rolling element of another diameter than its fellows: felt once per turn of the cage."""

from __future__ import annotations

from typing import Annotated

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.faults.bearing_parts import ball_number, find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.ring import Ring
from gearsim_sim.params.fields import Count, SiKeyed, Strict


class OffSizeParams(Strict):
    """One element of another diameter."""

    difference_m: Annotated[float, SiKeyed("m", ge=-1e-4, le=1e-4)] = 3e-6
    """How much greater its diameter is; negative: smaller."""
    row: Count = 1
    """Row of elements, from 1."""
    ball: Count = 1
    """Element of the row, from 1."""


def place(params: OffSizeParams, component: str, plant: Plant, seed: int) -> tuple[SurfaceProfile]:  # noqa: ARG001
    """A profile that is the same all over the element."""
    index, seat = find_seat(plant, component)
    if params.difference_m == 0:
        raise InputError(component, "difference_m", 0.0, "a difference above or below zero")
    ball = ball_number(seat, int(params.row), int(params.ball))
    constant = np.array([-params.difference_m, 0.0] * 2)
    return (SurfaceProfile(index, ball, 1, Ring(seat.spin, 1.0), True, 0.0, 1.0, constant),)


KIND = FaultKind(
    name="off_size_ball",
    summary="one ball or roller greater or smaller than the others",
    params_model=OffSizeParams,
    components=bearing_names,
    place=place,
    look_for="a slow beat at the FTF, as the greater element carries more each time it passes the load zone",
)
