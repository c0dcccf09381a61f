"""What the faults of shafts share: which shafts there are, and places along them."""

from __future__ import annotations

from gearsim_io.errors import InputError
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.shafts import Plane, Shaft


def shaft_names(plant: Plant) -> tuple[str, ...]:
    """Components of faults that sit on a shaft."""
    return tuple(shaft.name for shaft in plant.shafts)


def bending_shaft_names(plant: Plant) -> tuple[str, ...]:
    """Shafts whose bending the model knows."""
    return tuple(shaft.name for shaft in plant.shafts if shaft.bends)


def coupled_shaft_names(plant: Plant) -> tuple[str, ...]:
    """Shafts with a coupling."""
    return tuple(shaft.name for shaft in plant.shafts if shaft.coupling is not None)


def shaft_of(plant: Plant, name: str) -> Shaft:
    """The shaft of that name."""
    return next(shaft for shaft in plant.shafts if shaft.name == name)


def plane_of(shaft: Shaft, name: str | None) -> Plane:
    """A place along a shaft; without a name its wheel. InputError names the places."""
    if name is not None and name not in shaft.planes:
        raise InputError(shaft.name, "plane", name, "one of " + ", ".join(shaft.planes))
    return shaft.planes[name or shaft.wheel]
