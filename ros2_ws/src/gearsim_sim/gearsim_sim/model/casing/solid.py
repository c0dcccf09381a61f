"""8-node hexahedra with incompatible modes (Taylor, Beresford and Wilson, 1976), all elements at once.

Without the extra modes a brick that bends is far too stiff; with them one layer bends like a beam. Mass is
lumped at the corners.
"""

from __future__ import annotations

import numpy as np

from gearsim_sim.model.casing.material import Array, Material
from gearsim_sim.model.casing.shell import Cells

_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    dtype=float,
)
_POINTS = _CORNERS / np.sqrt(3)


def solid_stiffness(nodes_m: Array, hexes: Cells, material: Material) -> Array:
    """Stiffness matrices over ux uy uz of the corners, shape (elements, 24, 24).

    Parameters
    ----------
    nodes_m : Array, shape (nodes, 3)
    hexes : Cells, shape (elements, 8)
        Corners of each element: round the bottom, then round the top.
    material : Material
    """
    corners, law = nodes_m[hexes], material.solid
    count = len(hexes)
    centre = _slopes(np.zeros(3)) @ corners
    inverse, middle = np.linalg.inv(centre), np.linalg.det(centre)
    own, cross, inner = np.zeros((count, 24, 24)), np.zeros((count, 9, 24)), np.zeros((count, 9, 9))
    for point in _POINTS:
        slopes = _slopes(point)
        jacobian = slopes @ corners
        weight = np.linalg.det(jacobian)
        gradient = np.linalg.solve(jacobian, np.broadcast_to(slopes, (count, 3, 8)))
        strain = _strain(np.asarray(gradient, dtype=np.float64))
        extra = _strain(np.asarray(inverse @ np.diag(-2 * point) * (middle / weight)[:, None, None]))
        scaled = law @ strain * weight[:, None, None]
        own += strain.transpose(0, 2, 1) @ scaled
        cross += extra.transpose(0, 2, 1) @ scaled
        inner += extra.transpose(0, 2, 1) @ (law @ extra) * weight[:, None, None]
    return np.asarray(own - cross.transpose(0, 2, 1) @ np.linalg.solve(inner, cross))


def solid_masses(nodes_m: Array, hexes: Cells, material: Material) -> Array:
    """Lumped mass [kg] that each element gives its corners, shape (elements, 8)."""
    corners = nodes_m[hexes]
    volumes = np.zeros(hexes.shape)
    for point in _POINTS:
        shape = np.prod(1 + _CORNERS * point, axis=1) / 8
        volumes += shape * np.linalg.det(_slopes(point) @ corners)[:, None]
    return material.density_kg_per_m3 * volumes


def _slopes(point: Array) -> Array:
    """Slopes of the trilinear functions, shape (3, 8)."""
    factors = 1 + _CORNERS * point
    return (
        np.stack(
            [
                _CORNERS[:, 0] * factors[:, 1] * factors[:, 2],
                _CORNERS[:, 1] * factors[:, 0] * factors[:, 2],
                _CORNERS[:, 2] * factors[:, 0] * factors[:, 1],
            ]
        )
        / 8
    )


def _strain(gradient: Array) -> Array:
    """Strains xx, yy, zz, xy, yz, zx of displacements with these gradients, shape (elements, 6, 3 k)."""
    count, _, functions = gradient.shape
    strain = np.zeros((count, 6, 3 * functions))
    for axis in range(3):
        strain[:, axis, axis::3] = gradient[:, axis]
    for row, (first, second) in enumerate(((0, 1), (1, 2), (2, 0)), 3):
        strain[:, row, first::3] = gradient[:, second]
        strain[:, row, second::3] = gradient[:, first]
    return strain
