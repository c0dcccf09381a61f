"""The mesh of a welded casing from its parameters.

x runs across the shafts, y upward, z along the shafts. The origin lies in the middle between the four bores.
Bearings 1 and 2 (input shaft) are at negative x, 3 and 4 at positive x; 1 and 3 in the end wall at
negative z (`end_a`), 2 and 4 in `end_b`. So the pinion is to the left of the gear, as the signs of the gear
mesh ask for.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Average, Mesh, Pad, Rigid, merged
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.plates import rectangle, square_angles, square_with_hole, stations
from gearsim_sim.model.casing.regions import line, split
from gearsim_sim.model.casing.ring import RingShape, ring_mesh
from gearsim_sim.model.casing.shell import Cells

MASTERS = ("b1", "b2", "b3", "b4")
# Signs of x and z of each bore.
_SIDES = {"b1": (-1, -1), "b2": (-1, 1), "b3": (1, -1), "b4": (1, 1)}


@dataclass
class _Parts:
    """Plates gathered before their common nodes are merged."""

    nodes: list[Array] = field(default_factory=list)
    quads: list[Cells] = field(default_factory=list)
    numbers: list[Cells] = field(default_factory=list)
    names: list[str] = field(default_factory=list)
    count: int = 0

    def add(self, nodes_m: Array, quads: Cells, names: tuple[str, ...], region: Cells) -> int:
        """Add a plate; the number of its first node."""
        first = self.count
        self.nodes.append(nodes_m)
        self.quads.append(quads + first)
        self.numbers.append(region + len(self.names))
        self.names.extend(names)
        self.count += len(nodes_m)
        return first


def bore_centres_m(params: CasingParams) -> dict[str, Array]:
    """Positions of the four bores' centres, by the names of the masters."""
    half, depth = params.rings.bore_spacing_m / 2, params.box.width_m / 2
    return {name: np.array([x * half, 0.0, z * depth]) for name, (x, z) in _SIDES.items()}


def casing_mesh(params: CasingParams) -> Mesh:
    """Mesh the casing; a second or less for the usual 50,000 degrees of freedom."""
    parts, rims = _Parts(), {}
    lines = _grid_lines(params)
    for wall, sign in (("end_a", -1), ("end_b", 1)):
        rims.update(_add_end_wall(parts, params, lines, wall, sign))
    _add_side_walls(parts, params, lines)
    _add_floor(parts, params, lines)
    _add_rim(parts, params, lines)
    stacked, old = np.concatenate(parts.nodes), np.concatenate(parts.quads)
    # Where each stacked node went, so that the holes' edges are still known.
    nodes, moved = merged(stacked, np.arange(len(stacked)))
    rings = {name: moved[rim] for name, rim in rims.items()}
    pads = _pads(params, nodes)
    return _with_rings(
        params, nodes, moved[old], np.concatenate(parts.numbers), tuple(parts.names), rings, pads
    )


def _grid_lines(params: CasingParams) -> tuple[Array, Array, Array]:
    """Coordinates of the walls' grid lines along x, y and z."""
    box, size, side = params.box, params.mesh.plate_size_m, params.rings.spacing_m / 2
    half, low = box.length_m / 2, -box.shaft_height_m
    xs = stations((-half, -2 * side, 0.0, 2 * side, half), size)
    ys = stations((low, -side, side, low + box.height_m), size)
    zs = stations((-box.width_m / 2, box.width_m / 2), size)
    return xs, ys, zs


def _add_end_wall(
    parts: _Parts, params: CasingParams, lines: tuple[Array, Array, Array], wall: str, sign: int
) -> dict[str, Cells]:
    """A wall with two holes; the stacked numbers of the nodes on each hole, by master."""
    xs, ys, _ = lines
    box, side, radius = params.box, params.rings.spacing_m / 2, params.rings.outer_radius_m
    masters = [name for name in MASTERS if _SIDES[name][1] == sign]
    centres = {name: (_SIDES[name][0] * side, 0.0) for name in masters}
    pieces = [_around_squares(xs, ys, side)]
    along = ys[np.abs(ys) <= side + 1e-9]
    nodes, quads, rim = square_with_hole(along, radius, params.mesh.plate_size_m)
    pieces += [(nodes + np.array(centres[name]), quads) for name in masters]
    firsts = np.cumsum([0] + [len(piece[0]) for piece in pieces])
    flat = np.concatenate([piece[0] for piece in pieces])
    cells = np.concatenate([piece[1] + first for piece, first in zip(pieces, firsts, strict=False)])
    straight = {
        "floor_weld": line(1, -box.shaft_height_m),
        "input_weld": line(0, -box.length_m / 2),
        "output_weld": line(0, box.length_m / 2),
    }
    rounds = {f"{name}_weld": (centre, radius) for name, centre in centres.items()}
    names, region = split(wall, flat[cells].mean(axis=1), straight, rounds, params.mesh.weld_width_m)
    first = parts.add(_place(flat, (0, 1), sign * box.width_m / 2), cells, names, region)
    return {name: first + firsts[1 + k] + rim for k, name in enumerate(masters)}


def _around_squares(xs: Array, ys: Array, side: float) -> tuple[Array, Cells]:
    """The end wall without the squares that hold the rings."""
    nodes, quads = rectangle(xs, ys)
    centres = nodes[quads].mean(axis=1)
    inside = (np.abs(centres[:, 0]) < 2 * side) & (np.abs(centres[:, 1]) < side)
    kept = quads[~inside]
    used, cells = np.unique(kept, return_inverse=True)
    return nodes[used], cells.reshape(kept.shape)


def _add_side_walls(parts: _Parts, params: CasingParams, lines: tuple[Array, Array, Array]) -> None:
    _, ys, zs = lines
    box = params.box
    straight = {
        "floor_weld": line(0, -box.shaft_height_m),
        "end_a_weld": line(1, -box.width_m / 2),
        "end_b_weld": line(1, box.width_m / 2),
    }
    flat, cells = rectangle(ys, zs)
    for wall, sign in (("side_input", -1), ("side_output", 1)):
        names, region = split(wall, flat[cells].mean(axis=1), straight, {}, params.mesh.weld_width_m)
        parts.add(_place(flat, (1, 2), sign * box.length_m / 2), cells, names, region)


def _add_floor(parts: _Parts, params: CasingParams, lines: tuple[Array, Array, Array]) -> None:
    xs, _, zs = lines
    box = params.box
    straight = {
        "input_weld": line(0, -box.length_m / 2),
        "output_weld": line(0, box.length_m / 2),
        "end_a_weld": line(1, -box.width_m / 2),
        "end_b_weld": line(1, box.width_m / 2),
    }
    flat, cells = rectangle(xs, zs)
    names, region = split("floor", flat[cells].mean(axis=1), straight, {}, params.mesh.weld_width_m)
    parts.add(_place(flat, (0, 2), -box.shaft_height_m), cells, names, region)


def _add_rim(parts: _Parts, params: CasingParams, lines: tuple[Array, Array, Array]) -> None:
    """The flange: a frame of quads outside the walls, in the plane of their upper edges."""
    width, box = params.rim.width_m, params.box
    if not width:
        return
    xs, _, zs = lines
    steps = max(1, round(width / params.mesh.plate_size_m))
    strip = np.linspace(0, width, steps + 1)[1:]
    wide, deep = (np.concatenate([row[0] - strip[::-1], row, row[-1] + strip]) for row in (xs, zs))
    flat, cells = rectangle(wide, deep)
    centres = flat[cells].mean(axis=1)
    outside = (np.abs(centres[:, 0]) > box.length_m / 2) | (np.abs(centres[:, 1]) > box.width_m / 2)
    used, kept = np.unique(cells[outside], return_inverse=True)
    quads = kept.reshape(-1, 4)
    parts.add(
        _place(flat[used], (0, 2), box.height_m - box.shaft_height_m),
        quads,
        ("rim",),
        np.zeros(len(quads), dtype=np.int64),
    )


def _place(flat: Array, axes: tuple[int, int], at_m: float) -> Array:
    """Plane coordinates put into space: along two axes, at one height of the third."""
    nodes = np.full((len(flat), 3), at_m)
    nodes[:, axes] = flat
    return nodes


def _pads(params: CasingParams, nodes_m: Array) -> tuple[Pad, ...]:
    """One pad under each corner of the floor, named by its signs of x and z."""
    pads, box = params.pads, params.box
    if not pads.vertical_n_per_m and not pads.lateral_n_per_m:
        return ()
    middle_x, middle_z = (
        length / 2 - pads.inset_m - pads.size_m / 2 for length in (box.length_m, box.width_m)
    )
    stiffness = (pads.lateral_n_per_m, pads.vertical_n_per_m, pads.lateral_n_per_m)
    found = []
    on_floor = np.abs(nodes_m[:, 1] + box.shaft_height_m) < 1e-9
    # A pad covers at least one grid line in each direction.
    reach = max(pads.size_m, params.mesh.plate_size_m * 1.5) / 2 + 1e-9
    for name, (x, z) in (("pad_1", (-1, -1)), ("pad_2", (-1, 1)), ("pad_3", (1, -1)), ("pad_4", (1, 1))):
        near = np.abs(nodes_m[:, [0, 2]] - np.array([x * middle_x, z * middle_z])) <= reach
        found.append(Pad(name, np.flatnonzero(on_floor & near.all(axis=1)), stiffness))
    return tuple(found)


def _with_rings(
    params: CasingParams,
    nodes_m: Array,
    quads: Cells,
    quad_regions: Cells,
    regions: tuple[str, ...],
    rims: dict[str, Cells],
    pads: tuple[Pad, ...],
) -> Mesh:
    """The plates with rings in their holes and a master in each bore."""
    rings, side = params.rings, params.rings.spacing_m / 2
    inward = (rings.spacing_m - rings.bore_spacing_m) / 2
    stacked, hexes, rigids, averages, masters = [nodes_m], [], [], [], {}
    count = len(nodes_m)
    for name in MASTERS:
        x, z = _SIDES[name]
        shape = RingShape(
            rings.bore_radius_m,
            rings.disc_radius_m,
            rings.outer_radius_m,
            rings.thickness_m,
            (-x * inward, 0.0),
        )
        rim = rims[name]
        angles = square_angles(np.linspace(-side, side, len(rim) // 4 + 1))
        ring = ring_mesh(shape, angles, int(params.mesh.ring_layers), params.mesh.ring_size_m)
        stacked.append(ring.nodes_m + np.array([x * side, 0.0, z * params.box.width_m / 2]))
        hexes.append(ring.hexes + count)
        averages.extend(_weld(rim, ring.edge + count))
        masters[name] = count + len(ring.nodes_m)
        rigids.append(Rigid(masters[name], ring.bore + count))
        stacked.append(bore_centres_m(params)[name][None])
        count = masters[name] + 1
    return Mesh(
        nodes_m=np.concatenate(stacked),
        quads=quads,
        quad_regions=quad_regions,
        regions=regions,
        hexes=np.concatenate(hexes),
        rigids=tuple(rigids),
        averages=tuple(averages),
        pads=pads,
        masters=masters,
    )


def _weld(rim: Cells, edge: Cells) -> list[Average]:
    """Ties each node of a hole to the ring's outer surface: the column of nodes beside it and the next ones.

    A single column would leave the rotation about itself free.
    """
    ties = []
    for k, node in enumerate(rim):
        beside = (k - 1) % len(rim), (k + 1) % len(rim)
        sources = np.concatenate([edge[k], edge[beside[0]], edge[beside[1]]])
        weights = np.repeat([1.0, 0.5, 0.5], edge.shape[1])
        ties.append(Average(int(node), sources, weights))
    return ties
