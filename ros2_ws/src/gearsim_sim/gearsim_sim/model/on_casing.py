"""Puts the bearings of a machine that stands on the ground into the bores of a flexible casing.

The casing comes reduced after Craig and Bampton, q = (u of the masters, amplitudes of modes with the masters
held). On its mounts and with modal damping it falls apart into oscillators, its own modes: those, of unit
mass, become degrees of freedom of the plant. Whatever spring or damper a bearing had against the ground now
acts between shaft and ring, and so do the contacts. Rings move with the bore's centre, without moments:
bearings are self-aligning.

Sensor sites take the displacement recovery of the reduction (approach A of the thesis, 5.3), a row over q.
What the modes left out add quasi-statically, `correction` times the acceleration of the masters, enters each
own mode within the valid band at that mode's frequency, -w_m^2 correction u_m: near a resonance, where it
matters, that is the same, and nothing has to be differentiated.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.assembly import Elements, LinearSystem, Vector
from gearsim_sim.model.carrier import CarryingStructure, TurningPair
from gearsim_sim.model.casing.reduced import ReducedCasing, Site
from gearsim_sim.model.plant import GRAVITY, Plant
from gearsim_sim.model.shafts import Mount

Array = NDArray[np.float64]
_AXES = {"x": "ux", "y": "uy"}
# Coupling between modes by damping, over the damping of both: more is not modal. Files keep all digits, but
# squared frequencies span eight decades.
_MODAL = 1e-4
_LEAST_HZ = 0.5  # slower than that a casing is not held by its mounts


@dataclass(frozen=True)
class Joint:
    """An interface of a machine on the ground that goes to a displacement of a master of the casing."""

    interface: int
    master: str
    direction: str
    what: str  # that stands there, for errors


def bearing_joints(plant: Plant) -> tuple[Joint, ...]:
    """The n-th bearing goes into master `b<n>`, without moments."""
    found = (
        Joint(getattr(seat, axis), f"b{number}", direction, seat.name)
        for number, seat in enumerate(plant.bearings, 1)
        for axis, direction in _AXES.items()
    )
    return tuple(sorted(found, key=lambda joint: joint.interface))


def on_casing(
    plant: Plant,
    casing: ReducedCasing,
    where: str,
    *,
    joints: Sequence[Joint] | None = None,
    turning: tuple[TurningPair, ...] = (),
    gravity: bool = True,
) -> Plant:
    """The machine in that casing.

    Parameters
    ----------
    plant : Plant
        On the ground.
    casing : ReducedCasing
    where : str
        Named in errors.
    joints : sequence of Joint, optional
        Those of its bearings, if not given.
    turning : tuple of TurningPair
        Joints (by their places) whose plane turns against the casing.
    gravity : bool
        Whether the casing has weight.

    Raises
    ------
    InputError
        A casing without a bore for each bearing, without mounts, or whose damping is not modal.
    """
    omega, ratios, shapes = own_modes(casing, where)
    dofs = tuple(f"casing_{number}" for number in range(1, omega.size + 1))
    joints = bearing_joints(plant) if joints is None else joints
    rings = _ring_rows(plant, casing, joints, where) @ shapes  # (interfaces, modes)
    carried = [joint.interface for joint in joints]
    system = plant.system
    stiffness, damping = (
        _between(system, elements, carried) for elements in (system.springs, system.dampers)
    )
    weight = (np.zeros(casing.size) if not gravity else -_lift(casing)) @ casing.mass @ shapes
    joined = _joined(system, dofs, omega, ratios, rings, weight)
    return replace(
        plant,
        system=joined,
        rigid=np.concatenate([plant.rigid, np.zeros(len(dofs))]),
        sites=_sites(casing, joints, dofs, rings, omega, shapes),
        # A foot's own damping is part of the modal damping: none of it is lost where the foot lifts.
        mounts={
            foot.name: Mount(_vector(dofs, foot.rows @ shapes), foot.stiffness_n_per_m, 0.0)
            for foot in casing.feet
        },
        carrier=CarryingStructure(dofs, omega, ratios, tuple(carried), stiffness, damping, turning),
    )


def own_modes(casing: ReducedCasing, where: str) -> tuple[Array, Array, Array]:
    """Frequencies [rad/s], damping over critical, and shapes (n, n) of the casing on its mounts.

    Raises
    ------
    InputError
        If it is not held, or its damping joins its modes or is not below critical.
    """
    omega, shapes = casing.own_modes
    if omega[0] < 2 * math.pi * _LEAST_HZ:
        expected = f"a casing that mounts hold: all modes above {_LEAST_HZ} Hz"
        raise InputError(where, "stiffness", f"{omega[0] / (2 * math.pi):.3g} Hz", expected)
    modal = shapes.T @ casing.damping @ shapes
    own = np.diag(modal).copy()
    ratios = own / (2 * omega)
    if np.any(ratios < 0) or np.any(ratios >= 1):
        worst = ratios[np.argmax(np.abs(ratios - 0.5))]
        raise InputError(
            where, "damping", f"{worst:.3g} of critical", "every mode between 0 and 1 of critical"
        )
    scale = np.sqrt(np.outer(own, own))
    if np.any(np.abs(modal - np.diag(own)) > _MODAL * np.maximum(scale, own.max() * 1e-9)):
        raise InputError(
            where, "damping", "a matrix that joins modes", "modal damping of the casing on its mounts"
        )
    return omega, ratios, shapes


def _ring_rows(plant: Plant, casing: ReducedCasing, joints: Sequence[Joint], where: str) -> Array:
    """Motion of the ring of each interface over the coordinates of the casing, (interfaces, n)."""
    rows = np.zeros((len(plant.system.interface_names), casing.size))
    for joint in joints:
        if joint.master not in casing.masters:
            expected = f"a bore {joint.master} for {joint.what}"
            raise InputError(where, "masters", ", ".join(casing.masters), expected)
        rows[joint.interface, casing.dof(joint.master, joint.direction)] = 1.0
    return rows


def _between(system: LinearSystem, elements: Elements, carried: Sequence[int]) -> Array:
    """Sum of the elements that act along each of these interfaces."""
    columns = system.interfaces[:, carried]
    same = np.all(elements.directions[:, :, None] == columns[:, None, :], axis=0)  # (elements, carried)
    return np.asarray(elements.values @ same)


def _lift(casing: ReducedCasing) -> Array:
    """Coordinates of the whole casing moved by 1 m in y."""
    motion = np.zeros(casing.size)
    motion[[casing.dof(name, "uy") for name in casing.masters]] = 1.0
    return motion


def _joined(
    system: LinearSystem, dofs: tuple[str, ...], omega: Array, ratios: Array, rings: Array, weight: Array
) -> LinearSystem:
    """Machine and oscillators; what acted along an interface now acts between both."""
    count = len(dofs)
    interfaces = np.vstack([system.interfaces, -rings.T])

    def elements(of: Elements, own: Array) -> Elements:
        below = np.zeros((count, of.values.size))
        for index, column in enumerate(system.interfaces.T):
            same = np.all(of.directions == column[:, None], axis=0)
            below[:, same] = -rings[index][:, None]
        above = np.vstack([of.directions, below])
        behind = np.vstack([np.zeros((len(system.dof_names), count)), np.eye(count)])
        return Elements(np.hstack([above, behind]), np.concatenate([of.values, own]))

    springs, dampers = elements(system.springs, omega**2), elements(system.dampers, 2 * ratios * omega)
    inputs = np.vstack([system.inputs, np.zeros((count, system.inputs.shape[1]))])
    inputs[-count:, GRAVITY] = weight
    return LinearSystem(
        dof_names=(*system.dof_names, *dofs),
        mass=np.diag(np.concatenate([np.diag(system.mass), np.ones(count)])),
        damping=_matrix(dampers),
        stiffness=_matrix(springs),
        interface_names=system.interface_names,
        interfaces=interfaces,
        input_names=system.input_names,
        inputs=inputs,
        springs=springs,
        dampers=dampers,
    )


def _matrix(elements: Elements) -> Array:
    matrix = (elements.directions * elements.values) @ elements.directions.T
    return np.asarray((matrix + matrix.T) / 2)


def _sites(
    casing: ReducedCasing,
    joints: Sequence[Joint],
    dofs: tuple[str, ...],
    rings: Array,
    omega: Array,
    shapes: Array,
) -> Mapping[str, Vector]:
    """Masters that carry something under their names (`b1_x`), then the casing's own sites."""
    found: dict[str, Vector] = {}
    for joint in joints:
        if joint.direction in _AXES.values():
            found[f"{joint.master}_{joint.direction[1]}"] = _vector(dofs, rings[joint.interface])
    for site in casing.sites:
        found[site.name] = _vector(dofs, site_row(site, casing, omega, shapes))
    return found


def site_row(site: Site, casing: ReducedCasing, omega: Array, shapes: Array) -> Array:
    """Displacement of a site per own mode of the casing, (modes,)."""
    masters = shapes[: 6 * len(casing.masters)]
    inside = omega <= 2 * math.pi * casing.valid_hz
    return np.asarray(site.rows @ shapes - np.where(inside, omega**2, 0.0) * (site.correction @ masters))


def _vector(dofs: tuple[str, ...], row: Array) -> Vector:
    return dict(zip(dofs, row.tolist(), strict=True))
