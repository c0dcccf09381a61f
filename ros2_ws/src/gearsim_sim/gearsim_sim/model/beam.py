"""Straight round shafts as finite elements: Timoshenko beams in bending, rods in torsion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RoundBar:
    """Cross-section and material of a solid round shaft."""

    diameter_m: float
    youngs_modulus_pa: float
    poissons_ratio: float
    density_kg_per_m3: float

    @property
    def area_m2(self) -> float:
        """Of the cross-section."""
        return math.pi * self.diameter_m**2 / 4

    @property
    def second_moment_m4(self) -> float:
        """About a diameter; that about the axis is twice as large."""
        return math.pi * self.diameter_m**4 / 64

    @property
    def shear_modulus_pa(self) -> float:
        """G."""
        return self.youngs_modulus_pa / (2 * (1 + self.poissons_ratio))

    @property
    def shear_stiffness_n(self) -> float:
        """kappa G A with Cowper's factor of a round section (J. Appl. Mech. 33, 1966)."""
        kappa = 6 * (1 + self.poissons_ratio) / (7 + 6 * self.poissons_ratio)
        return kappa * self.shear_modulus_pa * self.area_m2


def bending_element(bar: RoundBar, length_m: float) -> tuple[Array, Array]:
    """Consistent mass and stiffness, (4, 4), over (deflection, slope) at both ends.

    Przemieniecki, Theory of Matrix Structural Analysis (1968), 5.6 and 11.5.
    """
    stiffness_nm2 = bar.youngs_modulus_pa * bar.second_moment_m4
    p = 12 * stiffness_nm2 / (bar.shear_stiffness_n * length_m**2)
    a, b, c = 6 * length_m, (4 + p) * length_m**2, (2 - p) * length_m**2
    stiffness = np.array([[12, a, -12, a], [a, b, -a, c], [-12, -a, 12, -a], [a, c, -a, b]])
    m1, m2 = 312 + 588 * p + 280 * p**2, (44 + 77 * p + 35 * p**2) * length_m
    m3, m4 = 108 + 252 * p + 140 * p**2, -(26 + 63 * p + 35 * p**2) * length_m
    m5, m6 = (8 + 14 * p + 7 * p**2) * length_m**2, -(6 + 14 * p + 7 * p**2) * length_m**2
    moving = np.array([[m1, m2, m3, m4], [m2, m5, -m4, m6], [m3, -m4, m1, -m2], [m4, m6, -m2, m5]])
    m8 = (3 - 15 * p) * length_m
    m9, m10 = (4 + 5 * p + 10 * p**2) * length_m**2, (-1 - 5 * p + 5 * p**2) * length_m**2
    turning = np.array([[36, m8, -36, m8], [m8, m9, -m8, m10], [-36, -m8, 36, -m8], [m8, m10, -m8, m9]])
    rho = bar.density_kg_per_m3 / (1 + p) ** 2
    mass = rho * bar.area_m2 * length_m / 840 * moving
    mass += rho * bar.second_moment_m4 / (30 * length_m) * turning
    return mass, stiffness_nm2 / ((1 + p) * length_m**3) * stiffness


def torsion_element(bar: RoundBar, length_m: float) -> tuple[Array, Array]:
    """Consistent inertia and stiffness, (2, 2), over the rotations of both ends."""
    polar = 2 * bar.second_moment_m4
    inertia = bar.density_kg_per_m3 * polar * length_m / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    return inertia, bar.shear_modulus_pa * polar / length_m * np.array([[1.0, -1.0], [-1.0, 1.0]])


def assembled(elements: Sequence[tuple[Array, Array]], per_node: int) -> tuple[Array, Array]:
    """Mass and stiffness of elements one behind the other, `per_node` coordinates at each node."""
    size = per_node * (len(elements) + 1)
    mass, stiffness = np.zeros((2, size, size))
    for number, (own_mass, own_stiffness) in enumerate(elements):
        span = slice(per_node * number, per_node * (number + 2))
        mass[span, span] += own_mass
        stiffness[span, span] += own_stiffness
    return mass, stiffness


def nodes_between(lengths_m: Sequence[float], longest_m: float) -> tuple[Array, list[int]]:
    """Lengths of the elements of a shaft in sections, and the node at the end of each section."""
    lengths: list[float] = []
    ends = []
    for length in lengths_m:
        count = max(1, math.ceil(length / longest_m - 1e-9))
        lengths += [length / count] * count
        ends.append(len(lengths))
    return np.array(lengths), ends
