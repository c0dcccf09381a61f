"""What changes of the structure share: the sites that they hang on.

A site whose direction stands in the frame of the model is one direction; one that turns against it (a
sensor on a ring, seen from the carrier) is taken as two, x and y, with the same springs in both.
"""

from __future__ import annotations

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.plant import Plant, RotatingSite

_RIGID = 1e-9


def site_directions(plant: Plant, name: str) -> tuple[Vector, ...]:
    """The direction of a site, or both of one that turns; none if the machine's rotation moves it."""
    site = plant.sites[name]
    found = (site.x, site.y) if isinstance(site, RotatingSite) else (site,)
    for direction in found:
        vector = plant.system.direction(direction)
        if abs(vector @ plant.rigid) > _RIGID * np.abs(vector).max():
            return ()
    return found


def hangable_sites(plant: Plant) -> tuple[str, ...]:
    """Sites that something can hang on: the rotation of the machine does not carry them along."""
    return tuple(name for name in plant.sites if site_directions(plant, name))


def joinable_sites(plant: Plant) -> tuple[str, ...]:
    """Those that have another one of their kind, so that something can lie between."""
    return tuple(name for name in hangable_sites(plant) if partners(plant, name))


def partners(plant: Plant, name: str) -> tuple[str, ...]:
    """Other sites with as many directions; first those of the same axis by their names."""
    count = len(site_directions(plant, name))
    others = [one for one in hangable_sites(plant) if one != name]
    alike = [one for one in others if len(site_directions(plant, one)) == count]
    return tuple(sorted(alike, key=lambda one: one[-1] != name[-1]))


def paired(plant: Plant, name: str, to: str) -> tuple[tuple[Vector, Vector], ...]:
    """Directions at both ends of a path; InputError if it cannot be."""
    known = partners(plant, name)
    if to not in known:
        raise InputError(name, "to", to, "another site: one of " + ", ".join(known))
    return tuple(zip(site_directions(plant, name), site_directions(plant, to), strict=True))
