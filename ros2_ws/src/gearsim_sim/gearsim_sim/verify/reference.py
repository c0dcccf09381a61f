"""The readable right-hand side, integrated by scipy's DOP853 with a relative tolerance of 1e-10."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from gearsim_sim.model.plant import RotatingSite
from gearsim_sim.verify.memory import remembering
from gearsim_sim.verify.side import Now, side_forces
from gearsim_sim.verify.trajectory import Trajectory

Array = NDArray[np.float64]
TOLERANCE = 1e-10
# Of a state's component that begins with zero: turns, metres, newtons, all of them far below what counts.
LEAST_SIZE = 1e-9
# No step may leap over a pit: the shortest takes some tenths of a millisecond.
LONGEST_STEP_S = 5e-5


class Readable:
    """x'' as a function of time [s] and state: displacements, rates, then what elements remember.

    Time counts from step 0 of a trajectory, whose operating point and faults it has.
    """

    def __init__(self, trajectory: Trajectory) -> None:
        self._of = trajectory
        self._size = trajectory.x.shape[0]
        faults = trajectory.moment(0.0).faults
        self._bearings = remembering(trajectory.plant, faults)
        self._sides = side_forces(trajectory.plant, faults)

    def start(self) -> Array:
        """The state at step 0."""
        x, v = self._of.x[:, 0], self._of.v[:, 0]
        memories = [one.start(self._of.films[one.index]) for one in self._bearings]
        return np.concatenate([x, v, *memories, *(one.start(x, v) for one in self._sides)])

    def derivative(self, seconds: float, state: Array) -> tuple[Array, Array]:
        """x'' of all degrees of freedom, and the derivative of what elements remember."""
        plant, step, n = self._of.plant, seconds / self._of.step_s, self._size
        system, moment = plant.system, self._of.moment(step)
        x, v = state[:n], state[n : 2 * n]
        q, rate = system.interfaces.T @ x, system.interfaces.T @ v
        g = plant.interface_forces(q, rate, moment)
        phases, memories, at = plant.phases(moment.turns), [np.zeros(0)], 2 * n
        for bearing in self._bearings:
            seat, own = bearing.seat, bearing.own(moment)
            pair, memory = [seat.x, seat.y], state[at : at + bearing.size]
            total, balls, unit = bearing.forces(q[pair], memory, moment, phases, own)
            g[pair] = seat.nominal_stiffness_n_per_m * q[pair] - total
            memories.append(bearing.rate(memory, total, balls, unit, moment, own))
            at += bearing.size
        force = system.interfaces @ g + system.inputs @ self._of.inputs(step)
        force += plant.turning_force(x, v, moment) - system.damping @ v - system.stiffness @ x
        now = Now(seconds, x, v, moment, self._of.acceleration_hz_per_s(step))
        for side in self._sides:
            push, change = side.act(now, state[at : at + side.size])
            force += push
            memories.append(change)
            at += side.size
        return force / np.diag(system.mass), np.concatenate(memories)

    def __call__(self, seconds: float, state: Array) -> Array:
        """The derivative of the state."""
        acceleration, memories = self.derivative(seconds, state)
        return np.concatenate([state[self._size : 2 * self._size], acceleration, memories])

    def site_accelerations(self, seconds: float, state: Array) -> Array:
        """At all sites of the plant, (sites,)."""
        plant, accel = self._of.plant, self.derivative(seconds, state)[0]
        phases = plant.phases(self._of.moment(seconds / self._of.step_s).turns)
        direction = plant.system.direction
        found = []
        for site in plant.sites.values():
            if isinstance(site, RotatingSite):
                angle = 2 * math.pi * (site.sense * phases[site.track] + site.offset_turns)
                x, y = direction(site.x) @ accel, direction(site.y) @ accel
                found.append(math.cos(angle) * x + math.sin(angle) * y)
            else:
                found.append(direction(site) @ accel)
        return np.array(found)


def reference(trajectory: Trajectory, steps: Array) -> Array:
    """Accelerations of all sites at ascending steps > 0, from the trajectory's state at step 0 on.

    The absolute tolerance of each component is the relative one of its rms value: at the zero crossings of
    a vibration the relative one alone would ask for the impossible.

    Returns
    -------
    ndarray, shape (sites, steps)
    """
    readable = Readable(trajectory)
    start = readable.start()
    motion = np.vstack([trajectory.x, trajectory.v])
    size = np.abs(start)
    size[: len(motion)] = np.sqrt(np.mean(motion**2, axis=1))
    times = steps * trajectory.step_s
    solution = solve_ivp(
        readable,
        (0.0, float(times[-1])),
        start,
        method="DOP853",
        rtol=TOLERANCE,
        atol=TOLERANCE * np.maximum(size, LEAST_SIZE),
        max_step=LONGEST_STEP_S,
        t_eval=times,
    )
    if not solution.success:
        raise ArithmeticError(solution.message)
    found = [readable.site_accelerations(t, y) for t, y in zip(times, solution.y.T, strict=True)]
    return np.array(found).T
