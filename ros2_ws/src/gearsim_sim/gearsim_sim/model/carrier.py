"""A flexible structure that carries a machine's bearings, in its own modes: a casing on its mounts.

The system of a plant with a carrier holds both: the machine's own degrees of freedom and the modal
coordinates of the structure, joined by nothing but the elements of the bearings. `internals` cuts the machine
out and stands it on the ground, with the linear parts of its bearings; that and the oscillators of the
structure are what the compiled loop integrates, each exactly, and the bearings' forces join them.

Where the plane of a machine turns (a planetary stage is seen from its carrier), a bearing joins places whose
axes turn against each other: with u in the machine's axes, p in the structure's and R(a) a turn by a,

    force on the structure = R (k d + c d'),   d = u - R^T p,

the same in x and y. The system holds such a pair as it is at the angle zero; `turned` gives it at another
one, and `TurningPair.beyond` what the turning changes while it goes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Elements, LinearSystem, Vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TurningPair:
    """Neighbouring interfaces in x and y of a plane that turns against the structure.

    Attributes
    ----------
    first : int
        Place of x among the interfaces of the structure; y is the next.
    track : int
        Angle of the plane against the structure, anticlockwise.
    """

    first: int
    track: int

    @property
    def both(self) -> list[int]:
        """Places of x and y."""
        return [self.first, self.first + 1]


class PairForce(NamedTuple):
    """Forces along a pair at one moment, and what they store, lose and are fed by the turning."""

    inside: Array  # (2,) on what is carried, in its axes
    structure: Array  # (2,) on the structure, in its own
    energy_j: float
    lost_w: float
    fed_w: float  # through the damper


def turn_matrix(angle_rad: float) -> Array:
    """R: from the axes of a plane that is ahead by an angle to those that it is ahead of."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    return np.array([[c, -s], [s, c]])


def pair_force(
    stiffness: float,
    damping: float,
    inside: tuple[Array, Array],
    structure: tuple[Array, Array],
    angle_rad: float,
    rate_rad_s: float,
) -> PairForce:
    """Spring and damper between two places, given by displacement and rate each in their own axes."""
    turn = turn_matrix(angle_rad)
    swept = rate_rad_s * (turn_matrix(angle_rad + math.pi / 2).T @ structure[0])  # (d/dt R^T) p
    way = inside[0] - turn.T @ structure[0]
    rate = inside[1] - turn.T @ structure[1] - swept
    force = stiffness * way + damping * rate
    return PairForce(
        -force,
        turn @ force,
        0.5 * stiffness * float(way @ way),
        damping * float(rate @ rate),
        -damping * float(rate @ swept),
    )


@dataclass(frozen=True, eq=False)
class CarryingStructure:
    """What of a plant's system belongs to the structure.

    Attributes
    ----------
    dofs : tuple of str
        Its modal coordinates, of unit mass.
    omega, damping_ratios : ndarray, shape (modes,)
        Angular frequencies [rad/s], above zero, and damping over the critical one, below one; both without
        the bearings.
    interfaces : tuple of int
        Interfaces of the system at which it carries the rest.
    stiffness_n_per_m, damping_ns_per_m : ndarray, shape (interfaces,)
        Of the linear elements there.
    turning : tuple of TurningPair
        Those that turn against the structure.
    """

    dofs: tuple[str, ...]
    omega: Array
    damping_ratios: Array
    interfaces: tuple[int, ...]
    stiffness_n_per_m: Array
    damping_ns_per_m: Array
    turning: tuple[TurningPair, ...] = ()

    def shapes(self, system: LinearSystem) -> Array:
        """Motion of the structure at the interfaces per modal coordinate, (interfaces, modes)."""
        own = [system.dof(name) for name in self.dofs]
        return -system.interfaces[np.ix_(own, self.interfaces)].T

    def carries(self, vector: Vector) -> bool:
        """Whether a direction has a part in the structure."""
        return not self._names.isdisjoint(vector)

    @cached_property
    def _names(self) -> frozenset[str]:
        return frozenset(self.dofs)


@dataclass(frozen=True, eq=False)
class PairPlaces:
    """A turning pair in a system: rows of its motion, (2, n) each, and what stands between."""

    track: int
    inside: Array
    structure: Array
    stiffness: float
    damping: float

    def force(self, x: Array, v: Array, angle_rad: float, rate_rad_s: float) -> PairForce:
        """At displacements and rates of the whole system."""
        inside, structure = ((rows @ x, rows @ v) for rows in (self.inside, self.structure))
        return pair_force(self.stiffness, self.damping, inside, structure, angle_rad, rate_rad_s)

    def push(self, force: PairForce) -> Array:
        """On all degrees of freedom, (n,)."""
        return np.asarray(force.inside @ self.inside + force.structure @ self.structure)


def pair_places(system: LinearSystem, carrier: CarryingStructure) -> tuple[PairPlaces, ...]:
    """All turning pairs."""
    own = [system.dof(name) for name in carrier.dofs]
    rings = np.zeros((len(carrier.interfaces), len(system.dof_names)))
    rings[:, own] = carrier.shapes(system)
    motion = system.interfaces.T[list(carrier.interfaces)] + rings
    return tuple(
        PairPlaces(
            pair.track,
            motion[pair.both],
            rings[pair.both],
            float(carrier.stiffness_n_per_m[pair.first]),
            float(carrier.damping_ns_per_m[pair.first]),
        )
        for pair in carrier.turning
    )


def turned(system: LinearSystem, carrier: CarryingStructure, phases: Array) -> LinearSystem:
    """The system with its turning pairs at these angles of the tracks [turns], without single elements."""
    interfaces, stiffness, damping = system.interfaces.copy(), system.stiffness.copy(), system.damping.copy()
    for pair, place in zip(carrier.turning, pair_places(system, carrier), strict=True):
        columns = [carrier.interfaces[i] for i in pair.both]
        old = interfaces[:, columns]
        turn = turn_matrix(2 * math.pi * float(phases[pair.track]))
        new = place.inside.T - (turn.T @ place.structure).T
        for matrix, value in ((stiffness, place.stiffness), (damping, place.damping)):
            matrix += value * (new @ new.T - old @ old.T)
        interfaces[:, columns] = new
    return replace(
        system,
        interfaces=interfaces,
        stiffness=stiffness,
        damping=damping,
        springs=Elements(),
        dampers=Elements(),
    )


def internals(system: LinearSystem, carrier: CarryingStructure) -> LinearSystem:
    """The system without the structure's coordinates: bearings stand on the ground."""
    inside = ~np.isin(system.dof_names, carrier.dofs)
    block = np.ix_(inside, inside)
    names = tuple(name for name, own in zip(system.dof_names, inside, strict=True) if own)
    return replace(
        system,
        dof_names=names,
        mass=system.mass[block],
        damping=system.damping[block],
        stiffness=system.stiffness[block],
        interfaces=system.interfaces[inside],
        inputs=system.inputs[inside],
        springs=Elements(),
        dampers=Elements(),
    )


def without(vector: Vector, names: tuple[str, ...], *, keep: bool = False) -> Vector:
    """A direction without its parts along `names`, or those alone."""
    chosen = set(names)
    return {name: value for name, value in vector.items() if (name in chosen) == keep}
