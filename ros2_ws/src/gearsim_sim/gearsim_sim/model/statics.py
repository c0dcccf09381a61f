"""Static equilibrium under torque and weight: where a run starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.modes import ComplexModes
from gearsim_sim.model.lpm34 import Gearbox, Moment

_ITERATIONS = 200
# Newton's method ends when its next step would lower the energy by less than this fraction: rounding.
_TOLERANCE = 1e-20
# A spring added to each bearing in the Newton matrix only, so that a ring without contact is held [N/m].
_GUARD = 1e4


def static_equilibrium(
    gearbox: Gearbox, modes: ComplexModes, moment: Moment, u: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Displacements x (n,) without rigid part at which all forces balance, for standing balls and teeth.

    The energy of springs and contacts is convex, so Newton's method with a line search finds its minimum
    from any start.
    """
    system, size = gearbox.system, len(gearbox.system.dof_names)
    rigid = system.mass @ modes.rigid_modes
    projector = np.eye(size) - modes.rigid_modes @ rigid.T
    external = projector.T @ (system.inputs @ u)
    x = np.zeros(size)
    for _ in range(_ITERATIONS):
        gradient, tangent = _gradient_and_tangent(gearbox, moment, x, external)
        step = np.linalg.solve(tangent + rigid @ rigid.T * np.trace(tangent) / size, -gradient)
        energy = potential_energy(gearbox, moment, x)
        if -gradient @ step <= _TOLERANCE * (abs(external @ x) + energy):
            break
        x = x + _line_search(gearbox, moment, x, step, external, float(gradient @ step)) * step
    return np.asarray(projector @ x)


def _interface_state(
    gearbox: Gearbox, moment: Moment, x: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    q = gearbox.system.interfaces.T @ x
    return q, q[-1] + gearbox.mesh.error(moment.turns, moment.turns * gearbox.speed_ratio)


def potential_energy(gearbox: Gearbox, moment: Moment, x: NDArray[np.float64]) -> float:
    """Energy of all springs and contacts [J]."""
    q, compression = _interface_state(gearbox, moment, x)
    nominal = gearbox.params.model.ball_bearing.nominal_stiffness_n_per_m
    energy = 0.5 * x @ gearbox.system.stiffness @ x
    energy -= 0.5 * nominal * np.sum(q[:-1] ** 2) + 0.5 * gearbox.mesh.mean_stiffness_n_per_m * q[-1] ** 2
    energy += gearbox.mesh.energy(compression, moment.turns)
    for i, bearing in enumerate(gearbox.bearings):
        pair, angle = q[2 * i : 2 * i + 2], gearbox.cage_angle_rad(i, moment.turns)
        energy += bearing.energy(pair, angle, gearbox.missing(i, moment))
    return float(energy)


def _gradient_and_tangent(
    gearbox: Gearbox, moment: Moment, x: NDArray[np.float64], external: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    system = gearbox.system
    q, compression = _interface_state(gearbox, moment, x)
    nominal = gearbox.params.model.ball_bearing.nominal_stiffness_n_per_m
    force = np.zeros(q.size)
    extra = np.zeros((q.size, q.size))
    for i, bearing in enumerate(gearbox.bearings):
        pair, angle = slice(2 * i, 2 * i + 2), gearbox.cage_angle_rad(i, moment.turns)
        missing = gearbox.missing(i, moment)
        force[pair] = bearing.force(q[pair], angle, missing) - nominal * q[pair]
        extra[pair, pair] = bearing.stiffness(q[pair], angle, missing) + (_GUARD - nominal) * np.eye(2)
    stiffness = float(gearbox.mesh.stiffness.value(moment.turns * gearbox.mesh.pinion_teeth))
    force[-1] = stiffness * compression - gearbox.mesh.mean_stiffness_n_per_m * q[-1]
    extra[-1, -1] = stiffness - gearbox.mesh.mean_stiffness_n_per_m
    gradient = system.stiffness @ x + system.interfaces @ force - external
    return gradient, system.stiffness + system.interfaces @ extra @ system.interfaces.T


def _line_search(
    gearbox: Gearbox,
    moment: Moment,
    x: NDArray[np.float64],
    step: NDArray[np.float64],
    external: NDArray[np.float64],
    descent: float,
) -> float:
    """A factor that lowers the energy enough (Armijo), halved until it does."""
    before = potential_energy(gearbox, moment, x) - external @ x
    factor = 1.0
    for _ in range(40):
        trial = x + factor * step
        after = potential_energy(gearbox, moment, trial) - external @ trial
        if after <= before + 1e-4 * factor * descent + 1e-15 * abs(before):
            return factor
        factor *= 0.5
    return factor
