"""What changes of the structure share: the sites that they hang on."""

from __future__ import annotations

from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.plant import Plant, RotatingSite


def fixed_sites(plant: Plant) -> tuple[str, ...]:
    """Measuring sites that stand in the frame of the model."""
    return tuple(name for name, site in plant.sites.items() if not isinstance(site, RotatingSite))


def joinable_sites(plant: Plant) -> tuple[str, ...]:
    """Such sites, if there are two or more that something can lie between."""
    found = fixed_sites(plant)
    return found if len(found) > 1 else ()


def site_vector(plant: Plant, name: str) -> Vector:
    """The direction of such a site."""
    site = plant.sites[name]
    assert not isinstance(site, RotatingSite)
    return site
