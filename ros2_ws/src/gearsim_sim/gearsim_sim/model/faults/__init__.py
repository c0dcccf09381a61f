"""The faults that can be injected: one file each, one line here."""

from __future__ import annotations

from gearsim_io.errors import InputError
from gearsim_sim.model.faults import (
    gear_backlash,
    gear_eccentricity,
    gear_misalignment,
    gear_tooth_crack,
    gear_tooth_spall,
    gear_wear,
    of_bearings,
    of_shafts,
    planet_position_error,
    planet_tooth_crack,
    planet_tooth_spall,
    profile_modification,
    tooth_pitch_error,
    unequal_load_sharing,
)
from gearsim_sim.model.faults.kind import Fault, FaultKind

_KINDS = (
    *of_bearings.KINDS,
    *of_shafts.KINDS,
    planet_tooth_crack.KIND,
    planet_tooth_spall.KIND,
    planet_position_error.KIND,
    unequal_load_sharing.KIND,
    gear_tooth_crack.KIND,
    gear_tooth_spall.KIND,
    gear_wear.KIND,
    gear_eccentricity.KIND,
    tooth_pitch_error.KIND,
    profile_modification.KIND,
    gear_backlash.KIND,
    gear_misalignment.KIND,
)
REGISTRY: dict[str, FaultKind] = {kind.name: kind for kind in _KINDS}

__all__ = ["REGISTRY", "Fault", "FaultKind", "fault_kind"]


def fault_kind(name: str) -> FaultKind:
    """The registered kind; InputError names the known ones."""
    if name not in REGISTRY:
        raise InputError("fault", "kind", name, "one of " + ", ".join(sorted(REGISTRY)))
    return REGISTRY[name]
