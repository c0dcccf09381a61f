"""Structures whose frequencies are known in closed form, and what the elements make of them."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array

from gearsim_sim.model.casing.eigen import free_modes, lowest_modes
from gearsim_sim.model.casing.material import STEEL, Array, Material
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.plates import rectangle
from gearsim_sim.model.casing.ring import RingShape, ring_mesh
from gearsim_sim.model.casing.shell import SHEAR_FACTOR, Cells
from gearsim_sim.model.casing.structure import assemble

_NO_CELLS: Cells = np.zeros((0, 8), dtype=np.int64)
_NO_QUADS: Cells = np.zeros((0, 4), dtype=np.int64)


def mindlin_plate_hz(
    sides_m: tuple[float, float], thickness_m: float, count: int, material: Material = STEEL
) -> Array:
    """Lowest bending frequencies of a simply supported plate after Mindlin (1951), exact.

    With sine shapes of wave number k each frequency is the lower root of

        (D k^2 + S - rho t^3/12 w^2) (S k^2 - rho t w^2) = S^2 k^2,   S = 5/6 G t
    """
    waves = np.arange(1, 4 * count)
    squares = (waves * np.pi / sides_m[0])[:, None] ** 2 + (waves * np.pi / sides_m[1]) ** 2
    k2 = np.sort(squares.ravel())[:count]
    rigidity = material.plane_stress[0, 0] * thickness_m**3 / 12
    shear = SHEAR_FACTOR * material.shear_modulus_pa * thickness_m
    mass = material.density_kg_per_m3 * thickness_m
    inertia = mass * thickness_m**2 / 12
    a = inertia * mass
    b = mass * (rigidity * k2 + shear) + inertia * shear * k2
    c = (rigidity * k2 + shear) * shear * k2 - shear**2 * k2
    return np.asarray(np.sqrt(2 * c / (b + np.sqrt(b**2 - 4 * a * c))) / (2 * np.pi))


def plate_hz(
    sides_m: tuple[float, float],
    thickness_m: float,
    elements: tuple[int, int],
    count: int,
    distortion: float = 0.0,
    material: Material = STEEL,
) -> Array:
    """The same from shell elements; `distortion` shifts inner nodes by that share of an element's side."""
    xs, ys = (np.linspace(0, side, number + 1) for side, number in zip(sides_m, elements, strict=True))
    flat, quads = rectangle(xs, ys)
    x_share, y_share = flat[:, 0] / sides_m[0], flat[:, 1] / sides_m[1]
    wave = np.sin(np.pi * x_share * elements[0] / 2) * np.sin(np.pi * y_share * elements[1] / 2)
    inner = np.sin(np.pi * x_share) * np.sin(np.pi * y_share) > 1e-9
    moved = flat + distortion * (wave * inner)[:, None] * np.array([xs[1], -ys[1]])
    nodes = np.column_stack([moved, np.zeros(len(flat))])
    mesh = Mesh(nodes, quads, np.zeros(len(quads), dtype=np.int64), ("plate",), _NO_CELLS)
    whole = assemble(mesh, np.array([thickness_m]), material, "plate")
    # Bending alone: w, rx, ry; along an edge w and the rotation along it are held (hard support).
    free = np.zeros((len(nodes), 6), dtype=bool)
    free[:, 2:5] = True
    edge_x = (x_share < 1e-9) | (x_share > 1 - 1e-9)
    edge_y = (y_share < 1e-9) | (y_share > 1 - 1e-9)
    free[edge_x | edge_y, 2] = False
    free[edge_x, 3] = False
    free[edge_y, 4] = False
    kept = np.flatnonzero(free)
    stiffness, mass = (csc_array(matrix[kept][:, kept]) for matrix in (whole.stiffness, whole.mass))
    return np.asarray(np.sqrt(lowest_modes(stiffness, mass, count)[0]) / (2 * np.pi))


def thin_ring_hz(radius_m: float, depth_m: float, count: int, material: Material = STEEL) -> Array:
    """In-plane bending frequencies of a free thin ring of square section, waves 2, 3, ... (Hoppe, 1871)."""
    n = np.arange(2, 2 + count)
    speed = np.sqrt(material.youngs_modulus_pa / material.density_kg_per_m3)
    shape = n * (n**2 - 1) / np.sqrt(n**2 + 1)
    return np.asarray(shape * speed * depth_m / (np.sqrt(12) * radius_m**2) / (2 * np.pi))


def ring_hz(radius_m: float, depth_m: float, angles: int, count: int, material: Material = STEEL) -> Array:
    """The same from hexahedra, two across the section: in-plane modes (pairs) of a free ring, each once."""
    shape = RingShape(radius_m - depth_m / 2, radius_m, radius_m + depth_m / 2, depth_m, (0.0, 0.0))
    ring = ring_mesh(shape, np.arange(angles) * 2 * np.pi / angles, 2, depth_m / 2)
    mesh = Mesh(ring.nodes_m, _NO_QUADS, np.zeros(0, dtype=np.int64), (), ring.hexes)
    whole = assemble(mesh, np.zeros(0), material, "ring")
    squares, shapes = free_modes(whole.stiffness, whole.mass, 6 + 4 * count)
    # Out of plane a ring bends and twists too: those modes move along its axis.
    along = np.einsum("ij,ij->j", shapes[2::3], (whole.mass @ shapes)[2::3])
    planar = np.sqrt(np.maximum(squares[along < 0.5], 0)) / (2 * np.pi)
    return np.asarray(planar[planar > 1.0][::2][:count])
