"""A casing with a coarse mesh: a few thousand displacements, a second of work."""

from __future__ import annotations

from functools import cache

from gearsim_sim.model.casing.build import build_structure
from gearsim_sim.model.casing.checks import resized
from gearsim_sim.model.casing.params import CasingParams, load_casing
from gearsim_sim.model.casing.structure import MeshedStructure


@cache
def small_params() -> CasingParams:
    return resized(load_casing("unsw_casing"), 3.5)


@cache
def small_structure(*, free: bool) -> MeshedStructure:
    return build_structure(small_params(), free=free)
