"""A flexible structure that carries a machine's bearings, in its own modes: a casing on its mounts.

The system of a plant with a carrier holds both: the machine's own degrees of freedom and the modal
coordinates of the structure, joined by nothing but the elements of the bearings. `internals` cuts the machine
out and stands it on the ground, with the linear parts of its bearings; that and the oscillators of the
structure are what the compiled loop integrates, each exactly, and the bearings' forces join them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Elements, LinearSystem, Vector

Array = NDArray[np.float64]


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
    """

    dofs: tuple[str, ...]
    omega: Array
    damping_ratios: Array
    interfaces: tuple[int, ...]
    stiffness_n_per_m: Array
    damping_ns_per_m: Array

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
