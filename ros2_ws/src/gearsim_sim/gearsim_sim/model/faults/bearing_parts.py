"""What the faults of bearings share: places on races, parameters, checks."""

from __future__ import annotations

import math
from enum import StrEnum
from typing import Annotated

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.ring import Ring
from gearsim_sim.params.fields import SiKeyed

Angle = Annotated[float, SiKeyed("rad", ge=-2 * math.pi, le=2 * math.pi)]
Length = Annotated[float, SiKeyed("m", gt=0)]


class Race(StrEnum):
    """Which race a shape belongs to."""

    INNER = "inner"
    OUTER = "outer"


class Geometry(StrEnum):
    """How an element crosses a pit: it rolls over the edges, or the depth is missing at once."""

    ROUNDED = "rounded"
    RECTANGULAR = "rectangular"


def find_seat(plant: Plant, component: str) -> tuple[int, BearingSeat]:
    """Number and seat of a bearing by its name."""
    for index, seat in enumerate(plant.bearings):
        if seat.name == component:
            return index, seat
    raise InputError("fault", "component", component, "a bearing of this machine")


def race_of(seat: BearingSeat, race: Race) -> tuple[Ring, float]:
    """How a race turns, and its radius [m]."""
    if race is Race.INNER:
        return seat.inner, seat.law.inner_race_radius_m
    return seat.outer, seat.law.outer_race_radius_m


def position_of(seat: BearingSeat, race: Race, position_rad: float | None) -> float:
    """Azimuth of a place on a race at angle zero of its ring.

    By default where the load presses a standing race, and zero on one that turns.
    """
    if position_rad is not None:
        return position_rad
    ring, _ = race_of(seat, race)
    return seat.law.load_direction_rad if ring.sense == 0 else 0.0


def balls_of(seat: BearingSeat, row: float | None) -> tuple[int, int]:
    """First ball and number of balls of a row (counted from 1), or of all rows."""
    law = seat.law
    if row is None:
        return 0, law.ball_count
    if not 1 <= row <= law.rows:
        raise InputError(seat.name, "row", row, f"1 to {law.rows}")
    return (int(row) - 1) * law.balls_per_row, law.balls_per_row


def ball_number(seat: BearingSeat, row: float, ball: float) -> int:
    """Number of a ball among all of the bearing, from its row and its number there, counted from 1."""
    first, count = balls_of(seat, row)
    if not 1 <= ball <= count:
        raise InputError(seat.name, "ball", ball, f"1 to {count}")
    return first + int(ball) - 1
