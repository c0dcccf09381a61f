"""How far two reduced casings differ, whatever the signs and order of their modes."""

from __future__ import annotations

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.reduced import ReducedCasing

# Rebuilt on another computer a casing differs by rounding alone.
SAME = 1e-6
_POINTS = 40


def difference(first: ReducedCasing, second: ReducedCasing) -> float:
    """Largest difference of responses at the sites to forces at the masters, over the largest response.

    Compared at `_POINTS` frequencies up to where the first is valid; infinite where masters, sites or numbers
    of modes differ.
    """
    names = [[site.name for site in casing.sites] for casing in (first, second)]
    if first.masters != second.masters or first.size != second.size or names[0] != names[1]:
        return float("inf")
    worst = 0.0
    for frequency in np.geomspace(first.valid_hz / 100, first.valid_hz, _POINTS):
        one, two = (site_receptance(casing, float(frequency)) for casing in (first, second))
        worst = max(worst, float(np.abs(one - two).max() / np.abs(one).max()))
    return worst


def site_receptance(casing: ReducedCasing, frequency_hz: float) -> Array:
    """Displacements over forces [m/N] and moments, corrected, shape (sites, 6 masters), complex.

    Sites are `casing.sites`; without any the masters themselves stand in their place.
    """
    speed = 2 * np.pi * frequency_hz
    count = 6 * len(casing.masters)
    dynamic = casing.stiffness + 1j * speed * casing.damping - speed**2 * casing.mass
    moved = np.linalg.solve(dynamic, np.eye(casing.size, count))
    if not casing.sites:
        return np.asarray(moved[:count])
    rows = np.array([site.rows for site in casing.sites])
    corrections = np.array([site.correction for site in casing.sites])
    return np.asarray(rows @ moved - speed**2 * corrections @ moved[:count])
