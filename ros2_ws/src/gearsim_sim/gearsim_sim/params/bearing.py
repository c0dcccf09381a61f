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
    """A ball or roller bearing, one or two rows."""

    element: Element = Element.BALL
    """Shape of the rolling elements."""
    rows: Rows = 1
    """Rows of elements; the nameplate counts those of one row."""
    row_stagger: Fraction = 0.5
    """How far the second row is behind the first, as a part of the spacing."""
    radial_clearance_m: Annotated[float, Si("m", ge=-1e-4, le=1e-3), Field(alias="radial_clearance")]
    """Gap on each side of a centred inner ring; negative: preload."""
    axial_preload_n: Annotated[float, Si("N", ge=0), Field(alias="axial_preload")] = 0.0
    """Axial force that presses a bearing with a contact angle together."""
    inner_groove_conformity: Annotated[float, Si("", gt=0.5, le=1)] | None = None
    """Groove radius of the inner race over the ball's diameter; balls need it."""
    outer_groove_conformity: Annotated[float, Si("", gt=0.5, le=1)] | None = None
    """The same of the outer race; without it that is a sphere, as in self-aligning bearings."""
    element_length_m: Annotated[Annotated[float, Si("m", gt=0)] | None, Field(alias="element_length")] = None
    """Effective length of a roller; rollers need it."""
    youngs_modulus_pa: Annotated[float, Si("Pa", gt=0), Field(alias="youngs_modulus")]
    """Young's modulus of elements and rings."""
    poisson_ratio: Annotated[float, Si("", ge=0, lt=0.5)]
    """Poisson's ratio of elements and rings."""
    nominal_stiffness_n_per_m: Annotated[float, Si("N/m", gt=0), Field(alias="nominal_stiffness")]
    """Linear stiffness that the integrator splits off; it does not change the result."""

    @model_validator(mode="after")
    def _contacts_are_known(self) -> Any:
        if self.element is Element.BALL and self.inner_groove_conformity is None:
            raise ValueError("balls need inner_groove_conformity")
        if self.element is Element.ROLLER and self.element_length_m is None:
            raise ValueError("rollers need element_length")
        return self
