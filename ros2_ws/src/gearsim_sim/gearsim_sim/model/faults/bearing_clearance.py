"""Clearance grown by wear: less of the ring carries, and balls knock at the rim of the load zone."""

from __future__ import annotations

from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.bearing_loads import bearing_loads
from gearsim_sim.model.faults.bearing_parts import Length, find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import Strict


class ClearanceParams(Strict):
    """Growth of the clearance."""

    growth_m: Length = 15e-6
    """How much the gap at each side grows."""


def place(params: ClearanceParams, component: str, plant: Plant, seed: int) -> tuple[BearingTerm]:  # noqa: ARG001
    """The growth, if under the nominal load more than one element at a time still carries."""
    index, seat = find_seat(plant, component)
    grown = seat.law.clearance_m + params.growth_m
    seat.law.check_load_zone(component, "growth_m", bearing_loads(plant)[index], grown)
    return (BearingTerm(index, Term.CLEARANCE, (params.growth_m,)),)


KIND = FaultKind(
    name="bearing_clearance",
    summary="radial clearance grown by wear",
    params_model=ClearanceParams,
    components=bearing_names,
    place=place,
    look_for="stronger varying compliance at the BPFO of both rows, modulated mesh lines, less stiffness "
    "across the load",
)
