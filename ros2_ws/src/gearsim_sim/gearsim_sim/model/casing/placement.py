"""Where the points of a measured modal test lie on a casing's mesh."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, load_yaml
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.mesh import Mesh
from gearsim_sim.model.casing.modal_test import TestPlan
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.universal_file import Direction, Measured
from gearsim_sim.model.casing.user_casing import Position
from gearsim_sim.params.fields import Strict

# Points lie on plates' outer sides, nodes on their middle planes, at most so far apart along a plate.
REACH_M = 0.01
_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254}
Axis = Literal["x", "y", "z", "-x", "-y", "-z"]


class Placement(Strict):
    """How a test's coordinates become those of the casing, and what its file does not tell."""

    length_unit: Literal["m", "cm", "mm", "in"] | None = None
    """Of the file's coordinates, where it has no data set 164."""
    response: Literal["displacement", "velocity", "acceleration"] | None = None
    """What the file's responses over force are, where it does not say."""
    axes: tuple[Axis, Axis, Axis] = ("x", "y", "z")
    """Along which of the casing's directions the file's x, y and z lie."""
    origin: Position = (0.0, 0.0, 0.0)
    """Where the file's origin lies in the casing."""
    reach: Annotated[float, Si("m", gt=0)] = REACH_M
    """How far a point may be off the nearest node."""
    points: Annotated[dict[int, Position], Field(default_factory=dict)]
    """Places in the casing's axes, of points that the file gives none or other ones."""

    @property
    def turn(self) -> Array:
        """The casing's directions of the file's axes, by columns."""
        columns = [np.eye(3)["xyz".index(axis[-1])] * (-1.0 if axis[0] == "-" else 1.0) for axis in self.axes]
        return np.array(columns).T


def load_placement(path: Path | None) -> Placement:
    """A placement from its YAML file; without one the file's coordinates are the casing's."""
    if path is None:
        return Placement(points={})
    placement = load_yaml(Placement, path)
    if np.linalg.det(placement.turn) < 0.5:
        expected = "three directions at right angles, right-handed"
        raise InputError(str(path), "axes", ", ".join(placement.axes), expected)
    return placement


def plan_of(measured: Measured, placement: Placement, mesh: Mesh) -> TestPlan:
    """The plan that a test followed, at the nodes nearest to its points.

    Raises
    ------
    InputError
        If a point has no place, the unit of length is not known, or points lie off the mesh.
    """
    nodes = _nodes(measured, placement, mesh)

    def of(directions: Sequence[Direction]) -> tuple[Cells, Array]:
        found = np.array([nodes[one.point] for one in directions], dtype=np.int64)
        own = [measured.turns.get(one.point, np.eye(3))[:, one.axis] for one in directions]
        return found, np.array(own).reshape(-1, 3) @ placement.turn.T

    return TestPlan(*of(measured.points), *of(measured.references))


def _nodes(measured: Measured, placement: Placement, mesh: Mesh) -> dict[int, int]:
    used = sorted({one.point for one in (*measured.points, *measured.references)})
    found, off = {}, {}
    for point in used:
        place = _place(point, measured, placement)
        found[point], distance = mesh.nearest(place)
        if distance > placement.reach:
            off[point] = (distance, place)
    if off:
        worst = max(off, key=lambda point: off[point][0])
        distance, place = off[worst]
        at = ", ".join(f"{1e3 * value:.4g}" for value in place)
        what = (
            f"{len(off)} of {len(used)} off the casing (point {worst} at {at} mm by {1e3 * distance:.4g} mm)"
        )
        expected = f"at most {1e3 * placement.reach:g} mm to a node; --placement turns, moves and scales"
        raise InputError(measured.where, "points", what, expected)
    return found


def _place(point: int, measured: Measured, placement: Placement) -> Array:
    """Of a point in the casing's axes [m]."""
    if point in placement.points:
        return np.array(placement.points[point])
    if not measured.places:
        expected = "coordinates of the points (data set 15 or 2411, or `points` in --placement)"
        raise InputError(measured.where, "geometry", "none", expected)
    if point not in measured.places:
        raise InputError(
            measured.where, f"point {point}", "no coordinates", "those of every point that was used"
        )
    metres = measured.metres if placement.length_unit is None else _UNITS[placement.length_unit]
    if metres is None:
        expected = "a data set 164, or `length_unit` in --placement"
        raise InputError(measured.where, "unit of length", "none", expected)
    return np.asarray(np.array(placement.origin) + placement.turn @ (metres * measured.places[point]))
