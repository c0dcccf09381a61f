"""Shaft elements: torsion springs with dampers, and bending springs between lumped masses."""

from __future__ import annotations

from gearsim_sim.model.assembly import Assembly


def torsion_link(assembly: Assembly, first: str, second: str, stiffness: float, damping: float = 0.0) -> None:
    """Torque `stiffness` (a - b) + `damping` (a' - b') between two rotations [N m/rad, N m s/rad]."""
    twist = {first: 1.0, second: -1.0}
    assembly.spring(twist, stiffness)
    assembly.damper(twist, damping)


def bending_link(assembly: Assembly, first: str, second: str, stiffness: float) -> None:
    """Force `stiffness` (a - b) between two deflections in the same direction [N/m]."""
    assembly.spring({first: 1.0, second: -1.0}, stiffness)
