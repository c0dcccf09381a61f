"""Grids of quads for the plates of a box: rectangles, and squares with a round hole."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import grid_cells
from gearsim_sim.model.casing.shell import Cells


def stations(corners_m: tuple[float, ...], size_m: float) -> Array:
    """Coordinates from the first to the last corner, through all, about `size_m` apart."""
    pieces = [
        np.linspace(low, high, max(1, round((high - low) / size_m)) + 1)[:-1]
        for low, high in pairwise(corners_m)
    ]
    return np.concatenate([*pieces, [corners_m[-1]]])


def rectangle(first_m: Array, second_m: Array) -> tuple[Array, Cells]:
    """A plate in its own plane with grid lines at these coordinates: nodes (n, 2), quads (m, 4)."""
    nodes = np.stack(np.meshgrid(first_m, second_m), axis=-1).reshape(-1, 2)
    return nodes, grid_cells(len(second_m) - 1, len(first_m) - 1)


def square_angles(side_m: Array) -> Array:
    """Angles at which nodes lie round a square whose sides carry nodes at `side_m` (from -s to s).

    Rays to evenly spaced angles would crowd at the corners; those of the nodes themselves would crowd at the
    middles of the sides. Even angles keep the ring's elements alike.
    """
    count = len(side_m) - 1
    return -3 * np.pi / 4 + np.arange(4 * count) * (np.pi / 2) / count


def square_with_hole(side_m: Array, radius_m: float, size_m: float) -> tuple[Array, Cells, Cells]:
    """A square about the origin with a round hole.

    Returns
    -------
    nodes_m : Array, shape (n, 2)
    quads : Cells, shape (m, 4)
    rim : Cells, shape (4 (len(side_m) - 1),)
        Nodes on the hole, at `square_angles`.
    """
    angles = square_angles(side_m)
    count = len(angles)
    half = side_m[-1]
    away = np.full(len(side_m) - 1, half)
    along = side_m[:-1]
    outside = np.concatenate(
        [
            np.stack([along, -away], axis=1),
            np.stack([away, along], axis=1),
            np.stack([-along, away], axis=1),
            np.stack([-away, -along], axis=1),
        ]
    )
    inside = radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    steps = max(1, round(float(np.linalg.norm(outside - inside, axis=1).mean()) / size_m))
    share = np.linspace(0, 1, steps + 1)[:, None, None]
    nodes = ((1 - share) * inside + share * outside).reshape(-1, 2)
    row, column = np.divmod(grid_cells(steps, count), count + 1)
    return nodes, (row * count + column % count)[:, [0, 3, 2, 1]], np.arange(count)
