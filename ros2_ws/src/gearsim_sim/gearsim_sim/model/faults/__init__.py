"""The faults that can be injected: one file each, one line here."""

from __future__ import annotations

from gearsim_io.errors import InputError
from gearsim_sim.model.faults import inner_race_spall, outer_race_spall
from gearsim_sim.model.faults.kind import Fault, FaultKind

REGISTRY: dict[str, FaultKind] = {kind.name: kind for kind in (outer_race_spall.KIND, inner_race_spall.KIND)}

__all__ = ["REGISTRY", "Fault", "FaultKind", "fault_kind"]


def fault_kind(name: str) -> FaultKind:
    """The registered kind; InputError names the known ones."""
    if name not in REGISTRY:
        raise InputError("fault", "kind", name, "one of " + ", ".join(sorted(REGISTRY)))
    return REGISTRY[name]
