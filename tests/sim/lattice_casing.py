"""A casing of springs and masses, 300 degrees of freedom, reduced after Craig and Bampton in plain numpy."""

from functools import cache
from itertools import combinations

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from gearsim_sim.model.casing.reduced import ReducedCasing, Site, modal_damping

GRID = (6, 4, 4)  # nodes along x, y, z of a hollow box
SIZE_M = (0.35, 0.25, 0.2)
SPRING, MOUNT, SEAT = 1.5e8, 4e5, 3e8  # [N/m] between neighbours, to the ground, from a bore to the wall
NODE_KG, BORE_KG, BORE_KG_M2 = 0.2, 1.2, 1e-3
DAMPING = 0.04
BORES = ((0.12, 0.12, 0.0), (0.12, 0.12, 0.2), (0.23, 0.12, 0.0), (0.23, 0.12, 0.2))


def rigid(point, center):
    """Displacement of a point per (ux uy uz rx ry rz) of a body about `center`."""
    x, y, z = np.subtract(point, center)
    return np.array([[1, 0, 0, 0, z, -y], [0, 1, 0, -z, 0, x], [0, 0, 1, y, -x, 0]], float)


@cache
def full():
    """Mass, stiffness and nodes; the first 24 coordinates are the four bore centres."""
    steps = [np.linspace(0, size, count) for size, count in zip(SIZE_M, GRID, strict=True)]
    places = np.array([
        (x, y, z)
        for i, x in enumerate(steps[0]) for j, y in enumerate(steps[1]) for k, z in enumerate(steps[2])
        if 0 in (i, j, k) or (i, j, k)[0] == GRID[0] - 1 or j == GRID[1] - 1 or k == GRID[2] - 1
    ])  # fmt: skip
    size = 24 + 3 * len(places)
    at = 24 + 3 * np.arange(len(places))
    mass = np.diag([*([BORE_KG] * 3 + [BORE_KG_M2] * 3) * 4, *[NODE_KG] * (size - 24)])
    stiffness = np.zeros((size, size))

    def spring(value, direction, first, second=None):
        """Along a direction between two matrices of rows (3, size)."""
        row = direction @ (first if second is None else first - second)
        stiffness[...] += value * np.outer(row, row)

    def node(index):
        rows = np.zeros((3, size))
        rows[:, at[index] : at[index] + 3] = np.eye(3)
        return rows

    reach = 1.5 * max(one[1] - one[0] for one in steps)
    for a, b in combinations(range(len(places)), 2):
        way = places[b] - places[a]
        length = np.linalg.norm(way)
        if length < reach:
            spring(SPRING * (1 + 0.1 * np.sin(a + 2 * b)), way / length, node(a), node(b))
    for number, bore in enumerate(BORES):
        for index in np.argsort(np.linalg.norm(places - bore, axis=1))[:6]:
            rows = np.zeros((3, size))
            rows[:, 6 * number : 6 * number + 6] = rigid(places[index], bore)
            for direction in np.eye(3):
                spring(SEAT, direction, rows, node(index))
    for index in np.argsort(places[:, 1])[: GRID[0] * GRID[2]]:
        for direction in np.eye(3):
            spring(MOUNT, direction, node(index))
    return mass, stiffness, places


@cache
def lattice(modes=100):
    """Craig and Bampton's reduction with so many modes, with sites on two walls."""
    mass, stiffness, places = full()
    inner = slice(24, None)
    squares, held = eigh(stiffness[inner, inner], mass[inner, inner])
    factor = cho_factor(stiffness[inner, inner])
    follow = -cho_solve(factor, stiffness[inner, :24])
    basis = np.zeros((len(mass), 24 + modes))
    basis[:24, :24], basis[inner, :24] = np.eye(24), follow
    basis[inner, 24:] = held[:, :modes]
    own_mass, own_stiffness = basis.T @ mass @ basis, basis.T @ stiffness @ basis
    own_stiffness[:24, 24:], own_stiffness[24:, :24] = 0.0, 0.0
    # The modes left out follow the masters: q_k = -(phi_k^T M u'') / w_k^2.
    left = held[:, modes:] / squares[modes:]
    correction = -left @ (held[:, modes:].T @ (mass[inner, :24] + mass[inner, inner] @ follow))
    rows = 3 * np.array([len(places) // 3, 2 * len(places) // 3]) + np.array([1, 0])
    sites = tuple(
        Site(
            name,
            direction,
            tuple(places[row // 3].tolist()),
            basis[24 + row],
            correction[row],
        )
        for name, direction, row in zip(
            ("wall_y", "wall_x"), ((0.0, 1.0, 0.0), (1.0, 0.0, 0.0)), rows, strict=True
        )
    )
    return ReducedCasing(
        name="lattice",
        masters=("b1", "b2", "b3", "b4"),
        positions_m=np.array(BORES),
        mass=own_mass,
        stiffness=own_stiffness,
        damping=modal_damping(own_mass, own_stiffness, DAMPING),
        sites=sites,
        valid_hz=float(np.sqrt(squares[modes]) / (2 * np.pi)),
    ), rows + 24
