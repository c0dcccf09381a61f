"""Prepares a plant's carrying structure for the compiled loop; a plant on the ground has an empty one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.integrate.carrier_kernel import (
    Carrier,
    Oscillators,
    nothing_carried,
    oscillator_weights,
    pack_carrier,
    pack_carrier_state,
)
from gearsim_sim.integrate.coefficients import padded
from gearsim_sim.integrate.modes import ComplexModes
from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.carrier import turn_matrix
from gearsim_sim.model.plant import GRAVITY, Plant, RotatingSite, StateRow
from gearsim_sim.model.side_data import SideStructure, no_structure

Array = NDArray[np.float64]
# Motion of casing and machine against each other is extrapolated over a step: where it swings by more than
# some half a radian per step, that feeds itself. What else is coupled there makes it faster: less is allowed.
_MOST_RADIANS = 0.35


class Carrying:
    """The structure that carries the bearings of a plant.

    Parameters
    ----------
    plant : Plant
    step_s : float
    sites : sequence of Vector
        All rows of acceleration.
    rows : sequence of StateRow
        All state rows; those that begin in the structure are given by it.
    place : ndarray
        Place of each interface of the system in the loop's order.
    forces : bool
        Whether the forces on the structure follow the rows of acceleration.
    """

    def __init__(
        self,
        plant: Plant,
        step_s: float,
        sites: Sequence[Vector],
        rows: Sequence[StateRow],
        place: NDArray[np.int64],
        *,
        forces: bool,
    ) -> None:
        self._plant, self._step_s = plant, step_s
        self.state_rows = np.zeros(0, dtype=np.int64)  # indices of the state rows that it gives
        self.data: Carrier = nothing_carried()
        self.modes = self.interfaces = 0
        carrier = plant.carrier
        if carrier is None and forces:
            raise InputError("engine", "forces", True, "a machine in a flexible casing, such as cb146")
        self.side = no_structure()
        if carrier is None:
            return
        system = plant.system
        self._dofs = np.array([system.dof(name) for name in carrier.dofs], dtype=np.int64)
        self._own = np.array(carrier.interfaces, dtype=np.int64)
        matrix = np.array([system.direction(vector) for vector in sites])[:, self._dofs]
        felt = np.flatnonzero(np.any(matrix != 0, axis=1))
        self._of = Oscillators(
            omega=carrier.omega,
            damping_ratios=carrier.damping_ratios,
            shapes=carrier.shapes(system),
            sites=matrix[felt],
            known=system.inputs[self._dofs, GRAVITY] * plant.gravity_m_per_s2,
        )
        self._check_step()
        self.modes, self.interfaces = padded(carrier.omega.size), len(carrier.interfaces)
        mine = [i for i, row in enumerate(rows) if carrier.carries({**row.displacement, **row.rate})]
        self.state_rows = np.array(mine, dtype=np.int64)
        weights = oscillator_weights(carrier.omega, carrier.damping_ratios, step_s)
        self.side = SideStructure(carrier.dofs, self._of, felt.astype(np.int64), weights)
        self.data = Carrier(
            k=pack_carrier(self._of, step_s),
            places=place[self._own],
            bare=place[self._own[self._bare()]],
            turning=np.array([[one.first, one.track] for one in carrier.turning], dtype=np.int64).reshape(
                -1, 2
            ),
            numbers=np.array([carrier.stiffness_n_per_m, carrier.damping_ns_per_m]),
            site_index=felt.astype(np.int64),
            force_index=len(sites) + np.arange(len(self._own) if forces else 0),
            per_slope=1 / (12 * step_s),
            state_rows=self._flat_rows([rows[i] for i in mine]),
            state_weights=self._state_weights(),
            poles=self._flat(weights.rate),
            known=self._flat(self._of.known.astype(np.complex128))[: self.modes],
        )

    def _check_step(self) -> None:
        """InputError if steps are too long for how firmly the structure holds what it carries."""
        carrier, inner = self._plant.carrier, self._plant.internals.system
        assert carrier is not None
        held = inner.interfaces[:, self._own]
        give = self._of.shapes @ self._of.shapes.T + held.T @ (held / np.diag(inner.mass)[:, None])
        root = np.sqrt(carrier.stiffness_n_per_m)
        squares, ways = np.linalg.eigh(root[:, None] * give * root)
        frequency = math.sqrt(squares[-1])
        if frequency * self._step_s > _MOST_RADIANS:
            name = self._plant.system.interface_names[self._own[np.argmax(np.abs(ways[:, -1]))]]
            expected = f"at least {frequency / _MOST_RADIANS:.0f}, as firmly as the casing holds {name}"
            raise InputError("engine", "oversampling", f"{1 / self._step_s:.0f} steps per second", expected)

    def _bare(self) -> NDArray[np.bool_]:
        """Which of its interfaces have no element but the linear ones, (interfaces,)."""
        acted_on = [seat.x for seat in self._plant.bearings] + [seat.y for seat in self._plant.bearings]
        return ~np.isin(self._own, acted_on)

    def bare_springs(self) -> list[tuple[int, float]]:
        """Interfaces of the system with nothing but linear elements, and the stiffness of each."""
        carrier = self._plant.carrier
        if carrier is None:
            return []
        bare = self._bare()
        values = carrier.stiffness_n_per_m[bare]
        return list(zip(self._own[bare].tolist(), values.tolist(), strict=True))

    def _flat(self, values: NDArray[np.complex128]) -> Array:
        """Complex numbers of the modes as real parts, then imaginary parts, both padded."""
        result = np.zeros((2, self.modes))
        result[:, : values.size] = values.real, values.imag
        return result.ravel()

    def _flat_rows(self, rows: Sequence[StateRow]) -> Array:
        """Coefficients of coordinates, then of rates, both padded; (rows, 2 modes)."""
        direction = self._plant.system.direction
        result = np.zeros((len(rows), 2, self.modes))
        for own, row in zip(result, rows, strict=True):
            own[0, : self._dofs.size] = direction(row.displacement)[self._dofs]
            own[1, : self._dofs.size] = direction(row.rate)[self._dofs]
        return result.reshape(len(rows), 2 * self.modes)

    def _state_weights(self) -> Array:
        weights = oscillator_weights(self._of.omega, self._of.damping_ratios, self._step_s)
        parts = [self._flat(one).reshape(2, -1) for one in (weights.first, weights.before, weights.earlier)]
        return np.stack(parts, axis=1).ravel()

    def all_modes(self, of_internals: ComplexModes) -> ComplexModes:
        """The same with rigid modes over all degrees of freedom: the structure takes no part in them."""
        if self._plant.carrier is None:
            return of_internals
        still = np.zeros((self._dofs.size, of_internals.rigid_modes.shape[1]))
        return replace(of_internals, rigid_modes=np.vstack([of_internals.rigid_modes, still]))

    def _seen(self, values: Array, phases: Array, sense: float) -> Array:
        """Numbers of its interfaces, pairs turned: sense -1 into the axes of what it carries, 1 back."""
        carrier, result = self._plant.carrier, values.copy()
        assert carrier is not None
        for pair in carrier.turning:
            turn = turn_matrix(sense * 2 * math.pi * float(phases[pair.track]))
            result[pair.both] = turn @ values[pair.both]
        return result

    def rest_forces(self, x: Array, forces: Array, phases: Array) -> Array:
        """Forces of the interfaces on the machine, whose bearings stand on the ground in its matrices.

        Parameters
        ----------
        x : ndarray
            Static displacements of the whole system.
        forces : ndarray, shape (interfaces,)
            What elements do beyond their linear parts.
        phases : ndarray, shape (tracks,)
            Angles of all tracks [turns].
        """
        if self._plant.carrier is None:
            return forces
        result = forces.copy()
        seen = self._seen(self._of.shapes @ x[self._dofs], phases, -1.0)
        result[self._own] += self._plant.carrier.stiffness_n_per_m * seen
        return result

    def at_rest(self, x: Array, forces: Array, phases: Array) -> Array:
        """The state for the loop at static equilibrium; arguments as of `rest_forces`."""
        carrier = self._plant.carrier
        if carrier is None:
            return np.zeros(0)
        own = self._of.shapes @ x[self._dofs]
        carried = (self._plant.system.interfaces.T @ x)[self._own] + own
        seen = self._seen(own, phases, -1.0)
        push = carrier.stiffness_n_per_m * (carried - seen) - forces[self._own]
        push = self._seen(push, phases, 1.0)
        return pack_carrier_state(self._of, self._step_s, x[self._dofs], push, seen, carried)


def needed_sites(plant: Plant, looked_at: Sequence[str] | None = None) -> Mapping[str, Vector | RotatingSite]:
    """All sites of a plant, or in a flexible casing those that are looked at, if it has them all."""
    if plant.carrier is None or looked_at is None or not set(looked_at) <= set(plant.sites):
        return plant.sites
    wanted = looked_at or tuple(plant.sites)[:1]  # an engine puts out one at least
    return {name: site for name, site in plant.sites.items() if name in wanted}
