"""Extended rough fault: random topography in a bucket-shaped zone of a race (thesis 4.2.3)."""

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
from gearsim_sim.model.oil_film import ContactGeometry
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.surface import rough_series, rough_zone
from gearsim_sim.params.fields import Count, Strict


class RoughnessParams(Strict):
    """A bucket in a race, with a rough bottom."""

    race: Race = Race.INNER
    """The race that has it."""
    length_m: Length = 12e-3
    """Length along the race, from rim to rim."""
    depth_m: Length = 5e-6
    """Mean depth of the bottom."""
    wall_m: Length = 2e-3
    """Length of the smooth entry, and of the exit."""
    roughness_m: Length = 1e-6
    """Rms of the topography, as the elements follow it."""
    cutoff_m: Length | None = None
    """Wavelength of which elements follow one half; by default what patch and radius of the contact allow."""
    position_rad: Angle | None = None
    """Azimuth of its middle at angle zero of the ring, from x towards y; by default where the load presses
    on a ring that stands, else 0."""
    row: Count | None = None
    """Row of elements, from 1; all rows by default."""


def place(params: RoughnessParams, component: str, plant: Plant, seed: int) -> tuple[SurfaceProfile]:
    """The zone; its topography depends on the seed, the bearing and the race."""
    index, seat = find_seat(plant, component)
    ring, radius = race_of(seat, params.race)
    first, balls = balls_of(seat, params.row)
    circumference = 2 * math.pi * radius
    _check(params, seat, circumference)
    cutoff = _cutoff_m(params, seat)
    surface = rough_series(
        seed, f"{component}/extended_roughness/{params.race}", circumference, params.roughness_m, cutoff
    )
    zone = rough_zone(surface, circumference, params.length_m, params.wall_m, params.depth_m, cutoff)
    position = position_of(seat, params.race, params.position_rad) / (2 * math.pi)
    span = params.length_m / circumference
    return (SurfaceProfile(index, first, balls, ring, False, position - 0.5 * span, span, zone),)


def shortest_wavelength_m(params: RoughnessParams, seat: BearingSeat) -> float:
    """Wavelengths that an element follows: longer than its contact patch, and not too curved for its radius.

    The patch averages over its length; one half of a wave of twice that length is left. A wave of rms s and
    length l has the rms curvature s (2 pi / l)^2; where that exceeds 1 / r the element bridges the valleys.
    """
    contact = _contact(params, seat)
    bridging = 2 * math.pi * math.sqrt(params.roughness_m * contact.rolling_m)
    return max(4 * contact.patch_half_length_m, bridging)


def _contact(params: RoughnessParams, seat: BearingSeat) -> ContactGeometry:
    return seat.law.contacts[0 if params.race is Race.INNER else 1]


def _cutoff_m(params: RoughnessParams, seat: BearingSeat) -> float:
    """Shortest wavelength, of which two must fit into the zone: else its bottom is not rough."""
    longest = 0.5 * params.length_m
    if params.cutoff_m is not None:
        if params.cutoff_m > longest:
            raise InputError(seat.name, "cutoff_m", params.cutoff_m, "at most half of length_m")
        return params.cutoff_m
    shortest = shortest_wavelength_m(params, seat)
    if shortest > longest:
        greatest = (longest / (2 * math.pi)) ** 2 / _contact(params, seat).rolling_m
        if params.roughness_m > greatest:
            expected = f"at most {greatest * 1e6:.3g} um in a zone of this length: elements bridge the rest"
            raise InputError(seat.name, "roughness_m", params.roughness_m, expected)
        expected = f"at least {2 * shortest * 1e3:.3g} mm, two of the shortest waves that elements follow"
        raise InputError(seat.name, "length_m", params.length_m, expected)
    return shortest


def _check(params: RoughnessParams, seat: BearingSeat, circumference: float) -> None:
    if params.length_m >= circumference:
        expected = f"less than the race is long, {circumference * 1e3:.3g} mm"
        raise InputError(seat.name, "length_m", params.length_m, expected)
    if params.wall_m > 0.5 * params.length_m:
        raise InputError(seat.name, "wall_m", params.wall_m, "at most half of length_m")


KIND = FaultKind(
    name="extended_roughness",
    summary="rough worn zone of a race with a smooth entry and exit (thesis 5.3.4 and 5.3.5)",
    params_model=RoughnessParams,
    components=bearing_names,
    place=place,
    look_for="no impulses: random vibration, more of it while the zone is under load; the spectral "
    "correlation shows it at the shaft's speed (inner race) or the BPFO (outer race)",
)
