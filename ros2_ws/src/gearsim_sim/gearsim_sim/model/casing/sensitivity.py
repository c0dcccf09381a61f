"""How a casing's own frequencies follow the thickness of its plates, exactly.

A plate of thickness t has the stiffness `t A + t**3 B`, the mass `t M` and the rotary inertia `t**3 J` (see
`shell`), and ties do not depend on t. A mode with K phi = w^2 M phi and unit mass then moves by

    d(w^2)/dt = phi' (A + 3 t^2 B - w^2 (M + 3 t^2 J)) phi        (Fox and Kapoor, 1968)

summed over the elements of a region. Solids and pads do not count.
"""

from __future__ import annotations

import numpy as np

from gearsim_sim.model.casing.material import Array, Material
from gearsim_sim.model.casing.shell import shell_masses, shell_parts
from gearsim_sim.model.casing.structure import MeshedStructure


def thickness_sensitivity(
    structure: MeshedStructure, thickness_m: Array, material: Material, squares: Array, shapes: Array
) -> Array:
    """Relative change of each frequency for a relative change of each region's thickness.

    Parameters
    ----------
    structure : MeshedStructure
    thickness_m : Array, shape (regions,)
        With which it was assembled.
    material : Material
    squares : Array, shape (modes,)
        Squared angular frequencies [rad^2/s^2], above zero.
    shapes : Array, shape (structure.size, modes)
        Mass-normalised.

    Returns
    -------
    Array, shape (modes, regions)
        d ln f / d ln t, without unit.
    """
    mesh = structure.mesh
    thickness = thickness_m[mesh.quad_regions]
    linear, cubic = shell_parts(mesh.nodes_m, mesh.quads, material)
    slope = thickness[:, None, None] * linear + 3 * thickness[:, None, None] ** 3 * cubic
    mass, inertia = shell_masses(mesh.nodes_m, mesh.quads, thickness, material)
    # t d/dt of a mass is the mass, of a rotary inertia three times itself.
    moved = np.repeat(np.stack([mass, 3 * inertia], axis=-1), 3, axis=-1).reshape(len(mesh.quads), 24)
    found = np.zeros((len(squares), len(mesh.regions)))
    for k, square in enumerate(squares):
        nodal = (structure.ties @ shapes[:, k]).reshape(-1, 6)
        local = nodal[mesh.quads].reshape(len(mesh.quads), 24)
        strain = np.einsum("ei,eij,ej->e", local, slope, local, optimize=True)
        energy = strain - square * np.einsum("ei,ei->e", moved, local**2)
        found[k] = np.bincount(mesh.quad_regions, energy, len(mesh.regions)) / (2 * square)
    return found
