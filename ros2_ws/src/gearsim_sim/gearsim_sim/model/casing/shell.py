"""Flat 4-node shell elements, all elements of a mesh at once.

Bending: MITC4 of Dvorkin and Bathe (1984), whose transverse shear strains are tied at the middles of the
sides, so that thin plates do not lock. Membrane: bilinear with the incompatible modes of Taylor, Beresford
and Wilson (1976). The rotation about the normal is tied to that of the membrane by the penalty of Hughes and
Brezzi (1989), `DRILLING` times the shear modulus; a tenth is what keeps modes above 3 kHz right.

A node has six displacements ux uy uz rx ry rz. Mass is lumped, which for plates counters the error of the
stiffness (consistent masses add to it); rotary inertia is lumped alike, the same about all axes.

Stiffness is `t A + t**3 B` in the thickness t, exactly: `shell_parts` gives A and B.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.casing.material import Array, Material

Cells = NDArray[np.int64]

DRILLING = 0.1
SHEAR_FACTOR = 5 / 6
_CORNERS = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], dtype=float)
_GAUSS = 1 / np.sqrt(3)
_POINTS = _GAUSS * _CORNERS


def shell_stiffness(nodes_m: Array, quads: Cells, thickness_m: Array, material: Material) -> Array:
    """Stiffness matrices in global axes, shape (elements, 24, 24).

    Parameters
    ----------
    nodes_m : Array, shape (nodes, 3)
    quads : Cells, shape (elements, 4)
        Corners of each element, going round it.
    thickness_m : Array, shape (elements,)
    material : Material
    """
    linear, cubic = shell_parts(nodes_m, quads, material)
    thickness = thickness_m[:, None, None]
    return np.asarray(thickness * linear + thickness**3 * cubic)


def shell_parts(nodes_m: Array, quads: Cells, material: Material) -> tuple[Array, Array]:
    """The parts A (membrane, shear, drilling) and B (bending) of stiffness `t A + t**3 B`, global axes."""
    frames, flat = local_frames(nodes_m[quads])
    linear = _membrane(flat, material) + _shear(flat, material)
    cubic = _bending(flat, material)
    return _to_global(linear, frames), _to_global(cubic, frames)


def shell_masses(nodes_m: Array, quads: Cells, thickness_m: Array, material: Material) -> tuple[Array, Array]:
    """Lumped mass [kg] and rotary inertia [kg m^2] at the corners, shape (elements, 4) each."""
    _, flat = local_frames(nodes_m[quads])
    areas = np.zeros(quads.shape)
    for point in _POINTS:
        shape, slopes = _shape(point)
        areas += shape * _determinant(slopes @ flat)[:, None]
    mass = material.density_kg_per_m3 * thickness_m[:, None] * areas
    return mass, mass * thickness_m[:, None] ** 2 / 12


def local_frames(corners_m: Array) -> tuple[Array, Array]:
    """Axes of each element by rows, (elements, 3, 3), and its corners in them, (elements, 4, 2)."""
    first = corners_m[:, 2] - corners_m[:, 0]
    second = corners_m[:, 3] - corners_m[:, 1]
    normal = np.cross(first, second)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along = corners_m[:, 1] + corners_m[:, 2] - corners_m[:, 0] - corners_m[:, 3]
    along -= np.sum(along * normal, axis=1, keepdims=True) * normal
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    frames = np.stack([along, np.cross(normal, along), normal], axis=1)
    centred = corners_m - corners_m.mean(axis=1, keepdims=True)
    return frames, np.einsum("eij,ekj->eki", frames[:, :2], centred)


def _to_global(matrices: Array, frames: Array) -> Array:
    turn = np.zeros((len(frames), 24, 24))
    for block in range(0, 24, 3):
        turn[:, block : block + 3, block : block + 3] = frames
    return np.asarray(turn.transpose(0, 2, 1) @ matrices @ turn)


def _shape(point: Array) -> tuple[Array, Array]:
    """Bilinear functions at (xi, eta), shape (4,), and their slopes, shape (2, 4)."""
    xi, eta = point
    a, b = _CORNERS.T
    value = (1 + a * xi) * (1 + b * eta) / 4
    return value, np.stack([a * (1 + b * eta), b * (1 + a * xi)]) / 4


def _determinant(jacobian: Array) -> Array:
    return np.asarray(jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0])


def _bending(flat: Array, material: Material) -> Array:
    """Of unit thickness cubed: curvatures from the rotations rx, ry (u = z ry, v = -z rx)."""
    law = material.plane_stress / 12
    total = np.zeros((len(flat), 24, 24))
    for point in _POINTS:
        _, slopes = _shape(point)
        jacobian = slopes @ flat
        gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (len(flat), 2, 4)))
        strain = np.zeros((len(flat), 3, 24))
        strain[:, 0, 4::6] = gradient[:, 0]
        strain[:, 1, 3::6] = -gradient[:, 1]
        strain[:, 2, 4::6] = gradient[:, 1]
        strain[:, 2, 3::6] = -gradient[:, 0]
        total += _energy(strain, law, _determinant(jacobian))
    return total


def _energy(strain: Array, law: Array, weight: Array) -> Array:
    return np.asarray(strain.transpose(0, 2, 1) @ (law @ strain) * weight[:, None, None])


def _side_shear(flat: Array, point: tuple[float, float], axis: int) -> Array:
    """Covariant transverse shear strain along one natural axis at one point, shape (elements, 24)."""
    shape, slopes = _shape(np.array(point))
    tangent = np.einsum("k,ekj->ej", slopes[axis], flat)
    row = np.zeros((len(flat), 24))
    row[:, 2::6] = slopes[axis]
    row[:, 4::6] = tangent[:, :1] * shape
    row[:, 3::6] = -tangent[:, 1:] * shape
    return row


def _shear(flat: Array, material: Material) -> Array:
    """Transverse shear of unit thickness, with the strains tied as in MITC4."""
    bottom, top = (_side_shear(flat, (0.0, eta), 0) for eta in (-1.0, 1.0))
    left, right = (_side_shear(flat, (xi, 0.0), 1) for xi in (-1.0, 1.0))
    law = SHEAR_FACTOR * material.shear_modulus_pa * np.eye(2)
    total = np.zeros((len(flat), 24, 24))
    for xi, eta in _POINTS:
        _, slopes = _shape(np.array([xi, eta]))
        jacobian = slopes @ flat
        covariant = np.stack(
            [((1 - eta) * bottom + (1 + eta) * top) / 2, ((1 - xi) * left + (1 + xi) * right) / 2], axis=1
        )
        total += _energy(np.linalg.solve(jacobian, covariant), law, _determinant(jacobian))
    return total


def _membrane(flat: Array, material: Material) -> Array:
    """In-plane stiffness of unit thickness with incompatible modes (condensed) and drilling rotations."""
    count = len(flat)
    law, penalty = material.plane_stress, DRILLING * material.shear_modulus_pa
    centre = _shape(np.zeros(2))[1] @ flat
    inverse, middle = np.linalg.inv(centre), _determinant(centre)
    own, cross, inner = np.zeros((count, 24, 24)), np.zeros((count, 4, 24)), np.zeros((count, 4, 4))
    for point in _POINTS:
        shape, slopes = _shape(point)
        jacobian = slopes @ flat
        weight = _determinant(jacobian)
        gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (count, 2, 4)))
        strain = np.zeros((count, 3, 24))
        strain[:, 0, 0::6] = strain[:, 2, 1::6] = gradient[:, 0]
        strain[:, 1, 1::6] = strain[:, 2, 0::6] = gradient[:, 1]
        bubbles = inverse @ np.diag(-2 * point) * (middle / weight)[:, None, None]
        extra = np.zeros((count, 3, 4))
        extra[:, 0, 0::2] = extra[:, 2, 1::2] = bubbles[:, 0]
        extra[:, 1, 1::2] = extra[:, 2, 0::2] = bubbles[:, 1]
        twist = np.zeros((count, 1, 24))
        twist[:, 0, 5::6] = shape
        twist[:, 0, 1::6] = -gradient[:, 0] / 2
        twist[:, 0, 0::6] = gradient[:, 1] / 2
        own += _energy(strain, law, weight) + _energy(twist, penalty * np.eye(1), weight)
        cross += extra.transpose(0, 2, 1) @ (law @ strain) * weight[:, None, None]
        inner += _energy(extra, law, weight)
    return np.asarray(own - cross.transpose(0, 2, 1) @ np.linalg.solve(inner, cross))
