"""Bearings that are not as the nameplate says: what is built in has other dimensions than what is written.

The nameplate itself stays as it is, for it is all that an owner and a diagnosis know.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.nameplate import Bearing, Machine
from gearsim_io.quantities import Si, validate
from gearsim_sim.params.fields import Count, Strict
from gearsim_sim.params.overrides import split_quantity

__all__ = ["PREFIX", "as_built"]

PREFIX = "nameplate."
_FORM = (
    "nameplate.bearings.<bearing>.<one of rolling_elements, element_diameter, pitch_diameter, contact_angle>"
)
_PARTS = 4


class BuiltBearing(Strict):
    """Dimensions in place of the nameplate's."""

    rolling_elements: Count | None = None
    """Elements of one row."""
    element_diameter_m: Annotated[Annotated[float, Si("m", gt=0)] | None, Field(alias="element_diameter")] = (
        None
    )
    """Of a ball or roller."""
    pitch_diameter_m: Annotated[Annotated[float, Si("m", gt=0)] | None, Field(alias="pitch_diameter")] = None
    """Of the circle on which the elements' centres move."""
    contact_angle_rad: Annotated[
        Annotated[float, Si("rad", ge=0, lt=math.pi / 2)] | None, Field(alias="contact_angle")
    ] = None
    """Between the line of contact and the radial direction."""


def as_built(plate: Machine, built: Mapping[str, Any], where: str) -> Machine:
    """The nameplate with other dimensions of its bearings.

    Parameters
    ----------
    plate : Machine
    built : mapping
        Such as `{"nameplate.bearings.bearing_3.element_diameter": "7.3 mm"}`.
    where : str
        Named in errors.

    Raises
    ------
    InputError
        A name that is none of a bearing's dimensions, or a number out of range.
    """
    found: dict[str, dict[str, Any]] = {}
    for name, value in built.items():
        path = name.split(".")
        if len(path) != _PARTS or path[1] != "bearings":
            raise InputError(where, f"parameters.{name}", value, _FORM)
        if path[2] not in {bearing.name for bearing in plate.bearings}:
            known = ", ".join(bearing.name for bearing in plate.bearings)
            raise InputError(where, f"parameters.{name}", path[2], f"one of {known or 'no bearings'}")
        found.setdefault(path[2], {})[path[3]] = _plain(value)
    changed = {
        name: validate(BuiltBearing, content, f"{where}: parameters.nameplate.bearings.{name}")
        for name, content in found.items()
    }
    bearings = tuple(_changed(bearing, changed.get(bearing.name)) for bearing in plate.bearings)
    return dataclasses.replace(plate, bearings=bearings)


def _plain(value: Any) -> Any:
    """A number alone where there is no unit, as counts have it."""
    try:
        number, unit = split_quantity(value)
    except ValueError:
        return value
    if unit in ("", "1"):
        return int(number) if number == round(number) else number
    return {"value": number, "unit": unit}


def _changed(bearing: Bearing, built: BuiltBearing | None) -> Bearing:
    if built is None:
        return bearing
    told = {name: value for name, value in built.model_dump().items() if value is not None}
    if "rolling_elements" in told:
        told["rolling_elements"] = int(told["rolling_elements"])
    return dataclasses.replace(bearing, **told)
