"""What the nameplate does not tell of a rolling bearing: contacts, clearance, preload.

Keys in YAML are the names without the unit's suffix; a value carries its unit and source there.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any

from pydantic import AfterValidator, Field, model_validator

from gearsim_io.quantities import Si
from gearsim_sim.params.fields import Count, Fraction, Strict


class Element(StrEnum):
    """Shape of the rolling elements."""

    BALL = "ball"
    ROLLER = "roller"


def _at_most_two(value: int) -> int:
    if value > 2:
        raise ValueError("1 or 2")
    return value


Rows = Annotated[Count, AfterValidator(_at_most_two)]


class RollingBearing(Strict):
    """A ball or roller bearing, one or two rows.

    `radial_clearance` is the gap on each side of a centred inner ring; negative values are a radial preload.
    `axial_preload` presses bearings with a contact angle together, in addition. Balls need the groove radius
    of the inner ring over the ball's diameter, and either that of the outer ring or none: then the outer
    race is a sphere (self-aligning bearings). Rollers need their effective length instead.
    """

    element: Element = Element.BALL
    rows: Rows = 1
    row_stagger: Fraction = 0.5
    radial_clearance_m: Annotated[float, Si("m", ge=-1e-4, le=1e-3), Field(alias="radial_clearance")]
    axial_preload_n: Annotated[float, Si("N", ge=0), Field(alias="axial_preload")] = 0.0
    inner_groove_conformity: Annotated[float, Si("", gt=0.5, le=1)] | None = None
    outer_groove_conformity: Annotated[float, Si("", gt=0.5, le=1)] | None = None
    element_length_m: Annotated[Annotated[float, Si("m", gt=0)] | None, Field(alias="element_length")] = None
    youngs_modulus_pa: Annotated[float, Si("Pa", gt=0), Field(alias="youngs_modulus")]
    poisson_ratio: Annotated[float, Si("", ge=0, lt=0.5)]
    nominal_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="nominal_stiffness")]

    @model_validator(mode="after")
    def _contacts_are_known(self) -> Any:
        if self.element is Element.BALL and self.inner_groove_conformity is None:
            raise ValueError("balls need inner_groove_conformity")
        if self.element is Element.ROLLER and self.element_length_m is None:
            raise ValueError("rollers need element_length")
        return self
