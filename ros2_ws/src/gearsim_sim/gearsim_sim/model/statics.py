"""Static equilibrium under torque and weight: where a run starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.modes import ComplexModes
from gearsim_sim.model.plant import Moment, Plant

_ITERATIONS = 200
# Newton's method ends when its next step would lower the energy by less than this fraction: rounding.
_TOLERANCE = 1e-20
# A spring added to each bearing in the Newton matrix only, so that a ring without contact is held [N/m].
_GUARD = 1e4
# The same for teeth that do not touch: the least part of its mean that the stiffness of a mesh has there.
_MESH_GUARD = 1e-3
_CLEAR_GAIN = 0.5  # a full step that halves the unbalanced forces needs no line search
_LEAST_FACTOR = 1e-9  # below it the line search has found nothing but rounding


def static_equilibrium(
    plant: Plant, modes: ComplexModes, moment: Moment, u: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Displacements x (n,) without rigid part at which all forces balance, for standing balls and teeth.

    The energy of springs and contacts is convex, so Newton's method with a line search finds its minimum
    from any start.
    """
    system, size = plant.system, len(plant.system.dof_names)
    rigid = system.mass @ modes.rigid_modes
    projector = np.eye(size) - modes.rigid_modes @ rigid.T
    external = projector.T @ (system.inputs @ u)
    x = np.zeros(size)
    gradient, tangent = _gradient_and_tangent(plant, moment, x, external)
    for _ in range(_ITERATIONS):
        step = np.linalg.solve(tangent + rigid @ rigid.T * np.trace(tangent) / size, -gradient)
        energy = plant.potential_energy(x, moment)
        if -gradient @ step <= _TOLERANCE * (abs(external @ x) + energy):
            break
        before = np.linalg.norm(gradient)
        trial = _gradient_and_tangent(plant, moment, x + step, external)
        # Close to the end the energy's own rounding hides what a step gains; the forces still show it.
        if np.linalg.norm(trial[0]) < _CLEAR_GAIN * before:
            x, (gradient, tangent) = x + step, trial
            continue
        factor = _line_search(plant, moment, x, step, external, float(gradient @ step))
        if factor < _LEAST_FACTOR:
            break
        x = x + factor * step
        gradient, tangent = _gradient_and_tangent(plant, moment, x, external)
    return np.asarray(projector @ x)


def _gradient_and_tangent(
    plant: Plant, moment: Moment, x: NDArray[np.float64], external: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    system = plant.system
    force, tangent = plant.static_interface(system.interfaces.T @ x, moment)
    guarded = [index for seat in plant.bearings for index in (seat.x, seat.y)]
    tangent[guarded, guarded] += _GUARD
    for mesh in plant.meshes:
        least = (_MESH_GUARD - 1) * mesh.mean_stiffness_n_per_m  # the linear part has the mean
        tangent[mesh.interface, mesh.interface] = max(tangent[mesh.interface, mesh.interface], least)
    gradient = system.stiffness @ x + system.interfaces @ force - external
    return gradient, system.stiffness + system.interfaces @ tangent @ system.interfaces.T


def _line_search(
    plant: Plant,
    moment: Moment,
    x: NDArray[np.float64],
    step: NDArray[np.float64],
    external: NDArray[np.float64],
    descent: float,
) -> float:
    """A factor that lowers the energy enough (Armijo), halved until it does."""
    before = plant.potential_energy(x, moment) - external @ x
    factor = 1.0
    for _ in range(40):
        trial = x + factor * step
        after = plant.potential_energy(trial, moment) - external @ trial
        if after <= before + 1e-4 * factor * descent + 1e-15 * abs(before):
            return factor
        factor *= 0.5
    return factor
