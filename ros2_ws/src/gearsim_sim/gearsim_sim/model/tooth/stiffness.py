"""Stiffness of a pair of teeth, and of the whole mesh, over the mesh cycle.

A pair is a chain of springs: two teeth, two foundations, the contact. Pairs share the load as springs side
by side. The phase of a pair counts base pitches from the middle of its path of contact; the phase of the
mesh is 0 in the middle of the contact of two pairs and 1/2 in the middle of the path of a pair.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.compliance import foundation_compliance, hertz_compliance, tooth_compliance
from gearsim_sim.model.tooth.pair import GearPair
from gearsim_sim.model.tooth.windows import window_nodes, window_series

Array = NDArray[np.float64]
# Smith (1983), after thesis 7.5.1: stiffness of one pair of standard steel teeth per metre of face width.
SMITH_PAIR_STIFFNESS_PA = 1.4e10


def pair_compliance(pair: GearPair, phase: Array | float) -> Array:
    """Compliance of one pair of sound teeth [m/N] at these phases, whether in contact or not."""
    position = pair.position_m(np.atleast_1d(np.asarray(phase)))
    total = np.full(position.shape, hertz_compliance(pair.pinion, pair.wheel))
    for of_wheel in (False, True):
        gear, roll = pair.gear(of_wheel=of_wheel), pair.roll_rad(position, of_wheel=of_wheel)
        total = total + tooth_compliance(gear, roll) + foundation_compliance(gear, roll)
    return total


def pair_stiffness(pair: GearPair, phase: Array) -> Array:
    """Stiffness of one pair [N/m]; 0 where it is out of contact."""
    at = np.atleast_1d(np.asarray(phase, dtype=np.float64))
    limit = pair.contact_ratio / 2
    inside = np.abs(at) <= limit
    return np.asarray(np.where(inside, 1 / pair_compliance(pair, np.clip(at, -limit, limit)), 0.0))


def neighbours(pair: GearPair) -> NDArray[np.int64]:
    """How many pitches away pairs can be that touch at the same time: -n .. n."""
    reach = math.floor(pair.contact_ratio)
    return np.arange(-reach, reach + 1)


def mesh_stiffness(pair: GearPair, mesh_phase: Array) -> Array:
    """Stiffness of all pairs in contact [N/m] at these phases of the mesh."""
    start = np.mod(np.atleast_1d(mesh_phase), 1.0) - 0.5
    return np.asarray(sum(pair_stiffness(pair, start + step) for step in neighbours(pair)))


def stiffness_series(pair: GearPair, harmonics: int) -> PeriodicSeries:
    """Mesh stiffness over the phase of the mesh, as a series of `harmonics` mesh orders.

    Lanczos factors let it end without overshoot. The mean is exact: the mean stiffness of a pair over its
    path, times the contact ratio.
    """
    nodes = window_nodes(pair.contact_ratio, harmonics)
    return window_series(nodes, pair_stiffness(pair, nodes.phase), 1, 0, harmonics)


def stepped_levels(pair: GearPair, pair_stiffness_n_per_m: float) -> tuple[Array, Array]:
    """The thesis's rectangular stiffness: every pair in contact has the same constant stiffness.

    Returns
    -------
    edges, levels : array
        The stiffness is levels[i] from phase edges[i] to the next edge, and from the last edge round to
        the first; edges ascend in [0, 1).
    """
    half = (pair.contact_ratio - math.floor(pair.contact_ratio)) / 2
    few = math.floor(pair.contact_ratio) * pair_stiffness_n_per_m
    if half == 0:
        return np.array([0.0]), np.array([few])
    return np.array([half, 1 - half]), np.array([few, few + pair_stiffness_n_per_m])


def smith_pair_stiffness(pair: GearPair) -> float:
    """Stiffness of one pair after Smith, 1.4e10 N/m per metre of face width (thesis 7.5.1) [N/m]."""
    return SMITH_PAIR_STIFFNESS_PA * min(pair.pinion.face_width_m, pair.wheel.face_width_m)
