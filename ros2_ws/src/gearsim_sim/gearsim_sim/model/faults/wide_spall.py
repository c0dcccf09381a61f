"""Wide spall of a race: entry edge, floor and exit edge; several elements may be in it at once."""

from __future__ import annotations

import math

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_faults import SurfaceProfile
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.faults.bearing_parts import (
    Angle,
    Length,
    Race,
    balls_of,
    find_seat,
    position_of,
    race_of,
)
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.pit import race_edge, wide_pit_path
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.surface import zone_table
from gearsim_sim.params.fields import Count, Strict

_POINTS_PER_PATCH = 24  # of the path's table along half of a contact patch


class WideSpallParams(Strict):
    """A pit with a floor, of any length."""

    race: Race = Race.OUTER
    """The race that has it."""
    length_m: Length = 8e-3
    """Length along the race, from edge to edge."""
    depth_m: Length = 20e-6
    """Depth of the floor."""
    edge_radius_m: Length = 0.1e-3
    """How round the edges are worn."""
    position_rad: Angle | None = None
    """Azimuth of its middle at angle zero of the ring, from x towards y; by default where the load presses
    on a ring that stands, else 0."""
    row: Count = 1
    """Row of elements, from 1."""


def place(params: WideSpallParams, component: str, plant: Plant, seed: int) -> tuple[SurfaceProfile]:  # noqa: ARG001
    """The path of the elements over the race, over the zone that it takes."""
    index, seat = find_seat(plant, component)
    ring, radius = race_of(seat, params.race)
    first, balls = balls_of(seat, int(params.row))
    half_width = params.length_m / (2 * radius)
    patch = seat.law.contacts[0 if params.race is Race.INNER else 1].patch_half_length_m / radius
    inner = params.race is Race.INNER
    edge = race_edge(radius, seat.law.ball_radius_m, inner=inner, rounding_m=params.edge_radius_m)
    _check(params, seat, radius, edge.drop(min(half_width, edge.greatest_angle_rad)))
    points = math.ceil(2 * (half_width + patch) / patch * _POINTS_PER_PATCH)
    half_span, path = wide_pit_path(half_width, params.depth_m, edge, patch, points)
    position = position_of(seat, params.race, params.position_rad)
    return (
        SurfaceProfile(
            bearing=index,
            first_ball=first,
            balls=balls,
            ring=ring,
            on_ball=False,
            start_turns=(position - half_span) / (2 * math.pi),
            span_turns=half_span / math.pi,
            values=zone_table(path),
        ),
    )


def _check(params: WideSpallParams, seat: BearingSeat, radius: float, reach: float) -> None:
    room = 2 * math.pi * radius - 2 * seat.law.ball_radius_m
    if params.length_m >= room:
        expected = f"less than {room * 1e3:.3g} mm, so that some of the race is left"
        raise InputError(seat.name, "length_m", params.length_m, expected)
    if params.depth_m >= reach:
        expected = f"less than {reach * 1e6:.3g} um, so that the ball reaches the floor (else: a race spall)"
        raise InputError(seat.name, "depth_m", params.depth_m, expected)


KIND = FaultKind(
    name="wide_spall",
    summary="spall of a race with entry edge, floor and exit edge, wider than the ball spacing if need be",
    params_model=WideSpallParams,
    components=bearing_names,
    place=place,
    look_for="separate events at entry and exit, whose distance tells the length; BPFO or BPFI, and more "
    "low-frequency motion, since the ring comes down to the floor",
)
