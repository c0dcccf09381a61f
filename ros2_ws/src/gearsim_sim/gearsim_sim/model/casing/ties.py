"""Ties between nodes as one sparse matrix: all displacements from the independent ones, `u = T u_free`."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Average, Mesh, Rigid
from gearsim_sim.model.casing.shell import Cells


def rigid_rows(arm_m: Array) -> Array:
    """Displacements of a point at `arm_m` from a centre over the centre's six, shape (3, 6)."""
    x, y, z = arm_m
    return np.array([[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]], dtype=float)


def mean_motion(node_m: Array, sources_m: Array, weights: Array) -> Array:
    """Six displacements of a node as the weighted mean motion of others, shape (6, 3 sources).

    As Nastran's RBE3 with the translations of the sources: the rigid-body motion about the node that fits
    the sources' displacements best in the sense of least squares.
    """
    bodies = np.concatenate([rigid_rows(arm) for arm in sources_m - node_m])
    weighted = bodies * np.repeat(weights / weights.sum(), 3)[:, None]
    return np.asarray(np.linalg.solve(weighted.T @ bodies, weighted.T))


def tie_matrix(mesh: Mesh) -> tuple[csr_array, Cells]:
    """`T`, shape (6 nodes, independent), and the row of each independent displacement.

    Nodes of hexahedra have no rotations; rows of displacements that do not exist are empty.
    """
    count = len(mesh.nodes_m)
    exists = np.zeros((count, 6), dtype=bool)
    exists[np.unique(mesh.hexes), :3] = True
    exists[np.unique(mesh.quads)] = True
    for rigid in mesh.rigids:
        exists[rigid.centre] = True
    free = exists.copy()
    ties = [_rigid_entries(mesh, rigid) for rigid in mesh.rigids]
    ties += [_average_entries(mesh, average) for average in mesh.averages]
    for rows, _, _ in ties:
        if not free.reshape(-1)[rows].all():
            raise ValueError("a displacement is tied twice")
    for rows, _, _ in ties:
        free.reshape(-1)[rows] = False
    independent = np.flatnonzero(free)
    column = np.full(6 * count, -1)
    column[independent] = np.arange(len(independent))
    none = np.zeros(0, dtype=np.int64)
    rows, columns = (np.concatenate([none, *(entry[k] for entry in ties)]) for k in range(2))
    values = np.concatenate([np.zeros(0), *(entry[2] for entry in ties)])
    if (column[columns] < 0).any():
        raise ValueError("a tie hangs on a displacement that is tied itself")
    matrix = coo_array(
        (
            np.concatenate([np.ones(len(independent)), values]),
            (np.concatenate([independent, rows]), np.concatenate([column[independent], column[columns]])),
        ),
        shape=(6 * count, len(independent)),
    )
    ties_matrix = matrix.tocsr()
    ties_matrix.eliminate_zeros()
    return ties_matrix, independent


def _rigid_entries(mesh: Mesh, rigid: Rigid) -> tuple[Cells, Cells, Array]:
    """Rows, columns and values of the tie, over displacements of nodes."""
    blocks = np.stack([rigid_rows(arm) for arm in mesh.nodes_m[rigid.nodes] - mesh.nodes_m[rigid.centre]])
    rows = np.broadcast_to((6 * rigid.nodes[:, None] + np.arange(3))[:, :, None], blocks.shape)
    columns = np.broadcast_to(6 * rigid.centre + np.arange(6), blocks.shape)
    return _non_zero(rows, columns, blocks)


def _average_entries(mesh: Mesh, average: Average) -> tuple[Cells, Cells, Array]:
    values = mean_motion(mesh.nodes_m[average.node], mesh.nodes_m[average.sources], average.weights)
    rows = np.broadcast_to((6 * average.node + np.arange(6))[:, None], values.shape)
    columns = np.broadcast_to((6 * average.sources[:, None] + np.arange(3)).reshape(-1), values.shape)
    return _non_zero(rows, columns, values)


def _non_zero(rows: Cells, columns: Cells, values: Array) -> tuple[Cells, Cells, Array]:
    # A row stays even where all its values vanish: it is tied, not free.
    kept = values != 0
    kept[..., 0] = True
    return rows[kept], columns[kept], values[kept]
