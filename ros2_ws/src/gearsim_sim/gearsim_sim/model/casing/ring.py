"""The mesh of a thick ring that holds an eccentric disc with a bearing's bore, in hexahedra.

The bore is round and off the ring's centre. Nodes lie on closed curves that change from the bore's circle to
the disc's edge and on to the ring's outer edge; disc and ring are one body (they are clamped).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import grid_cells
from gearsim_sim.model.casing.shell import Cells


@dataclass(frozen=True)
class RingShape:
    """Dimensions of a ring with its disc [m]; the bore's centre lies at `eccentricity_m` from the ring's."""

    bore_radius_m: float
    disc_radius_m: float
    outer_radius_m: float
    thickness_m: float
    eccentricity_m: tuple[float, float]


@dataclass(frozen=True)
class RingMesh:
    """Hexahedra of a ring about the origin; its middle plane is z = 0."""

    nodes_m: Array
    hexes: Cells
    bore: Cells
    """Nodes of the bore's surface."""
    edge: Cells
    """Nodes of the outer surface, shape (angles, layers + 1)."""


def ring_mesh(shape: RingShape, angles_rad: Array, layers: int, size_m: float) -> RingMesh:
    """Mesh a ring with nodes at these angles and `layers` elements through its thickness.

    Parameters
    ----------
    shape : RingShape
    angles_rad : Array, shape (count,)
        Of the nodes on the outer edge, going round once.
    layers : int
    size_m : float
        About how long an element is in radial direction.
    """
    count = len(angles_rad)
    circle = np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=1)
    bore = np.array(shape.eccentricity_m) + shape.bore_radius_m * circle
    disc, outer = shape.disc_radius_m * circle, shape.outer_radius_m * circle
    curves = np.concatenate([_between(bore, disc, size_m), _between(disc, outer, size_m)[1:]])
    heights = np.linspace(-0.5, 0.5, layers + 1) * shape.thickness_m
    flat = curves.reshape(-1, 2)
    nodes = np.concatenate([np.column_stack([flat, np.full(len(flat), z)]) for z in heights])
    quads = grid_cells(len(curves) - 1, count)
    # The grid's last column is its first one again.
    row, column = np.divmod(quads, count + 1)
    quads = (row * count + column % count)[:, [0, 3, 2, 1]]
    hexes = np.concatenate(
        [np.hstack([quads + k * len(flat), quads + (k + 1) * len(flat)]) for k in range(layers)]
    )
    level = np.arange(layers + 1) * len(flat)
    inner = (np.arange(count)[:, None] + level).ravel()
    edge = (len(curves) - 1) * count + np.arange(count)[:, None] + level
    return RingMesh(nodes, hexes, inner, edge)


def _between(first: Array, last: Array, size_m: float) -> Array:
    """Closed curves from the first to the last one, shape (curves, angles, 2)."""
    steps = max(1, round(float(np.linalg.norm(last - first, axis=1).mean()) / size_m))
    share = np.linspace(0, 1, steps + 1)[:, None, None]
    return np.asarray((1 - share) * first + share * last)
