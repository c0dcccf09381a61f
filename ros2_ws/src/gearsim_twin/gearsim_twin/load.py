"""The load under which a record was taken, as far as the record tells it."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import TypeAdapter, ValidationError

from gearsim_io.nameplate import Machine
from gearsim_io.quantities import Si
from gearsim_io.record import Record

__all__ = ["loaded_shaft", "stated_force_n", "stated_load_nm"]

_SUFFIX = "_torque"
_TORQUE: TypeAdapter[float] = TypeAdapter(Annotated[float, Si("N*m", ge=0)])
_FORCE: TypeAdapter[float] = TypeAdapter(Annotated[float, Si("N", ge=0)])


def stated_load_nm(record: Record, machine: Machine) -> float | None:
    """Mean load torque at the loaded shaft: as measured by a torque transducer, else as the file states it.

    Returns
    -------
    float or None
        None where the record has no torque and its file states none, or a force instead.

    Notes
    -----
    A transducer on another shaft counts by the power that goes through both, without losses.
    """
    loaded = loaded_shaft(machine)
    ratios = {shaft.name: shaft.ratio for shaft in machine.shafts}
    if record.torques is not None:
        names = [name.removesuffix(_SUFFIX) for name in record.torques.channels]
        for name in sorted((one for one in names if one in ratios), key=lambda one: one != loaded):
            mean = float(np.mean(record.torques.data_nm[names.index(name)], dtype=np.float64))
            return abs(mean * ratios[name] / ratios[loaded])
    return _stated(record, _TORQUE)


def stated_force_n(record: Record) -> float | None:
    """Radial load that the record's file states, in newton; None where it states none, or a torque."""
    return _stated(record, _FORCE)


def loaded_shaft(machine: Machine) -> str:
    """The shaft at the end of the chain of gears, on which the load acts."""
    drives = {mesh.driving_shaft: mesh.driven_shaft for mesh in machine.gear_meshes}
    for stage in machine.planetary_stages:
        members = {"carrier": stage.carrier_shaft, "sun": stage.sun_shaft, "ring": stage.ring_shaft}
        driving = members.pop(stage.input_member)
        drives[driving] = next(driven for driven in members.values() if driven)
    name = next((one for one in drives if one not in drives.values()), machine.reference_shaft)
    for _ in drives:
        name = drives.get(name, name)
    return name


def _stated(record: Record, quantity: TypeAdapter[float]) -> float | None:
    text = record.notes.get("load")
    if text is None:
        return None
    try:
        return quantity.validate_python(text)
    except ValidationError:  # a quantity of another kind
        return None
