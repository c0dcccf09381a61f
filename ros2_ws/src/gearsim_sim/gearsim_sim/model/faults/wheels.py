"""What faults of gears share: components, parameters, checks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.contributions import ERROR, STIFFNESS, MeshMod
from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.tooth.stiffness import stiffness_series

# Part of its least stiffness that a mesh must keep at the highest severity.
_PER_TOOTH = 64  # angles at which what is left is looked at
_LEAST = 0.1


def wheel_names(plant: Plant) -> tuple[str, ...]:
    """Components of faults that sit on a gear wheel."""
    return tuple(dict.fromkeys(wheel.name for wheel in plant.wheels))


def geared_mesh_names(plant: Plant) -> tuple[str, ...]:
    """Components of faults that concern a mesh whose teeth are known."""
    known = {wheel.mesh for wheel in plant.wheels}
    return tuple(mesh.name for index, mesh in enumerate(plant.meshes) if index in known)


def wheels_of(plant: Plant, component: str) -> tuple[GearWheel, ...]:
    """The wheel in each of its meshes."""
    return tuple(wheel for wheel in plant.wheels if wheel.name == component)


def mesh_index(plant: Plant, component: str) -> int:
    """Index of a mesh by its name."""
    return next(index for index, mesh in enumerate(plant.meshes) if mesh.name == component)


def check_tooth(wheel: GearWheel, tooth: float) -> int:
    """Index from 0 of a tooth that is counted from 1."""
    if not 1 <= tooth <= wheel.gear.teeth:
        raise InputError(wheel.name, "tooth", tooth, f"1 to {wheel.gear.teeth}")
    return int(tooth) - 1


def scale_of(plant: Plant, wheel: GearWheel) -> float:
    """Mean stiffness of the model's mesh over that of its teeth by the potential-energy method.

    A change that the potential-energy method gives is applied as the same fraction of the mesh that the
    model has.
    """
    return plant.meshes[wheel.mesh].mean_stiffness_n_per_m / stiffness_series(wheel.pair, 1).mean


def stiffness_mod(plant: Plant, wheel: GearWheel, series: PeriodicSeries, max_severity: float) -> MeshMod:
    """A change of stiffness over the turn since tooth 0 was half a pitch before its contact.

    Raises
    ------
    InputError
        If less than a tenth of the least stiffness would be left anywhere at the highest severity.
    """
    teeth = wheel.gear.teeth
    own = stiffness_series(wheel.pair, wheel.harmonics).on_grid(_PER_TOOTH)
    sound = scale_of(plant, wheel) * np.tile(own, teeth)
    change = series.on_grid(_PER_TOOTH * teeth)
    left = sound + max_severity * change
    if np.min(left) < _LEAST * np.min(sound):
        lost = f"{100 * float(np.max(-change / sound)):.3g} % less"
        expected = f"less than {100 * (1 - _LEAST) / max_severity:.3g} % lost at severity 1"
        raise InputError(wheel.name, "stiffness", lost, expected)
    return MeshMod(wheel.mesh, STIFFNESS, wheel.track, wheel.placed(series))


def error_mod(wheel: GearWheel, series: PeriodicSeries) -> MeshMod:
    """A transmission error."""
    return MeshMod(wheel.mesh, ERROR, wheel.track, wheel.placed(series))


def normal_draws(seed: int, stream: int, wheel: GearWheel) -> NDArray[np.float64]:
    """A standard normal number for each tooth, a function of seed, use and wheel only."""
    sequence = np.random.SeedSequence([seed, stream, wheel.stream])
    return np.random.Generator(np.random.Philox(sequence)).standard_normal(wheel.gear.teeth)
