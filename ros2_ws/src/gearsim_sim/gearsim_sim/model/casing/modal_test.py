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
    """Points to hit across their plates; at three of them, of x, y and z, accelerometers."""

    __test__ = False  # no test of pytest's

    nodes: Cells
    """Of the mesh, shape (points,)."""
    directions: Array
    """Unit vectors, shape (points, 3)."""
    references: Cells
    """Indices into `nodes`."""

    def rows(self, model: FreeModel) -> Array:
        """Displacements of a model's modes at the points, shape (points, modes)."""
        pick = [model.structure.row(node, way) @ model.shapes for node, way in self._places()]
        return np.concatenate(pick)

    def _places(self) -> list[tuple[int, Array]]:
        return list(zip(self.nodes.tolist(), self.directions, strict=True))


@dataclass(frozen=True)
class ModalTest:
    """Frequency responses, accelerations at the references over forces at the points."""

    __test__ = False

    frequencies_hz: Array
    """Evenly spaced, shape (lines,)."""
    accelerance: NDArray[np.complex128]
    """[1/kg], shape (references, points, lines)."""


def plan_test(model: FreeModel, points: int = POINTS) -> TestPlan:
    """Points spread over the plates as far from each other as possible, and references that see all modes.

    From the model before the test alone, as a laboratory would plan it (pretest analysis, thesis 3.2.2.1).
    """
    mesh = model.structure.mesh
    nodes, normals = _plate_nodes(mesh)
    chosen = _spread(mesh.nodes_m[nodes], points)
    axis = np.argmax(np.abs(normals[chosen]), axis=1)
    plan = TestPlan(nodes[chosen], np.eye(3)[axis], np.arange(points))
    seen = np.log(np.abs(plan.rows(model)) + 1e-12).mean(axis=1)
    best = [int(np.argmax(np.where(axis == k, seen, -np.inf))) for k in range(3)]
    return TestPlan(plan.nodes, plan.directions, np.array(best))


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
