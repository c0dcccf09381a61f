"""What the localised spalls of both races share: parameters, and the check that a ball can cross the pit."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.spall import Spall
from gearsim_sim.params.fields import Count, SiKeyed, Strict


class SpallParams(Strict):
    """Parameters common to the spalls of both races.

    `depth_m` beyond what the ball can reach makes no difference. `row` counts from 1.
    """

    width_m: Annotated[float, SiKeyed("m", gt=0)] = 0.8e-3
    depth_m: Annotated[float, SiKeyed("m", gt=0)] = 0.3e-3
    position_rad: Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)] | None = None
    row: Count = 1


def place_spall(
    params: SpallParams, seat: BearingSeat, index: int, position_rad: float, *, inner: bool
) -> Spall:
    """A spall on a race of the bearing in `seat`, number `index` of its plant, if a ball can cross it.

    Raises
    ------
    InputError
        A pit that the localised model cannot have.
    """
    law = seat.law
    radius = law.inner_race_radius_m if inner else law.outer_race_radius_m
    limit = min(law.ball_spacing_rad * radius, 2 * law.ball_radius_m)
    if params.width_m >= limit:
        expected = f"less than {limit * 1e3:.3g} mm, so that one ball at a time is in the spall"
        raise InputError(seat.name, "width_m", params.width_m, expected)
    if not 1 <= params.row <= law.rows:
        raise InputError(seat.name, "row", params.row, f"1 to {law.rows}")
    return Spall(
        bearing=index,
        row=int(params.row) - 1,
        on_inner_race=inner,
        ring=seat.inner if inner else seat.outer,
        position_rad=position_rad,
        half_width_rad=params.width_m / (2 * radius),
        depth_m=params.depth_m,
        race_radius_m=radius,
        ball_radius_m=law.ball_radius_m,
    )
