"""What the faults of planets share: the planetary plant and the names of its planets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.contributions import ERROR, MeshMod
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.planet_plant import PlanetaryPlant
from gearsim_sim.model.plant import Plant

Array = NDArray[np.float64]


def planet_names(plant: Plant) -> tuple[str, ...]:
    """Components of faults of planets: planet_1 and so on, none on other machines."""
    return plant.planet_names if isinstance(plant, PlanetaryPlant) else ()


def planetary(plant: Plant) -> PlanetaryPlant:
    """The plant as one with planets; `planet_names` has let none other through."""
    assert isinstance(plant, PlanetaryPlant)
    return plant


def planet_index(plant: PlanetaryPlant, component: str) -> int:
    """Number of a planet from 0."""
    return plant.planet_names.index(component)


def checked_tooth(plant: PlanetaryPlant, tooth: int) -> int:
    """A tooth counted from 1 as index from 0; InputError if the planet has not so many."""
    teeth = plant.params.stage.planet_teeth
    if tooth > teeth:
        raise InputError("planet", "tooth", tooth, f"1 to {teeth}")
    return int(tooth) - 1


def constant(value: float) -> PeriodicSeries:
    """A series that is its mean."""
    return PeriodicSeries(value, np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))


def both_meshes(plant: PlanetaryPlant, planet: int) -> tuple[int, int]:
    """Indices of a planet's meshes with sun and ring in the plant."""
    return planet, plant.params.planets + planet


def shift_mods(plant: PlanetaryPlant, planet: int, sun_m: float, ring_m: float) -> tuple[MeshMod, ...]:
    """Constant compressions of both meshes of a planet [m]."""
    track = plant.track("planet")
    pairs = zip(both_meshes(plant, planet), (sun_m, ring_m), strict=True)
    return tuple(MeshMod(mesh, ERROR, track, constant(value)) for mesh, value in pairs)


def mesh_loads(plant: PlanetaryPlant, planet: int, sun_m: float, ring_m: float) -> tuple[Array, Array]:
    """Static forces of all meshes under the nominal load, and what these compressions add [N].

    With the mean stiffness of the teeth and linear planet bearings; shapes (2 planets,).
    """
    system, count = plant.system, 2 * plant.params.planets
    teeth = system.interfaces[:, :count]
    stiffness = np.array([mesh.mean_stiffness_n_per_m for mesh in plant.meshes[:count]])
    errors = np.zeros(count)
    errors[list(both_meshes(plant, planet))] = sun_m, ring_m
    u = plant.known_inputs(plant.limits.load_nm)
    right = np.stack([system.inputs @ u, -teeth @ (stiffness * errors)], axis=1)
    x = np.linalg.lstsq(system.stiffness, right, rcond=None)[0]
    nominal, change = (stiffness[:, None] * (teeth.T @ x)).T
    return nominal, change + stiffness * errors
