"""A modal test with a roving hammer: where to hit and measure, and what was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.shell import Cells, local_frames
from gearsim_sim.model.casing.updating import FreeModel

POINTS = 89  # of the thesis's test (3.3)


@dataclass(frozen=True)
class TestPlan:
    """Points to hit and where accelerometers sit, or the other way round: by reciprocity that is the same."""

    __test__ = False  # no test of pytest's

    nodes: Cells
    """Of the mesh, shape (points,)."""
    directions: Array
    """Unit vectors, shape (points, 3)."""
    reference_nodes: Cells
    """Shape (references,)."""
    reference_directions: Array
    """Shape (references, 3)."""

    @property
    def references(self) -> Cells:
        """Which point each reference is, -1 where it is none; shape (references,)."""
        places = zip(self.reference_nodes, self.reference_directions, strict=True)
        same = [(self.nodes == node) & (self.directions @ way > 1 - 1e-9) for node, way in places]
        return np.array([int(np.argmax(one)) if one.any() else -1 for one in same], dtype=np.int64)

    def rows(self, model: FreeModel) -> Array:
        """Displacements of a model's modes at the points, shape (points, modes)."""
        return _rows(model, self.nodes, self.directions)

    def reference_rows(self, model: FreeModel) -> Array:
        """The same at the references, shape (references, modes)."""
        return _rows(model, self.reference_nodes, self.reference_directions)


@dataclass(frozen=True)
class ModalTest:
    """Frequency responses, accelerations at the references over forces at the points."""

    __test__ = False

    frequencies_hz: Array
    """Evenly spaced, shape (lines,)."""
    accelerance: NDArray[np.complex128]
    """[1/kg], shape (references, points, lines)."""


def _rows(model: FreeModel, nodes: Cells, directions: Array) -> Array:
    picked = [
        model.structure.row(node, way) @ model.shapes
        for node, way in zip(nodes.tolist(), directions, strict=True)
    ]
    return np.concatenate([np.zeros((0, model.shapes.shape[1])), *picked])


def plan_test(model: FreeModel, points: int = POINTS) -> TestPlan:
    """Points across plates, as far from each other as possible, and three references that see all modes.

    From the model before the test alone, as a laboratory would plan it (pretest analysis, thesis 3.2.2.1).
    """
    mesh = model.structure.mesh
    nodes, normals = _plate_nodes(mesh)
    chosen = _spread(mesh.nodes_m[nodes], points)
    axis = np.argmax(np.abs(normals[chosen]), axis=1)
    places, ways = nodes[chosen], np.eye(3)[axis]
    seen = np.log(np.abs(_rows(model, places, ways)) + 1e-12).mean(axis=1)
    best = [int(np.argmax(np.where(axis == k, seen, -np.inf))) for k in range(3)]
    return TestPlan(places, ways, places[best], ways[best])


def _plate_nodes(mesh: Mesh) -> tuple[Cells, Array]:
    """Nodes that belong to one plate alone, with its normal."""
    frames, _ = local_frames(mesh.nodes_m[mesh.quads])
    total, count = np.zeros((len(mesh.nodes_m), 3)), np.zeros(len(mesh.nodes_m))
    np.add.at(total, mesh.quads, np.abs(frames[:, None, 2]))
    np.add.at(count, mesh.quads, 1)
    used = np.flatnonzero(count)
    normals = total[used] / count[used, None]
    flat = normals.max(axis=1) > 0.999
    return used[flat], normals[flat]


def _spread(places_m: Array, count: int) -> Cells:
    """Each next point is the one farthest from all before."""
    chosen = [0]
    distance = np.linalg.norm(places_m - places_m[0], axis=1)
    while len(chosen) < count:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.linalg.norm(places_m - places_m[chosen[-1]], axis=1))
    return np.array(chosen)
