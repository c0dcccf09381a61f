"""A casing given by a user's own matrices: a YAML file that names them, their masters and their sensors.

    name: my_casing
    stiffness: {file: K.npz}
    mass: {file: M.mtx}
    damping_ratio: {value: 0.04, unit: "1", source: "assumed"}
    masters:
      b1: {rows: [0, 1, 2, 3, 4, 5], position: [-49 mm, 0 mm, -90 mm]}
    sensors:
      top_y: {rows: [600, 601, 602], direction: [0, 1, 0], position: [0 mm, 120 mm, 0 mm]}

Rows count from 0. With .pch files, whose rows are labelled, `grid: 1001` may stand in place of `rows`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.sparse import csr_array

from gearsim_io.errors import InputError
from gearsim_io.quantities import Si, load_yaml
from gearsim_sim.model.casing.held import connected_or_raise
from gearsim_sim.model.casing.matrix_files import Labelled, read_matrix
from gearsim_sim.model.casing.matrix_health import check_matrices
from gearsim_sim.model.casing.reduced import Site
from gearsim_sim.model.casing.reduction import Reduction
from gearsim_sim.model.casing.shell import Cells
from gearsim_sim.model.casing.structure import Structure
from gearsim_sim.params.fields import Strict

Coordinate = Annotated[float, Si("m")]
Position = tuple[Coordinate, Coordinate, Coordinate]


class MatrixFile(Strict):
    """Where a matrix is."""

    file: Path
    """Relative to the YAML file."""
    name: str = ""
    """In files that hold several."""


class Place(Strict):
    """Rows of the displacements of a node."""

    rows: tuple[int, ...] = ()
    """Counted from 0: ux uy uz rx ry rz of a master, ux uy uz of a sensor."""
    grid: int | None = None
    """In place of rows: the grid point's number, in files with labels."""
    position: Position
    """Where it is."""


class SensorPlace(Place):
    """Rows of a sensor's displacements, and the direction it measures."""

    direction: tuple[float, float, float]
    """Of any length but 0."""


class UserCasing(Strict):
    """The YAML file."""

    name: str
    description: str = ""
    stiffness: MatrixFile
    mass: MatrixFile
    damping_ratio: Annotated[float, Si("", ge=0, lt=1)]
    """Of every mode, of critical."""
    masters: Annotated[dict[str, Place], Field(min_length=1)]
    sensors: Annotated[dict[str, SensorPlace], Field(default_factory=dict)]


@dataclass(frozen=True)
class UserStructure(Structure):
    """The structure with rows of its sensors."""

    sensors: Mapping[str, tuple[SensorPlace, Cells]]

    def sites(self, reduction: Reduction) -> tuple[Site, ...]:
        """Recovery rows of all sensors."""
        found = []
        for name, (place, rows) in self.sensors.items():
            unit = _unit(place.direction, f"{self.name}: sensors.{name}")
            entries = (np.array(unit), (np.zeros(3, dtype=np.int64), rows))
            row = csr_array(entries, shape=(1, self.size))
            found.append(Site(name, unit, place.position, *reduction.rows(row)))
        return tuple(found)


def load_user_casing(path: Path) -> tuple[UserCasing, UserStructure]:
    """Read a user's casing with its matrices; InputError names what is wrong with them."""
    about = load_yaml(UserCasing, path)
    where = str(path)
    stiffness, mass = (
        read_matrix(path.parent / file.file, file.name) for file in (about.stiffness, about.mass)
    )
    check_matrices(stiffness.matrix, mass.matrix, where)
    connected_or_raise(stiffness.matrix, where)
    masters = {
        name: _rows(place, stiffness, 6, f"masters.{name}", where) for name, place in about.masters.items()
    }
    _once(masters, where)
    sensors = {
        name: (place, _rows(place, stiffness, 3, f"sensors.{name}", where))
        for name, place in about.sensors.items()
    }
    structure = UserStructure(
        name=about.name,
        mass=mass.matrix,
        stiffness=stiffness.matrix,
        masters=masters,
        positions_m={name: np.array(place.position) for name, place in about.masters.items()},
        sensors=sensors,
    )
    for name, place in about.sensors.items():
        _unit(place.direction, f"{where}: sensors.{name}")
    return about, structure


def _rows(place: Place, matrix: Labelled, count: int, field: str, where: str) -> Cells:
    size = int(matrix.matrix.shape[0])
    if place.grid is not None:
        return _of_grid(place.grid, matrix, count, field, where)
    if len(place.rows) != count or len(set(place.rows)) != count:
        raise InputError(where, f"{field}.rows", list(place.rows), f"{count} different rows")
    for row in place.rows:
        if not 0 <= row < size:
            raise InputError(where, f"{field}.rows", row, f"rows from 0 to {size - 1}, as the matrices have")
    return np.array(place.rows, dtype=np.int64)


def _of_grid(grid: int, matrix: Labelled, count: int, field: str, where: str) -> Cells:
    if matrix.labels is None:
        raise InputError(where, f"{field}.grid", grid, "rows: this file does not label its rows")
    found = []
    for component in range(1, count + 1):
        rows = np.flatnonzero((matrix.labels == (grid, component)).all(axis=1))
        if len(rows) != 1:
            raise InputError(where, f"{field}.grid", grid, f"a grid point with components 1 to {count}")
        found.append(rows[0])
    return np.array(found, dtype=np.int64)


def _once(masters: Mapping[str, Cells], where: str) -> None:
    owner: dict[int, str] = {}
    for name, rows in masters.items():
        for row in rows.tolist():
            if row in owner:
                what = f"row {row}, which {owner[row]} has too"
                raise InputError(where, f"masters.{name}", what, "each row once")
            owner[row] = name


def _unit(direction: tuple[float, float, float], where: str) -> tuple[float, float, float]:
    length = float(np.linalg.norm(direction))
    if not np.isfinite(length) or length == 0:
        raise InputError(where, "direction", list(direction), "three numbers, not all 0")
    x, y, z = (float(value) / length for value in direction)
    return x, y, z
