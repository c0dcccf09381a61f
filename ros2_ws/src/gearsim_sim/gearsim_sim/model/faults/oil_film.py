"""Elastohydrodynamic oil film in series with the contacts: no fault, but what softens those of bearings."""

from __future__ import annotations

from typing import Annotated

from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.faults.bearing_parts import find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.oil_film import Oil, make_film
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.fields import SiKeyed, Strict


class OilFilmParams(Strict):
    """An oil at the temperature of the bearing."""

    viscosity_pa_s: Annotated[float, SiKeyed("Pa*s", gt=0, le=100)] = 0.1
    """Dynamic viscosity at the inlet of the contacts."""
    pressure_viscosity_1_per_pa: Annotated[float, SiKeyed("1/Pa", gt=0, le=1e-6)] = 2e-8
    """How steeply its logarithm rises with pressure; mineral oils have about 2e-8."""


def place(params: OilFilmParams, component: str, plant: Plant, seed: int) -> tuple[BearingTerm]:  # noqa: ARG001
    """The film's thickness under 1 N at 1 Hz of the reference shaft, and its squeeze constants."""
    index, seat = find_seat(plant, component)
    law = seat.law
    oil = Oil(params.viscosity_pa_s, params.pressure_viscosity_1_per_pa)
    film = make_film(law.contacts, law.exponent, oil, law.modulus_pa, law.contact_angle_rad)
    between_rings = abs(seat.inner.rate(plant.rates) - seat.outer.rate(plant.rates))
    thickness = film.unit_thickness_m * (law.entrainment_m() * between_rings) ** film.speed_power
    values = (thickness, film.speed_power, film.squeeze_ns, film.squeeze_root_ns)
    return (BearingTerm(index, Term.FILM, values),)


KIND = FaultKind(
    name="oil_film",
    summary="oil film of a given viscosity between elements and races",
    params_model=OilFilmParams,
    components=bearing_names,
    place=place,
    look_for="with another bearing fault: softer exits, less at high frequencies",
)
