"""Builds system matrices from elements, degree of freedom by degree of freedom."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Vector = Mapping[str, float]
"""A direction in the space of the degrees of freedom: name -> coefficient."""


def combined(*parts: tuple[Vector, float]) -> Vector:
    """The sum of directions, each times its factor."""
    result: dict[str, float] = {}
    for vector, factor in parts:
        for name, value in vector.items():
            result[name] = result.get(name, 0.0) + factor * value
    return result


@dataclass(frozen=True, eq=False)
class Elements:
    """Linear springs or dampers one by one: each acts on the elongation `directions[:, i]` . x."""

    directions: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 0)))  # (n, elements)
    values: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))  # (elements,)

    def doubled_energy(self, motion: NDArray[np.float64]) -> NDArray[np.float64]:
        """Sum of value * elongation^2 for motions (n, times): twice the energy, or the power of dampers."""
        return np.asarray(self.values @ (self.directions.T @ motion) ** 2)


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """M x'' + C x' + K x = W g + U u, with symmetric matrices.

    `g` are the forces of the interfaces (one per column of W), which depend on the motion W^T x of
    the interfaces and on time; `u` are forces that are known beforehand.
    """

    dof_names: tuple[str, ...]
    mass: NDArray[np.float64]  # (n, n)
    damping: NDArray[np.float64]  # (n, n)
    stiffness: NDArray[np.float64]  # (n, n)
    interface_names: tuple[str, ...]
    interfaces: NDArray[np.float64]  # W, (n, interfaces)
    input_names: tuple[str, ...]
    inputs: NDArray[np.float64]  # U, (n, inputs)
    springs: Elements = field(default_factory=Elements)  # what K is made of; a `part` does not carry them
    dampers: Elements = field(default_factory=Elements)  # what C is made of

    def dof(self, name: str) -> int:
        """Index of a degree of freedom; ValueError if there is none of that name."""
        return self.dof_names.index(name)

    def part(self, dof_names: tuple[str, ...]) -> LinearSystem:
        """The subsystem of these degrees of freedom, with the interfaces that act on it.

        Raises
        ------
        ValueError
            If a spring, damper or interface joins it to the rest: then it has no life of its own.
        """
        inside = np.isin(self.dof_names, dof_names)
        for matrix in (self.mass, self.damping, self.stiffness):
            if np.any(matrix[np.ix_(inside, ~inside)]):
                raise ValueError(f"{dof_names} are coupled to other degrees of freedom")
        touched = np.any(self.interfaces[inside] != 0, axis=0)
        if np.any(self.interfaces[np.ix_(~inside, touched)]):
            raise ValueError(f"an interface joins {dof_names} to other degrees of freedom")
        return LinearSystem(
            dof_names=tuple(np.array(self.dof_names)[inside]),
            mass=self.mass[np.ix_(inside, inside)],
            damping=self.damping[np.ix_(inside, inside)],
            stiffness=self.stiffness[np.ix_(inside, inside)],
            interface_names=tuple(np.array(self.interface_names)[touched]),
            interfaces=self.interfaces[np.ix_(inside, touched)],
            input_names=self.input_names,
            inputs=self.inputs[inside],
        )

    def direction(self, vector: Vector) -> NDArray[np.float64]:
        """A direction given by names as an array of shape (n,)."""
        result = np.zeros(len(self.dof_names))
        for name, value in vector.items():
            result[self.dof(name)] += value
        return result


class Assembly:
    """Collects masses, springs, dampers, interfaces and inputs; `build` gives the matrices.

    A spring or damper acts on one scalar elongation, the product of a direction with x; it adds
    the rank-one matrix k v v^T. So every element is symmetric, and has as its reaction what it does.
    """

    def __init__(self) -> None:
        self._inertia: dict[str, float] = {}
        self._springs: list[tuple[Vector, float]] = []
        self._dampers: list[tuple[Vector, float]] = []
        self._interfaces: dict[str, Vector] = {}
        self._inputs: dict[str, Vector] = {}

    def inertia(self, dof: str, value: float) -> None:
        """Add mass [kg] or moment of inertia [kg m^2] to a degree of freedom."""
        self._inertia[dof] = self._inertia.get(dof, 0.0) + value

    def spring(self, vector: Vector, stiffness: float) -> None:
        """A linear spring on the elongation `vector` . x."""
        self._springs.append((vector, stiffness))

    def damper(self, vector: Vector, damping: float) -> None:
        """A linear damper on the rate of the elongation `vector` . x."""
        self._dampers.append((vector, damping))

    def interface(self, name: str, vector: Vector) -> None:
        """A direction along which a nonlinear or time-dependent force acts."""
        self._interfaces[name] = vector

    def known_input(self, name: str, vector: Vector) -> None:
        """A direction along which a force acts that is known beforehand."""
        self._inputs[name] = vector

    def build(self) -> LinearSystem:
        """The matrices, with the degrees of freedom in the order of their first `inertia`."""
        names = tuple(self._inertia)
        index = {name: i for i, name in enumerate(names)}

        def array(vector: Vector) -> NDArray[np.float64]:
            result = np.zeros(len(names))
            for name, value in vector.items():
                result[index[name]] += value
            return result

        def matrix(elements: list[tuple[Vector, float]]) -> NDArray[np.float64]:
            result = np.zeros((len(names), len(names)))
            for vector, value in elements:
                column = array(vector)
                result += value * np.outer(column, column)
            return result

        def elements(found: list[tuple[Vector, float]]) -> Elements:
            directions = np.array([array(vector) for vector, _ in found]).reshape(-1, len(names)).T
            return Elements(directions, np.array([value for _, value in found]))

        def columns(directions: Mapping[str, Vector]) -> NDArray[np.float64]:
            return np.array([array(vector) for vector in directions.values()]).reshape(-1, len(names)).T

        return LinearSystem(
            dof_names=names,
            mass=np.diag(list(self._inertia.values())),
            damping=matrix(self._dampers),
            stiffness=matrix(self._springs),
            interface_names=tuple(self._interfaces),
            interfaces=columns(self._interfaces),
            input_names=tuple(self._inputs),
            inputs=columns(self._inputs),
            springs=elements(self._springs),
            dampers=elements(self._dampers),
        )
