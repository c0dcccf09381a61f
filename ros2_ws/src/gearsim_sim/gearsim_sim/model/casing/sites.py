"""Where sensors may sit on a casing: named places with a direction, found as nodes of the mesh."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.geometry import MASTERS, bore_centres_m
from gearsim_sim.model.casing.params import CasingParams
from gearsim_sim.model.casing.reduced import Site
from gearsim_sim.model.casing.reduction import Reduction
from gearsim_sim.model.casing.ring_housing import RingHousing
from gearsim_sim.model.casing.structure import MeshedStructure

_AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class SitePlace:
    """A sensor's name, place [m] and direction (a unit vector); `grid` stands for a place."""

    name: str
    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    grid: int | None = None
    """Number of the node in a deck that `gearsim casing build --deck` writes, from 1."""


def default_sites(params: CasingParams | RingHousing) -> tuple[SitePlace, ...]:
    """Sites that every casing, or every housing, has."""
    return _housing_sites(params) if isinstance(params, RingHousing) else _box_sites(params)


def _box_sites(params: CasingParams) -> tuple[SitePlace, ...]:
    """Sites of a box.

    `b1_x`, `b1_y`, ...: on the ring that holds the bearing, outside and above the bore (in the lumped models
    the pedestal bears these names); `b1_top_y`, ...: on the upper edge above the bearing, where the thesis
    has its accelerometer (5.2); the middles of floor and walls, each across its plate.
    """
    box, rings = params.box, params.rings
    top = box.height_m - box.shaft_height_m
    middle = top - box.height_m / 2
    radius = (rings.bore_radius_m + rings.outer_radius_m) / 2
    found = []
    for name in MASTERS:
        x, _, z = bore_centres_m(params)[name]
        outside = z + np.sign(z) * rings.thickness_m / 2
        found += [SitePlace(f"{name}_{axis}", (x, radius, outside), _AXES[axis]) for axis in "xy"]
        found.append(SitePlace(f"{name}_top_y", (x, top, z), _AXES["y"]))
    found.append(SitePlace("floor_y", (0.0, -box.shaft_height_m, 0.0), _AXES["y"]))
    for name, sign in (("input", -1), ("output", 1)):
        found.append(SitePlace(f"side_{name}_x", (sign * box.length_m / 2, middle, 0.0), _AXES["x"]))
    for name, sign in (("a", -1), ("b", 1)):
        found.append(SitePlace(f"end_{name}_z", (0.0, middle, sign * box.width_m / 2), _AXES["z"]))
    return tuple(found)


def _housing_sites(params: RingHousing) -> tuple[SitePlace, ...]:
    """Sites of a planetary stage's housing.

    `ring_top_y`, `ring_side_x`: on the wall over the ring gear, as on the measured rig (thesis 7.3);
    `shell_top_y`: on the wall beside it; `sun_end_z`, `carrier_end_z`: on the end walls, half-way between
    bore and cylinder; `saddle_y`: on the floor's edge of a saddle.
    """
    radius, half = params.cylinder.radius_m, params.cylinder.length_m / 2
    beside = (params.seat.width_m / 2 + half) / 2
    found = [
        SitePlace("ring_top_y", (0.0, radius, 0.0), _AXES["y"]),
        SitePlace("ring_side_x", (radius, 0.0, 0.0), _AXES["x"]),
        SitePlace("shell_top_y", (0.0, radius, beside), _AXES["y"]),
    ]
    for name, sign, bore in (
        ("sun", 1, params.ends.sun_bore_radius_m),
        ("carrier", -1, params.ends.carrier_bore_radius_m),
    ):
        found.append(SitePlace(f"{name}_end_z", (0.0, (bore + radius) / 2, sign * half), _AXES["z"]))
    low = (0.0, -params.saddles.height_m, params.saddles.spacing_m / 2)
    return (*found, SitePlace("saddle_y", low, _AXES["y"]))


def parse_site(text: str) -> SitePlace:
    """A site as people write it: `NAME:X,Y,Z:DIRECTION` in metres; direction x, -y, ... or three numbers.

    `NAME:GRID:DIRECTION` takes the node of that number.
    """
    expected = "NAME:X,Y,Z:DIRECTION as in top:0.05,0.1,0:y, or a node's number in place of X,Y,Z"
    pieces = text.split(":")
    if len(pieces) != 3 or not pieces[0].strip():
        raise InputError("sensor", "", text, expected)
    name, place, way = (piece.strip() for piece in pieces)
    grid = int(place) if place.isdecimal() else None
    position = (math.nan,) * 3 if grid is not None else _three(text, place, expected)
    axis, sign = way.lstrip("+-"), -1.0 if way.startswith("-") else 1.0
    direction = _AXES.get(axis) or _three(text, way, expected)
    scaled = np.array(direction) * (sign if axis in _AXES else 1.0)
    length = float(np.linalg.norm(scaled))
    if length == 0:
        raise InputError("sensor", name, text, "a direction other than 0,0,0")
    x, y, z = (float(value) for value in scaled / length)
    return SitePlace(name, position, (x, y, z), grid)


def _three(text: str, numbers: str, expected: str) -> tuple[float, float, float]:
    try:
        x, y, z = (float(number) for number in numbers.split(","))
    except ValueError:
        raise InputError("sensor", "", text, expected) from None
    if not np.isfinite([x, y, z]).all():
        raise InputError("sensor", "", text, expected)
    return x, y, z


def site_nodes(structure: MeshedStructure, places: Iterable[SitePlace], reach_m: float) -> list[int]:
    """Node of each site; InputError if there is none within `reach_m` of a place, or a name is used twice."""
    nodes, names = [], set()
    for place in places:
        node = _nearest(structure, place, reach_m) if place.grid is None else _numbered(structure, place)
        if place.name in names:
            raise InputError(structure.name, "sensor", place.name, "each name once")
        names.add(place.name)
        nodes.append(node)
    return nodes


def _nearest(structure: MeshedStructure, place: SitePlace, reach_m: float) -> int:
    node, distance = structure.mesh.nearest(np.array(place.position_m))
    if distance > reach_m:
        at = ", ".join(f"{value:g}" for value in place.position_m)
        what = f"({at}) m, {1000 * distance:.0f} mm off the nearest node"
        raise InputError(structure.name, f"sensor {place.name}", what, f"at most {1000 * reach_m:.3g} mm")
    return node


def _numbered(structure: MeshedStructure, place: SitePlace) -> int:
    count = len(structure.mesh.nodes_m)
    if place.grid is None or not 1 <= place.grid <= count:
        raise InputError(structure.name, f"sensor {place.name}", f"node {place.grid}", f"1 to {count}")
    return place.grid - 1


def recover_sites(
    structure: MeshedStructure, reduction: Reduction, places: Iterable[SitePlace], reach_m: float
) -> tuple[Site, ...]:
    """Recovery rows of sites, each at the node nearest to its place."""
    places = tuple(places)
    found = []
    for place, node in zip(places, site_nodes(structure, places, reach_m), strict=True):
        rows, correction = reduction.rows(structure.row(node, np.array(place.direction)))
        x, y, z = (float(value) for value in structure.mesh.nodes_m[node])
        found.append(Site(place.name, place.direction, (x, y, z), rows, correction))
    return tuple(found)
