"""Faults of shafts, couplings and mounts, and changes of the structure."""

from __future__ import annotations

from gearsim_sim.model.faults import (
    looseness,
    resonance,
    shaft_bow,
    shaft_misalignment,
    transfer_path,
    unbalance,
)

KINDS = (
    unbalance.KIND,
    shaft_bow.KIND,
    shaft_misalignment.KIND,
    looseness.KIND,
    resonance.KIND,
    transfer_path.KIND,
)
