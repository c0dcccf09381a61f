"""Where the energy goes: stored, dissipated and fed in, element by element, along a run of the loop.

    d/dt (kinetic + elastic) = -(dampers) + (motor, load, weight) + (what moves by prescription)

Kinetic energy is that of every mass. Elastic energy is that of every linear spring, every Hertz contact and
every pair of teeth. Dampers are taken one by one, each by its own
elongation, not through the matrix: a damper without its reaction would not balance. What moves by
prescription (balls and pits that pass, teeth that come and go, errors of the teeth, faults that grow) works
by the change of elastic energy at standing displacements, and through the dampers of the meshes; so does
the turning of a machine against its casing.

None of it comes from the compiled loop but the states: forces and energies are those of the readable
model. So the balance closes only if loop, matrices and readable elements mean the same machine.

The balance is that of the vibration. What the rigid rotation carries through from motor to load is left out:
it balances by construction, and being larger than all else by orders it would hide everything. The
*throughput*, against which the rest of the balance is held, is half the integral of the sum of all |power|:
of motor, load and weight on the vibration, of the dampers, and of the prescribed motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from gearsim_sim.model.plant import Moment
from gearsim_sim.verify.trajectory import Trajectory

Array = NDArray[np.float64]
# Part of a step over which energies are differenced: small enough for teeth that pass in ten steps
# ((0.01 / 10)^2 is 1e-6), large enough for the digits of an angle.
_DIFFERENCE_STEPS = 0.01
_ORDER = 5  # of the spline through the powers: its integral errs with the sixth power of the step


@dataclass(frozen=True, eq=False)
class Ledger:
    """Balance of a stretch; arrays are over its steps.

    Attributes
    ----------
    seconds : ndarray
        Times.
    stored_j : mapping
        Kinds of stored energy.
    fed_w, dissipated_w : mapping
        Kinds of power in, and out; vibration only, without the rigid rotation.
    """

    seconds: Array
    stored_j: Mapping[str, Array]
    fed_w: Mapping[str, Array]
    dissipated_w: Mapping[str, Array]

    def integral(self, power: Array) -> float:
        """Work [J] of a power over the stretch."""
        spline = make_interp_spline(self.seconds, power, k=_ORDER)
        return float(spline.integrate(self.seconds[0], self.seconds[-1]))

    @property
    def residual_j(self) -> float:
        """Stored + dissipated - fed in: what is unexplained."""
        stored = sum(float(energy[-1] - energy[0]) for energy in self.stored_j.values())
        dissipated = sum(self.integral(power) for power in self.dissipated_w.values())
        return stored + dissipated - sum(self.integral(power) for power in self.fed_w.values())

    @property
    def throughput_j(self) -> float:
        """Half of all energy that flows in or out, see above."""
        powers = (*self.fed_w.values(), *self.dissipated_w.values())
        return 0.5 * sum(self.integral(np.abs(power)) for power in powers)

    @property
    def relative_residual(self) -> float:
        """Of the throughput."""
        return abs(self.residual_j) / self.throughput_j


def ledger(trajectory: Trajectory, every: int = 1) -> Ledger:
    """The balance of a run.

    Parameters
    ----------
    trajectory : Trajectory
    every : int
        Take each so manieth step.
    """
    steps = list(range(0, trajectory.count + 1, every))
    x, v = trajectory.x[:, steps], trajectory.v[:, steps]
    system = trajectory.plant.system
    contacts, prescribed, teeth_loss, teeth_feed = _elements(trajectory, steps)
    u = np.array([trajectory.inputs(float(step)) for step in steps]).T
    powers = u * (system.inputs.T @ v)
    return Ledger(
        seconds=np.array(steps) * trajectory.step_s,
        stored_j={
            "kinetic": 0.5 * np.diag(system.mass) @ v**2,
            "springs": 0.5 * system.springs.doubled_energy(x),
            "contacts": contacts,
        },
        fed_w={
            **dict(zip(system.input_names, powers, strict=True)),
            "prescribed motion": prescribed,
            "prescribed motion through dampers": teeth_feed,
        },
        dissipated_w={"dampers": system.dampers.doubled_energy(v) + teeth_loss},
    )


def _elements(trajectory: Trajectory, steps: list[int]) -> tuple[Array, Array, Array, Array]:
    """What needs the readable elements at each step: energies and powers, (steps,) each."""
    rows = [_element_row(trajectory, step) for step in steps]
    energy, prescribed, loss, feed = np.array(rows).T
    return energy, prescribed, loss, feed


def _element_row(trajectory: Trajectory, step: int) -> tuple[float, float, float, float]:
    """Energy of contacts beyond the linear springs, power of prescribed motion, and two of dampers."""
    plant = trajectory.plant
    x, v = trajectory.x[:, step], trajectory.v[:, step]
    moment = trajectory.moment(float(step))
    linear = 0.5 * float(x @ plant.system.stiffness @ x)
    before, after = (trajectory.moment(step + d) for d in (-_DIFFERENCE_STEPS, _DIFFERENCE_STEPS))
    change = plant.potential_energy(x, after) - plant.potential_energy(x, before)
    prescribed = change / (2 * _DIFFERENCE_STEPS * trajectory.step_s)
    loss, feed = _mesh_dampers(trajectory, x, v, moment)
    for _, now, still in plant.turning_pairs(x, v, moment):
        loss, feed = loss + now.lost_w - still.lost_w, feed + now.fed_w
    return plant.potential_energy(x, moment) - linear, prescribed, loss, feed


def _mesh_dampers(trajectory: Trajectory, x: Array, v: Array, moment: Moment) -> tuple[float, float]:
    """Loss of the meshes' dampers beyond that of linear ones, and what errors feed in through them."""
    plant = trajectory.plant
    q, rate = plant.system.interfaces.T @ x, plant.system.interfaces.T @ v
    phases, speeds = plant.phases(moment.turns), moment.speed_hz * plant.rates
    loss = feed = 0.0
    for index, mesh in enumerate(plant.meshes):
        i = mesh.interface
        mods = tuple(pair for pair in moment.faults if getattr(pair[0], "mesh", None) == index)
        error_rate = mesh.error_rate(phases, speeds, mods)
        still = mesh.force(q[i], 0.0, phases, np.zeros_like(speeds), mods)
        damper = mesh.force(q[i], rate[i], phases, speeds, mods) - still
        loss += damper * (rate[i] + error_rate) - mesh.damping_ns_per_m * rate[i] ** 2
        feed += damper * error_rate
    return loss, feed
