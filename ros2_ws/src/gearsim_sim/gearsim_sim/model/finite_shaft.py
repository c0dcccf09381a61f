"""A shaft of finite elements with its wheel, bearings, flywheel and encoder, reduced after Craig and Bampton.

From end to end: coupling, near bearing, wheel, far bearing, encoder. The shaft bends in x and in y alike and
twists; the flywheel hangs on the coupling's end and the encoder on the other by torsion springs. Masters are
those of thesis Table B.2: deflections at wheel and bearings in x and y, rotations of flywheel and wheel. No
gyroscopic forces: at 30 turns a second they are a few thousandths of the inertia forces.

The reduced shaft is put into its own modes, free in space: coordinates of unit mass, of which those with
frequency zero move or turn it as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from gearsim_sim.model.beam import (
    RoundBar,
    assembled,
    bending_element,
    nodes_between,
    torsion_element,
)
from gearsim_sim.model.gear_wheel import GearWheel
from gearsim_sim.params.finite_shafts import FiniteShaft, FiniteShafts

Array = NDArray[np.float64]
Indices = NDArray[np.intp]
NEAR, WHEEL, FAR = "near", "wheel", "far"
FLYWHEEL, COUPLING, END, ENCODER = "flywheel", "coupling", "end", "encoder"
_RIGID = 1e-10  # squared frequency over the highest: less is motion as a whole


@dataclass(frozen=True)
class Disc:
    """A rigid wheel: mass [kg] and moments of inertia about the axis and about a diameter [kg m^2]."""

    mass_kg: float
    polar_kg_m2: float
    diametral_kg_m2: float


def wheel_disc(wheel: GearWheel, of: FiniteShafts) -> Disc:
    """The wheel as a disc out to its pitch circle, as wide as its teeth."""
    gear = wheel.pair.gear(of_wheel=wheel.of_wheel)
    outer, inner, width = gear.pitch_radius_m, of.diameter_m / 2, gear.face_width_m
    mass = of.density_kg_per_m3 * math.pi * (outer**2 - inner**2) * width
    polar = mass * (outer**2 + inner**2) / 2
    return Disc(mass, polar, polar / 2 + mass * width**2 / 12)


@dataclass(frozen=True, eq=False)
class Component:
    """Bending of a shaft in one plane, or its torsion: full matrices over all coordinates of the elements."""

    mass: Array
    stiffness: Array
    masters: tuple[int, ...]
    places: Mapping[str, int]

    def held_squares(self) -> tuple[Array, Array, Indices]:
        """Squared frequencies and shapes with the masters held, and the slaves that they are over."""
        slaves = np.setdiff1d(np.arange(len(self.mass)), self.masters)
        block = np.ix_(slaves, slaves)
        squares, shapes = eigh(self.stiffness[block], self.mass[block])
        return squares, shapes, slaves

    def reduced(self, modes: int) -> OwnModes:
        """Its own modes, after a reduction to the masters and that many modes with the masters held."""
        _, held, slaves = self.held_squares()
        count = len(self.masters)
        basis = np.zeros((len(self.mass), count + modes))
        basis[list(self.masters), range(count)] = 1.0
        inner, across = self.stiffness[slaves][:, slaves], self.stiffness[slaves][:, list(self.masters)]
        basis[slaves, :count] = -np.linalg.solve(inner, across)
        basis[slaves, count:] = held[:, :modes]
        found, shapes = eigh(basis.T @ self.stiffness @ basis, basis.T @ self.mass @ basis)
        rigid = found < _RIGID * found[-1]
        full = basis @ shapes
        return OwnModes(
            omega=np.sqrt(np.where(rigid, 0.0, found)),
            rows={name: full[at] for name, at in self.places.items()},
            weight=full.T @ self.mass @ self._whole(),
        )

    def _whole(self) -> Array:
        """The motion of the shaft as a whole by 1 m, or by 1 rad."""
        motion = np.zeros(len(self.mass))
        motion[:: 2 if NEAR in self.places else 1] = 1.0
        return motion


@dataclass(frozen=True, eq=False)
class OwnModes:
    """Modes of unit mass of a free component.

    Attributes
    ----------
    omega : ndarray, shape (modes,)
        Angular frequencies [rad/s]; zero for motion as a whole.
    rows : mapping
        Motion of each place per coordinate, (modes,).
    weight : ndarray, shape (modes,)
        Force on each coordinate when the whole is accelerated by 1 m/s^2 (1 rad/s^2); for unit
        motion as a whole also the coordinates themselves.
    """

    omega: Array
    rows: Mapping[str, Array]
    weight: Array


def bending(shaft: FiniteShaft, of: FiniteShafts, disc: Disc) -> Component:
    """Deflections and slopes in one plane."""
    lengths, ends = _lengths(shaft, of)
    mass, stiffness = assembled([bending_element(_bar(of), length) for length in lengths], 2)
    near, wheel, far = (2 * node for node in ends[:3])
    mass[0, 0] += shaft.coupling_mass_kg
    mass[1, 1] += shaft.coupling_inertia_kg_m2 / 2
    for seat in (near, far):
        mass[seat, seat] += of.ring_mass_kg
    mass[wheel, wheel] += disc.mass_kg
    mass[wheel + 1, wheel + 1] += disc.diametral_kg_m2
    return Component(mass, stiffness, (near, wheel, far), {NEAR: near, WHEEL: wheel, FAR: far})


def torsion(shaft: FiniteShaft, of: FiniteShafts, disc: Disc) -> Component:
    """Rotations of flywheel, shaft and encoder."""
    lengths, ends = _lengths(shaft, of)
    bar_mass, bar_stiffness = assembled([torsion_element(_bar(of), length) for length in lengths], 1)
    size = len(bar_mass) + 2
    mass, stiffness = np.zeros((2, size, size))
    mass[1:-1, 1:-1], stiffness[1:-1, 1:-1] = bar_mass, bar_stiffness
    wheel = 1 + ends[1]
    for place, inertia in (
        (0, shaft.flywheel.inertia_kg_m2),
        (1, shaft.coupling_inertia_kg_m2),
        (wheel, disc.polar_kg_m2),
        (size - 1, shaft.encoder.inertia_kg_m2),
    ):
        mass[place, place] += inertia
    for first, spring in (
        (0, shaft.flywheel.stiffness_nm_per_rad),
        (size - 2, shaft.encoder.stiffness_nm_per_rad),
    ):
        pair = slice(first, first + 2)
        stiffness[pair, pair] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
    places = {FLYWHEEL: 0, COUPLING: 1, WHEEL: wheel, END: size - 2, ENCODER: size - 1}
    return Component(mass, stiffness, (0, wheel), places)


def wheel_stiffness(shaft: FiniteShaft, of: FiniteShafts, disc: Disc) -> tuple[float, float]:
    """Force between wheel and near, wheel and far bearing per metre of bend [N/m]."""
    part = bending(shaft, of, disc)
    masters = list(part.masters)
    slaves = part.held_squares()[2]
    inner, across = part.stiffness[slaves][:, slaves], part.stiffness[slaves][:, masters]
    condensed = part.stiffness[masters][:, masters] - across.T @ np.linalg.solve(inner, across)
    return -float(condensed[1, 0]), -float(condensed[1, 2])


def modes_kept(components: Sequence[Component], count: int) -> list[int]:
    """How many held modes of each component are among the `count` lowest of all."""
    tagged = sorted(
        (float(square), number)
        for number, component in enumerate(components)
        for square in component.held_squares()[0]
    )
    return [sum(number == own for _, number in tagged[:count]) for own in range(len(components))]


def _bar(of: FiniteShafts) -> RoundBar:
    return RoundBar(of.diameter_m, of.youngs_modulus_pa, of.poissons_ratio, of.density_kg_per_m3)


def _lengths(shaft: FiniteShaft, of: FiniteShafts) -> tuple[Array, list[int]]:
    sections = (
        shaft.coupling_overhang_m,
        shaft.near_span_m,
        shaft.far_span_m,
        shaft.encoder_overhang_m,
    )
    return nodes_between(sections, of.element_length_m)
