"""The outside of a mesh as flat quads, for drawing."""

from __future__ import annotations

import numpy as np

from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.shell import Cells

# Faces of a hexahedron whose corners go round the bottom, then round the top.
_FACES = ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def outside(mesh: Mesh) -> tuple[Cells, Cells]:
    """Quads of the shells and those faces of hexahedra that no other one touches.

    Returns
    -------
    faces : Cells, shape (faces, 4)
    regions : Cells, shape (faces,)
        Region of each shell's quad; -1 for hexahedra.
    """
    faces = mesh.hexes[:, np.array(_FACES)].reshape(-1, 4)
    _, first, counts = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    bare = faces[np.sort(first[counts == 1])]
    regions = np.concatenate([mesh.quad_regions, np.full(len(bare), -1)])
    return np.concatenate([mesh.quads, bare]), regions
