"""A machine as the integrator sees it: linear matrices, the angles that turn, and the force elements.

Every model (parallel shafts, planetary stage, single-bearing rig) is a `Plant`; the compiled loop, statics,
energy and the readable right-hand side below know nothing else. The readable side is slow and plain; tests
hold the compiled loop against it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import LinearSystem, Vector
from gearsim_sim.model.bearing_seat import BearingSeat
from gearsim_sim.model.carrier import CarryingStructure, PairForce, PairPlaces, internals, pair_places, turned
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.gear_mesh import Mesh
from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.model.shafts import Mount, Shaft

Array = NDArray[np.float64]
# The known inputs that every plant has first, in this order.
MOTOR, LOAD, GRAVITY = 0, 1, 2
BASE_INPUTS = ("motor_torque", "load_torque", "gravity")


@dataclass(frozen=True)
class Track:
    """An angle that turns in proportion to the reference shaft.

    `rate` is in turns per turn of the reference shaft. Where the direction matters (bearings, rotating
    sensors) it is counted counter-clockwise in the plane of x and y.
    """

    name: str
    rate: float
    offset_turns: float = 0.0  # at the angle zero of the reference shaft


@dataclass(frozen=True)
class RotatingSite:
    """A sensor that turns against the frame of the model: x cos(a) + y sin(a), a = sense * angle + offset."""

    x: Vector
    y: Vector
    track: int
    sense: float
    offset_turns: float = 0.0


@dataclass(frozen=True)
class StateRow:
    """A linear combination of displacements and rates, such as a twist or the torque of a coupling."""

    displacement: Vector
    rate: Vector = field(default_factory=dict)


@dataclass(frozen=True)
class Limits:
    """Operating point at the start, and what the drive can do."""

    speed_hz: float
    load_nm: float
    speed_limit_hz: float
    load_limit_nm: float
    acceleration_torque_nm: float


@dataclass(frozen=True)
class Moment:
    """What the forces depend on beside the motion: angle and speed of the reference shaft, the faults."""

    turns: float
    speed_hz: float
    faults: tuple[tuple[Contribution, float], ...] = ()  # with their severities


@dataclass(frozen=True, eq=False)
class Plant:
    """System matrices, tracks and force elements of a machine.

    Attributes
    ----------
    name : str
        Of the machine, for errors.
    system : LinearSystem
        Its first inputs are `BASE_INPUTS`; further ones are columns for known forces.
    parts : tuple of tuple of str
        One or two groups of degrees of freedom that nothing but the interfaces' forces joins.
    tracks : tuple of Track
        The first belong to the shafts.
    rigid : ndarray, shape (n,)
        Motion of everything for one radian of the reference shaft.
    encoders : mapping
        Shaft name to (track, twist of its encoder against the rigid rotation).
    sites : mapping
        Places of accelerometers.
    signals : mapping
        Further outputs that are the state itself, such as torques.
    shafts, mounts
        What faults of shafts and structure act on; a mount by the name of its bearing.
    wheels : tuple of GearWheel
        Gear wheels whose teeth are known, each in each of its meshes.
    carrier : CarryingStructure, optional
        Flexible structure that the bearings stand in; `parts` are then those of the rest.
    """

    name: str
    system: LinearSystem
    parts: tuple[tuple[str, ...], ...]
    tracks: tuple[Track, ...]
    bearings: tuple[BearingSeat, ...]
    meshes: tuple[Mesh, ...]
    rigid: Array
    encoders: Mapping[str, tuple[int, Vector]]
    sites: Mapping[str, Vector | RotatingSite]
    limits: Limits
    gravity_m_per_s2: float
    signals: Mapping[str, StateRow] = field(default_factory=dict)
    shafts: tuple[Shaft, ...] = ()
    mounts: Mapping[str, Mount] = field(default_factory=dict)
    wheels: tuple[GearWheel, ...] = ()
    faults_on: bool = True
    carrier: CarryingStructure | None = None

    @cached_property
    def internals(self) -> Plant:
        """The machine without the structure that carries it: bearings stand on the ground."""
        if self.carrier is None:
            return self
        inside = ~np.isin(self.system.dof_names, self.carrier.dofs)
        return replace(
            self, system=internals(self.system, self.carrier), rigid=self.rigid[inside], carrier=None
        )

    def standing(self, turns: float) -> Plant:
        """The machine at an angle of the reference shaft, where it stands: nothing turns against a casing."""
        if self.carrier is None or not self.carrier.turning:
            return self
        system = turned(self.system, self.carrier, self.phases(turns))
        return replace(self, system=system, carrier=replace(self.carrier, turning=()))

    @cached_property
    def _pairs(self) -> tuple[PairPlaces, ...]:
        return () if self.carrier is None else pair_places(self.system, self.carrier)

    def turning_pairs(
        self, x: Array, v: Array, moment: Moment
    ) -> list[tuple[PairPlaces, PairForce, PairForce]]:
        """Places that turn against the casing: forces now, and as the system has them, at the angle zero."""
        phases = self.phases(moment.turns)
        rates = 2 * math.pi * moment.speed_hz * self.rates
        return [
            (
                pair,
                pair.force(x, v, 2 * math.pi * float(phases[pair.track]), float(rates[pair.track])),
                pair.force(x, v, 0.0, 0.0),
            )
            for pair in self._pairs
        ]

    def turning_force(self, x: Array, v: Array, moment: Moment) -> Array:
        """On all degrees of freedom: what the turning of places adds to the linear system, (n,)."""
        found = np.zeros(len(self.system.dof_names))
        for pair, now, still in self.turning_pairs(x, v, moment):
            found += pair.push(now) - pair.push(still)
        return found

    @cached_property
    def rates(self) -> Array:
        """Turns of each track per turn of the reference shaft."""
        return np.array([track.rate for track in self.tracks])

    @cached_property
    def inertia_kg_m2(self) -> float:
        """Of the rigid rotation, at the reference shaft."""
        return float(self.rigid @ self.system.mass @ self.rigid)

    @cached_property
    def torque_ratios(self) -> tuple[float, float]:
        """Torque of the motor and of the load on the rigid rotation, each per unit of its input."""
        motor, load = (self.rigid @ self.system.inputs)[[MOTOR, LOAD]]
        return float(motor), float(load)

    def track(self, name: str) -> int:
        """Index of a track; KeyError if there is none of that name."""
        for index, track in enumerate(self.tracks):
            if track.name == name:
                return index
        raise KeyError(name)

    def phases(self, turns: float) -> Array:
        """Turns of every track at an angle of the reference shaft; shape (tracks,)."""
        return np.array([track.offset_turns + track.rate * turns for track in self.tracks])

    def interface_forces(self, q: Array, rate: Array, moment: Moment) -> Array:
        """g of M x'' + C x' + K x = W g + U u: what the elements do beyond the linear part in C and K.

        Parameters
        ----------
        q, rate : ndarray, shape (interfaces,)
            W^T x [m] and W^T x' [m/s], without the rigid rotation.
        """
        g = np.zeros(q.size)
        phases = self.phases(moment.turns)
        for index, seat in enumerate(self.bearings):
            pair = [seat.x, seat.y]
            force = seat.force(q[pair], phases, self._of(moment, "bearing", index))
            g[pair] = seat.nominal_stiffness_n_per_m * q[pair] - force
        speeds = moment.speed_hz * self.rates
        for index, mesh in enumerate(self.meshes):
            i = mesh.interface
            linear = mesh.mean_stiffness_n_per_m * q[i] + mesh.damping_ns_per_m * rate[i]
            mods = self._of(moment, "mesh", index)
            g[i] = linear - mesh.force(q[i], rate[i], phases, speeds, mods)
        return g

    def _of(self, moment: Moment, element: str, index: int) -> tuple[tuple[Contribution, float], ...]:
        """Contributions of faults that belong to one element."""
        if not self.faults_on:
            return ()
        return tuple(pair for pair in moment.faults if getattr(pair[0], element, None) == index)

    def potential_energy(self, x: Array, moment: Moment) -> float:
        """Energy of all springs and contacts [J]; x without the rigid rotation."""
        q, phases = self.system.interfaces.T @ x, self.phases(moment.turns)
        energy = 0.5 * x @ self.system.stiffness @ x
        for index, seat in enumerate(self.bearings):
            pair = q[[seat.x, seat.y]]
            energy += seat.energy(pair, phases, self._of(moment, "bearing", index))
            energy -= 0.5 * seat.nominal_stiffness_n_per_m * float(pair @ pair)
        for index, mesh in enumerate(self.meshes):
            d = q[mesh.interface]
            energy += mesh.energy(d, phases, self._of(moment, "mesh", index))
            energy -= 0.5 * mesh.mean_stiffness_n_per_m * d**2
        for _, now, still in self.turning_pairs(x, np.zeros_like(x), moment):
            energy += now.energy_j - still.energy_j
        return float(energy)

    def static_interface(self, q: Array, moment: Moment) -> tuple[Array, Array]:
        """-g and its derivative with respect to q, for standing surfaces: shapes (interfaces,) and square."""
        tangent = np.zeros((q.size, q.size))
        phases = self.phases(moment.turns)
        for index, seat in enumerate(self.bearings):
            pair = [seat.x, seat.y]
            own = seat.stiffness(q[pair], phases, self._of(moment, "bearing", index))
            tangent[np.ix_(pair, pair)] = own - seat.nominal_stiffness_n_per_m * np.eye(2)
        for index, mesh in enumerate(self.meshes):
            stiffness = mesh.tangent(q[mesh.interface], phases, self._of(moment, "mesh", index))
            tangent[mesh.interface, mesh.interface] = stiffness - mesh.mean_stiffness_n_per_m
        still = Moment(moment.turns, 0.0, moment.faults)
        return -self.interface_forces(q, np.zeros_like(q), still), tangent

    def known_inputs(self, load_nm: float, acceleration_hz_per_s: float = 0.0) -> Array:
        """u: motor torque, load torque, gravity, and zero for further inputs.

        The motor balances the load and gives the whole rotating inertia the commanded acceleration.
        """
        motor_ratio, load_ratio = self.torque_ratios
        u = np.zeros(len(self.system.input_names))
        accelerating = self.inertia_kg_m2 * 2 * math.pi * acceleration_hz_per_s
        u[MOTOR] = (accelerating - load_ratio * load_nm) / motor_ratio
        u[LOAD] = load_nm
        u[GRAVITY] = self.gravity_m_per_s2
        return u

    def acceleration(self, x: Array, v: Array, moment: Moment, u: Array) -> Array:
        """x'' from the equation of motion; x and v without the rigid rotation or with it, it is the same."""
        system = self.system
        g = self.interface_forces(system.interfaces.T @ x, system.interfaces.T @ v, moment)
        force = system.interfaces @ g + system.inputs @ u - system.damping @ v - system.stiffness @ x
        force += self.turning_force(x, v, moment)
        return np.asarray(force / np.diag(system.mass))
