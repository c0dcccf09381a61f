"""The mesh of a planetary stage's housing: a cylinder, two end walls with a bore each, two saddles.

x runs across, y upward, z along the shafts, as in the casing of parallel shafts; the origin lies in the
middle of the ring gear. Masters are `ring` (the ring gear is stiff: the cylinder's seat moves with it as a
rigid body), `sun` (the bore in the end wall at positive z) and `carrier` (that at negative z).
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si
from gearsim_sim.model.casing.material import Array, Material
from gearsim_sim.model.casing.mesh import Mesh, Pad, Rigid, grid_cells, merged
from gearsim_sim.model.casing.params import Length, Steel
from gearsim_sim.model.casing.plates import stations
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.params.fields import Strict

RING_HOUSING = "ring_housing"
MASTERS = ("ring", "sun", "carrier")
REGIONS = ("cylinder", "ends", "bosses", "saddles")


class Cylinder(Strict):
    """The wall round the gears, by its middle surface."""

    radius_m: Annotated[Length, Field(alias="radius")]
    """Of the middle of the wall."""
    length_m: Annotated[Length, Field(alias="length")]
    """Between the end walls."""
    thickness_m: Annotated[Length, Field(alias="thickness")]
    """Of the wall."""


class Ends(Strict):
    """The end walls, each with a bore in a thick boss."""

    thickness_m: Annotated[Length, Field(alias="thickness")]
    """Of both."""
    sun_bore_radius_m: Annotated[Length, Field(alias="sun_bore_radius")]
    """Of the bearing of the sun's shaft."""
    carrier_bore_radius_m: Annotated[Length, Field(alias="carrier_bore_radius")]
    """Of the bearing of the carrier."""
    boss_width_m: Annotated[Length, Field(alias="boss_width")]
    """Of the thick rim round a bore."""
    boss_thickness_m: Annotated[Length, Field(alias="boss_thickness")]
    """Of that rim."""


class Seat(Strict):
    """Where the ring gear sits, in the middle of the cylinder."""

    width_m: Annotated[Length, Field(alias="width")]
    """Along the shafts."""


class Saddles(Strict):
    """Plates across the shafts between cylinder and floor."""

    height_m: Annotated[Length, Field(alias="height")]
    """From the floor to the shafts."""
    spacing_m: Annotated[Length, Field(alias="spacing")]
    """Between both, along the shafts."""
    half_angle_rad: Annotated[float, Si("rad", gt=0, lt=1.5), Field(alias="half_angle")]
    """How far they reach round the cylinder from its lowest line, to either side."""
    thickness_m: Annotated[Length, Field(alias="thickness")]
    """Of each."""


class Feet(Strict):
    """Springs to the ground under each end of each saddle; stiffness 0 means hung up freely."""

    vertical_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="vertical_stiffness")]
    """Of one foot, along y."""
    lateral_n_per_m: Annotated[float, Si("N/m", ge=0), Field(alias="lateral_stiffness")]
    """Of one foot, along x and z."""


class Fineness(Strict):
    """How fine the mesh is."""

    plate_size_m: Annotated[Length, Field(alias="plate_size")]
    """Side of the quads, about."""


class RingHousing(Strict):
    """A whole housing."""

    kind: Literal["ring_housing"]
    """What the description is of."""
    name: str
    """Of the housing."""
    description: str = ""
    """What it is."""
    steel: Steel
    cylinder: Cylinder
    ends: Ends
    seat: Seat
    saddles: Saddles
    pads: Feet
    mesh: Fineness
    damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Of every mode, of critical."""

    @property
    def material(self) -> Material:
        """The steel as the elements need it."""
        steel = self.steel
        return Material(steel.youngs_modulus_pa, steel.poisson_ratio, steel.density_kg_per_m3)

    @property
    def thicknesses_m(self) -> Array:
        """Of each of `REGIONS`."""
        ends = self.ends
        return np.array(
            [self.cylinder.thickness_m, ends.thickness_m, ends.boss_thickness_m, self.saddles.thickness_m]
        )

    def check(self, where: str) -> None:
        """InputError unless bores are in their walls, the seat between the saddles, these under it all."""
        cylinder, ends, saddles = self.cylinder, self.ends, self.saddles
        widest = cylinder.radius_m - ends.boss_width_m
        limits = (
            ("ends.sun_bore_radius", ends.sun_bore_radius_m, 0.0, widest),
            ("ends.carrier_bore_radius", ends.carrier_bore_radius_m, 0.0, widest),
            ("saddles.spacing", saddles.spacing_m, self.seat.width_m, cylinder.length_m),
            ("saddles.height", saddles.height_m, cylinder.radius_m, math.inf),
        )
        for field, value, low, high in limits:
            if not low < value < high:
                raise InputError(where, field, f"{value:g} m", f"between {low:g} m and {high:g} m")


def housing_mesh(params: RingHousing) -> Mesh:
    """Mesh the housing; rings of nodes lie at the same angles in all its parts."""
    angles = _angles(params)
    zs = _stations_along(params)
    parts = [_cylinder(params, angles, zs), *(_end(params, angles, sign) for sign in (1, -1))]
    half = params.saddles.spacing_m / 2
    parts += [_saddle(params, angles, sign * half) for sign in (1, -1)]
    firsts = np.cumsum([0] + [len(nodes) for nodes, _, _ in parts])
    stacked = np.concatenate([nodes for nodes, _, _ in parts])
    cells = np.concatenate([quads + first for (_, quads, _), first in zip(parts, firsts, strict=False)])
    nodes, quads = merged(stacked, cells)
    rigids, masters, centres = [], {}, list[Array]()
    for name, centre, held in _held(params, nodes):
        masters[name] = len(nodes) + len(centres)
        centres.append(centre)
        rigids.append(Rigid(masters[name], held))
    return Mesh(
        nodes_m=np.concatenate([nodes, centres]),
        quads=quads,
        quad_regions=np.concatenate([regions for _, _, regions in parts]),
        regions=REGIONS,
        hexes=np.zeros((0, 8), dtype=np.int64),
        rigids=tuple(rigids),
        pads=_feet(params, nodes),
        masters=masters,
    )


def _angles(params: RingHousing) -> Array:
    """Round the cylinder from its lowest line on, one turn; nodes at both ends of the saddles."""
    reach, size = params.saddles.half_angle_rad, params.mesh.plate_size_m / params.cylinder.radius_m
    below = stations((-reach, 0.0, reach), size)
    above = stations((reach, math.pi, 2 * math.pi - reach), size)
    return np.concatenate([below, above[1:-1]])


def _stations_along(params: RingHousing) -> Array:
    """Along the cylinder: at its ends, the saddles, the seat's edges and middle."""
    half, seat, saddle = (
        value / 2 for value in (params.cylinder.length_m, params.seat.width_m, params.saddles.spacing_m)
    )
    return stations((-half, -saddle, -seat, 0.0, seat, saddle, half), params.mesh.plate_size_m)


def _round(radius_m: Array | float, angles: Array) -> Array:
    """Points at angles from the lowest line, anticlockwise; (angles, 2)."""
    return np.stack([radius_m * np.sin(angles), -radius_m * np.cos(angles)], axis=-1)


def _closed(rows: int, columns: int) -> Cells:
    """Quads of rows of nodes that each close upon themselves."""
    cells = grid_cells(rows, columns)
    row, column = np.divmod(cells, columns + 1)
    return np.asarray(row * columns + column % columns)


def _cylinder(params: RingHousing, angles: Array, zs: Array) -> tuple[Array, Cells, Cells]:
    circle = _round(params.cylinder.radius_m, angles)
    nodes = np.concatenate([np.column_stack([circle, np.full(len(circle), z)]) for z in zs])
    quads = _closed(len(zs) - 1, len(angles))
    return nodes, quads, np.zeros(len(quads), dtype=np.int64)


def _end(params: RingHousing, angles: Array, sign: int) -> tuple[Array, Cells, Cells]:
    """An end wall: rings from its bore to the cylinder, the first ones being the boss."""
    ends, outer = params.ends, params.cylinder.radius_m
    bore = ends.sun_bore_radius_m if sign > 0 else ends.carrier_bore_radius_m
    radii = stations((bore, bore + ends.boss_width_m, outer), params.mesh.plate_size_m)
    z = sign * params.cylinder.length_m / 2
    nodes = np.concatenate(
        [np.column_stack([_round(float(radius), angles), np.full(len(angles), z)]) for radius in radii]
    )
    quads = _closed(len(radii) - 1, len(angles))
    boss = np.repeat(radii[1:] < bore + ends.boss_width_m + 1e-9, len(angles))
    return nodes, quads, np.where(boss, REGIONS.index("bosses"), REGIONS.index("ends"))


def _saddle(params: RingHousing, angles: Array, z: float) -> tuple[Array, Cells, Cells]:
    """A plate between an arc of the cylinder and the straight line of the floor."""
    reach = params.saddles.half_angle_rad
    arc = _round(params.cylinder.radius_m, angles[np.abs(angles) <= reach + 1e-9])
    line = np.column_stack([arc[:, 0], np.full(len(arc), -params.saddles.height_m)])
    rows = max(2, round((params.saddles.height_m - params.cylinder.radius_m) / params.mesh.plate_size_m))
    shares = np.linspace(0, 1, rows + 1)
    flat = np.concatenate([(1 - share) * arc + share * line for share in shares])
    quads = grid_cells(rows, len(arc) - 1)
    return (
        np.column_stack([flat, np.full(len(flat), z)]),
        quads,
        np.full(len(quads), REGIONS.index("saddles")),
    )


def _held(params: RingHousing, nodes_m: Array) -> list[tuple[str, Array, Cells]]:
    """Each master: its place, and the nodes that move with it as a rigid body."""
    radius, half = np.hypot(nodes_m[:, 0], nodes_m[:, 1]), params.cylinder.length_m / 2
    on_cylinder = np.abs(radius - params.cylinder.radius_m) < 1e-6
    seat = on_cylinder & (np.abs(nodes_m[:, 2]) <= params.seat.width_m / 2 + 1e-9)
    found = [("ring", np.zeros(3), np.flatnonzero(seat))]
    for name, sign, bore in (
        ("sun", 1, params.ends.sun_bore_radius_m),
        ("carrier", -1, params.ends.carrier_bore_radius_m),
    ):
        edge = (np.abs(radius - bore) < 1e-6) & (np.abs(nodes_m[:, 2] - sign * half) < 1e-9)
        found.append((name, np.array([0.0, 0.0, sign * half]), np.flatnonzero(edge)))
    return found


def _feet(params: RingHousing, nodes_m: Array) -> tuple[Pad, ...]:
    """The outer third of each end of each saddle's lower edge."""
    pads = params.pads
    if not pads.vertical_n_per_m and not pads.lateral_n_per_m:
        return ()
    stiffness = (pads.lateral_n_per_m, pads.vertical_n_per_m, pads.lateral_n_per_m)
    lowest = np.abs(nodes_m[:, 1] + params.saddles.height_m) < 1e-9
    wide = params.cylinder.radius_m * math.sin(params.saddles.half_angle_rad)
    found = []
    for number, (x, z) in enumerate(((-1, -1), (-1, 1), (1, -1), (1, 1)), 1):
        here = lowest & (x * nodes_m[:, 0] > 2 / 3 * wide) & (z * nodes_m[:, 2] > 0)
        found.append(Pad(f"pad_{number}", np.flatnonzero(here), stiffness))
    return tuple(found)
