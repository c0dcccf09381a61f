"""Bearings that a model needs and no nameplate tells.

They stand in the `model` section, so that a diagnosis, which reads nameplates, never looks for their lines.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from gearsim_io.errors import InputError
from gearsim_io.machines import BearingModel, make_bearing
from gearsim_io.nameplate import Bearing, Machine
from gearsim_io.quantities import validate

__all__ = ["KEY", "with_assumed_bearings"]

KEY = "assumed_bearings"


def with_assumed_bearings(
    plate: Machine, section: Mapping[str, Any], where: str
) -> tuple[Machine, dict[str, Any]]:
    """The nameplate with the bearings that the section assumes, and the rest of the section.

    Parameters
    ----------
    plate : Machine
    section : mapping
        A `model` section; under `assumed_bearings` it may hold bearings as nameplates write them.
    where : str
        Named in errors.

    Raises
    ------
    InputError
        If the nameplate has bearings, a shaft is none of it, or a number lacks unit or source.
    """
    rest = {key: value for key, value in section.items() if key != KEY}
    if KEY not in section:
        return plate, rest
    if plate.bearings:
        found = ", ".join(bearing.name for bearing in plate.bearings)
        raise InputError(where, KEY, f"beside {found}", "the bearings in the nameplate alone, which has some")
    assumed = section[KEY]
    if not isinstance(assumed, Mapping) or not assumed:
        raise InputError(where, KEY, assumed, "bearings by their names, as nameplates have them")
    bearings = tuple(_bearing(plate, str(name), content, where) for name, content in assumed.items())
    return dataclasses.replace(plate, bearings=bearings), rest


def _bearing(plate: Machine, name: str, content: Any, where: str) -> Bearing:
    read = validate(BearingModel, content, f"{where}.{KEY}.{name}", require_source=True)
    shafts = [shaft.name for shaft in plate.shafts]
    if read.shaft not in shafts:
        raise InputError(where, f"{KEY}.{name}.shaft", read.shaft, "one of the shafts " + ", ".join(shafts))
    return make_bearing(name, read)
