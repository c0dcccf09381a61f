"""Preload: rings pressed together, radially by a tight fit or axially through a contact angle."""

from __future__ import annotations

import math
from typing import Annotated

from gearsim_io.errors import InputError
from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.faults.bearing_parts import find_seat
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rolling_bearing import preload_compression_m
from gearsim_sim.params.fields import SiKeyed, Strict


class PreloadParams(Strict):
    """How a bearing is pressed together."""

    tightening_m: Annotated[float, SiKeyed("m", ge=0, le=1e-4)] = 10e-6
    """Loss of radial clearance at each side."""
    axial_n: Annotated[float, SiKeyed("N", ge=0)] = 0.0
    """Axial force, on bearings with a contact angle."""


def place(params: PreloadParams, component: str, plant: Plant, seed: int) -> tuple[BearingTerm]:  # noqa: ARG001
    """A negative clearance, see `rolling_bearing`."""
    index, seat = find_seat(plant, component)
    law, tightening = seat.law, params.tightening_m
    if params.axial_n > 0:
        if law.contact_angle_rad == 0:
            raise InputError(component, "axial_n", params.axial_n, "0, as the bearing has no contact angle")
        factor = law.load_factor / math.cos(law.contact_angle_rad) ** (law.exponent + 1)
        tightening += preload_compression_m(
            params.axial_n, law.ball_count, factor, law.exponent, law.contact_angle_rad
        )
    if tightening == 0:
        raise InputError(component, "tightening_m", 0.0, "more than 0, or axial_n > 0")
    return (BearingTerm(index, Term.CLEARANCE, (-tightening,)),)


KIND = FaultKind(
    name="bearing_preload",
    summary="bearing mounted too tightly or pressed together axially",
    params_model=PreloadParams,
    components=bearing_names,
    place=place,
    look_for="the bearing's resonances move up and varying compliance gets weaker",
)
