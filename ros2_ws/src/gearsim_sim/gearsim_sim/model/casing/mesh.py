"""Nodes, elements and ties of a structure, before any stiffness is computed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.shell import Cells

MERGE_M = 1e-7


@dataclass(frozen=True)
class Rigid:
    """Nodes that move with a centre node as one rigid body (Nastran's RBE2)."""

    centre: int
    nodes: Cells


@dataclass(frozen=True)
class Average:
    """A node that moves with the weighted mean motion of others, without stiffening them (RBE3)."""

    node: int
    sources: Cells
    weights: Array


@dataclass(frozen=True)
class Pad:
    """Springs to the ground, shared evenly by some nodes."""

    name: str
    nodes: Cells
    stiffness_n_per_m: tuple[float, float, float]


@dataclass(frozen=True)
class Mesh:
    """A structure of 4-node shells and 8-node hexahedra.

    Shells and hexahedra share no nodes (that would leave hinges): they are tied by `averages`.
    """

    nodes_m: Array
    """Shape (nodes, 3)."""
    quads: Cells
    quad_regions: Cells
    """Index into `regions` of each quad."""
    regions: tuple[str, ...]
    """Parts of the plates that may each have a thickness of their own."""
    hexes: Cells
    rigids: tuple[Rigid, ...] = ()
    averages: tuple[Average, ...] = ()
    pads: tuple[Pad, ...] = ()
    masters: Mapping[str, int] = field(default_factory=dict)
    """Node of each named master."""

    def nearest(self, point_m: Array) -> tuple[int, float]:
        """The node of an element nearest to a point, and its distance [m]."""
        used = np.unique(np.concatenate([self.quads.ravel(), self.hexes.ravel()]))
        distances = np.linalg.norm(self.nodes_m[used] - point_m, axis=1)
        best = int(np.argmin(distances))
        return int(used[best]), float(distances[best])


def merged(nodes_m: Array, cells: Cells) -> tuple[Array, Cells]:
    """Nodes at the same place (to `MERGE_M`) made one; cells renumbered, nodes kept in their order."""
    pairs = cKDTree(nodes_m).query_pairs(MERGE_M, output_type="ndarray")
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(nodes_m), len(nodes_m)))
    _, labels = connected_components(links, directed=False)
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return nodes_m[first[order]], rank[inverse][cells]


def grid_cells(rows: int, columns: int) -> Cells:
    """Quads of a grid of (rows + 1) x (columns + 1) nodes numbered row by row."""
    corner = np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)
    quads = np.stack([corner, corner + 1, corner + columns + 2, corner + columns + 1], axis=-1)
    return quads.reshape(-1, 4)
