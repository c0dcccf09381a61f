"""What the localised spalls share: parameters, and the check that one ball at a time can cross the pit."""

from __future__ import annotations

from gearsim_io.errors import InputError
from gearsim_sim.model.faults.bearing_parts import (
    Angle,
    Geometry,
    Length,
    Race,
    find_seat,
    position_of,
    race_of,
)
from gearsim_sim.model.pit import Edge, race_edge
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.spall import ON_RACE, Spall
from gearsim_sim.params.fields import Count, Strict


class SpallParams(Strict):
    """Parameters common to the spalls of both races."""

    width_m: Length = 0.8e-3
    """Width along the race."""
    depth_m: Length = 0.3e-3
    """Depth; more than the element can reach makes no difference."""
    position_rad: Angle | None = None
    """Azimuth of its middle at angle zero of the ring, from x towards y; by default where the load presses
    on a ring that stands, else 0."""
    row: Count = 1
    """Row of elements, from 1."""
    geometry: Geometry = Geometry.ROUNDED
    """Elements roll over the edges, or the whole depth is missing at once."""


def place_spall(params: SpallParams, component: str, plant: Plant, race: Race) -> Spall:
    """A spall on a race of a bearing, if a ball can cross it.

    Raises
    ------
    InputError
        A pit that the localised model cannot have.
    """
    index, seat = find_seat(plant, component)
    law = seat.law
    ring, radius = race_of(seat, race)
    limit = min(law.ball_spacing_rad * radius, 2 * law.ball_radius_m)
    if params.width_m >= limit:
        expected = f"less than {limit * 1e3:.3g} mm, so that one ball at a time is in it (else: wide_spall)"
        raise InputError(seat.name, "width_m", params.width_m, expected)
    if not 1 <= params.row <= law.rows:
        raise InputError(seat.name, "row", params.row, f"1 to {law.rows}")
    half_width = params.width_m / (2 * radius)
    edge = race_edge(radius, law.ball_radius_m, inner=race is Race.INNER)
    return Spall(
        bearing=index,
        row=int(params.row) - 1,
        ball=ON_RACE,
        ring=ring,
        position_rad=position_of(seat, race, params.position_rad),
        half_width_rad=half_width,
        depth_m=pit_depth(params.depth_m, half_width, edge),
        edge=edge,
        rectangular=params.geometry is Geometry.RECTANGULAR,
    )


def pit_depth(depth_m: float, half_width_rad: float, edge: Edge) -> float:
    """The depth that a ball reaches, at most that of the pit: rectangular pits have it all over."""
    return min(depth_m, edge.drop(half_width_rad))
