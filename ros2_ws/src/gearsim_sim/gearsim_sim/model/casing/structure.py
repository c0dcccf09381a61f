"""Mass and stiffness of a meshed structure over its independent displacements."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csc_array, csr_array, diags_array

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.material import Array, Material
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.ring_housing import RingHousing
from gearsim_sim.model.casing.shell import Cells, shell_masses, shell_stiffness
from gearsim_sim.model.casing.solid import solid_masses, solid_stiffness
from gearsim_sim.model.casing.ties import rigid_rows, tie_matrix


@dataclass(frozen=True)
class Structure:
    """`mass q'' + stiffness q = forces` with symmetric sparse matrices.

    Where it comes from (own elements or a user's matrices) does not matter to what is done with it.
    """

    name: str
    mass: csc_array
    stiffness: csc_array
    masters: Mapping[str, Cells]
    """Rows of the six displacements of each master node."""
    positions_m: Mapping[str, Array]
    """Of the masters."""

    @property
    def size(self) -> int:
        """Number of independent displacements."""
        return int(self.mass.shape[0])


@dataclass(frozen=True)
class MeshedStructure(Structure):
    """A structure of own elements: it knows where its nodes are."""

    mesh: Mesh
    ties: csr_array
    """Displacements of all nodes (six each) from the independent ones."""

    def row(self, node: int, direction: Array) -> csr_array:
        """Displacement of a node in a direction over the independent displacements, shape (1, size)."""
        pick = csr_array(np.asarray(direction, dtype=float)[None])
        return csr_array(pick @ self.ties[6 * node : 6 * node + 3])

    def rigid_motion(self) -> Array:
        """The six rigid-body motions about the origin in the independent displacements, shape (size, 6)."""
        nodes = self.mesh.nodes_m
        everything = np.zeros((len(nodes), 6, 6))
        for k, node in enumerate(nodes):
            everything[k, :3] = rigid_rows(node)
        everything[:, range(3, 6), range(3, 6)] = 1
        independent = self.ties.tocsc()
        # The row in which an independent displacement stands for itself: its own, with value 1.
        flat = everything.reshape(-1, 6)
        return flat[_own_rows(independent)]


def thicknesses_m(params: CasingParams | RingHousing, regions: tuple[str, ...]) -> Array:
    """Thickness of each region: its plate's, unless the description gives it one of its own."""
    if isinstance(params, RingHousing):
        return params.thicknesses_m
    for name in params.thickness_m:
        if name not in regions:
            raise InputError(params.name, "thickness", name, f"one of {', '.join(regions)}")
    of_plate = {"floor": params.box.floor_thickness_m, "rim": params.rim.thickness_m}
    wall = params.box.wall_thickness_m
    plates = [of_plate.get(name.split("/")[0], wall) for name in regions]
    return np.array(
        [params.thickness_m.get(name, plate) for name, plate in zip(regions, plates, strict=True)]
    )


def assemble(mesh: Mesh, thickness_m: Array, material: Material, name: str) -> MeshedStructure:
    """Structure of a mesh; `thickness_m` is that of each region."""
    ties, _ = tie_matrix(mesh)
    count = 6 * len(mesh.nodes_m)
    thickness = thickness_m[mesh.quad_regions]
    shells = shell_stiffness(mesh.nodes_m, mesh.quads, thickness, material)
    solids = solid_stiffness(mesh.nodes_m, mesh.hexes, material)
    stiffness = _scatter(shells, _dofs(mesh.quads, 6), count) + _scatter(solids, _dofs(mesh.hexes, 3), count)
    stiffness = stiffness + diags_array(_springs(mesh, count))
    mass = diags_array(_masses(mesh, thickness, material, count))
    across = ties.T.tocsr()
    masters = {master: _independent(ties, node) for master, node in mesh.masters.items()}
    return MeshedStructure(
        name=name,
        mass=_symmetric(across @ (mass @ ties)),
        stiffness=_symmetric(across @ (stiffness @ ties)),
        masters=masters,
        positions_m={master: mesh.nodes_m[node] for master, node in mesh.masters.items()},
        mesh=mesh,
        ties=ties,
    )


def _dofs(cells: Cells, kept: int) -> Cells:
    return (6 * cells[:, :, None] + np.arange(kept)).reshape(len(cells), kept * cells.shape[1])


def _scatter(matrices: Array, dofs: Cells, count: int) -> csr_array:
    size = dofs.shape[1]
    rows = np.repeat(dofs, size, axis=1).ravel()
    columns = np.tile(dofs, (1, size)).ravel()
    return coo_array((matrices.ravel(), (rows, columns)), shape=(count, count)).tocsr()


def _masses(mesh: Mesh, thickness_m: Array, material: Material, count: int) -> Array:
    """Lumped masses and rotary inertias of all displacements."""
    nodal = np.zeros((len(mesh.nodes_m), 6))
    mass, inertia = shell_masses(mesh.nodes_m, mesh.quads, thickness_m, material)
    np.add.at(nodal[:, 0], mesh.quads, mass)
    np.add.at(nodal[:, 3], mesh.quads, inertia)
    np.add.at(nodal[:, 0], mesh.hexes, solid_masses(mesh.nodes_m, mesh.hexes, material))
    nodal[:, 1:3] = nodal[:, :1]
    nodal[:, 4:6] = nodal[:, 3:4]
    return nodal.reshape(count)


def _springs(mesh: Mesh, count: int) -> Array:
    springs = np.zeros((len(mesh.nodes_m), 6))
    for pad in mesh.pads:
        springs[pad.nodes, :3] += np.array(pad.stiffness_n_per_m) / len(pad.nodes)
    return springs.reshape(count)


def _symmetric(matrix: csr_array) -> csc_array:
    """The matrix without rounding's unsymmetry and without stored zeros."""
    result = ((matrix + matrix.T) / 2).tocsc()
    result.eliminate_zeros()
    return csc_array(result)


def _own_rows(ties: csc_array) -> NDArray[np.int64]:
    """For each independent displacement the row of `ties` that holds nothing but it, with 1."""
    rows = ties.tocsr()
    single = np.diff(rows.indptr) == 1
    lines = np.flatnonzero(single)
    values, columns = rows.data[rows.indptr[lines]], rows.indices[rows.indptr[lines]]
    own = np.full(rows.shape[1], -1)
    exact = values == 1.0
    own[columns[exact][::-1]] = lines[exact][::-1]
    return own


def _independent(ties: csr_array, node: int) -> Cells:
    block = ties[6 * node : 6 * node + 6]
    return np.asarray(block.indices, dtype=np.int64)
