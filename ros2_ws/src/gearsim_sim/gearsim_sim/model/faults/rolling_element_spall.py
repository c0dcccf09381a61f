"""Spall of a rolling element: meets both races in each turn of the element, wherever that is."""

from __future__ import annotations

import math

from gearsim_io.errors import InputError
from gearsim_sim.model.faults.bearing_parts import Angle, Geometry, Length, ball_number, find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.faults.spall import pit_depth
from gearsim_sim.model.pit import element_edge
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.ring import Ring
from gearsim_sim.model.spall import Spall
from gearsim_sim.params.fields import Count, Strict


class ElementSpallParams(Strict):
    """A pit of one element."""

    width_m: Length = 0.8e-3
    """Width along the surface of the element."""
    depth_m: Length = 0.3e-3
    """Depth; more than the races can reach makes no difference."""
    position_rad: Angle = 0.0
    """Angle on the element: at zero the pit touches the outer race at the start."""
    row: Count = 1
    """Row of elements, from 1."""
    ball: Count = 1
    """Element of the row, from 1."""
    geometry: Geometry = Geometry.ROUNDED
    """The race rolls over the edges, or the whole depth is missing at once."""


def place(params: ElementSpallParams, component: str, plant: Plant, seed: int) -> tuple[Spall, Spall]:  # noqa: ARG001
    """The pit as the outer race meets it, and as the inner race does, half a turn of the element later."""
    index, seat = find_seat(plant, component)
    law = seat.law
    ball = ball_number(seat, int(params.row), int(params.ball))
    if params.width_m >= law.ball_radius_m:
        expected = f"less than the element's radius, {law.ball_radius_m * 1e3:.3g} mm"
        raise InputError(seat.name, "width_m", params.width_m, expected)
    half_width = params.width_m / (2 * law.ball_radius_m)

    def pit(radius: float, position: float, *, inner: bool) -> Spall:
        edge = element_edge(radius, law.ball_radius_m, inner=inner)
        return Spall(
            bearing=index,
            row=int(params.row) - 1,
            ball=ball,
            ring=Ring(seat.spin, 1.0),
            position_rad=position,
            half_width_rad=half_width,
            depth_m=pit_depth(params.depth_m, half_width, edge),
            edge=edge,
            rectangular=params.geometry is Geometry.RECTANGULAR,
        )

    return (
        pit(law.outer_race_radius_m, params.position_rad, inner=False),
        pit(law.inner_race_radius_m, params.position_rad + math.pi, inner=True),
    )


KIND = FaultKind(
    name="rolling_element_spall",
    summary="pit in one ball or roller: strikes both races at twice the BSF, modulated by the cage",
    params_model=ElementSpallParams,
    components=bearing_names,
    place=place,
    look_for="events at twice the BSF (once at each race) while the element is in the load zone: "
    "harmonics of 2 BSF with sidebands at the FTF",
)
