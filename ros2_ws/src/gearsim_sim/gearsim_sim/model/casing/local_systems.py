"""Coordinate systems that points of a universal file have to themselves (data sets 18)."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.material import Array

CARTESIAN = 0


@dataclass(frozen=True)
class System:
    """A Cartesian system in the one that all share."""

    origin: Array
    axes: Array
    """Its x, y and z by columns, shape (3, 3)."""

    def place(self, coordinates: Array) -> Array:
        """A place of its coordinates, in those that all share."""
        return np.asarray(self.origin + self.axes @ coordinates)


COMMON = System(np.zeros(3), np.eye(3))


def read_systems(sets: Collection[Mapping[str, Any]], where: str) -> dict[int, System]:
    """Systems by their numbers.

    Raises
    ------
    InputError
        If one is not Cartesian, has no axes, or rests on one that is not defined before it.
    """
    found: dict[int, System] = {}
    for one in sets:
        columns = ("cs_num", "cs_type", "ref_cs_num", "ref_o", "x_point", "xz_point")
        for number, kind, base, origin, along, plane in zip(*(one[name] for name in columns), strict=True):
            field = f"coordinate system {int(number)}"
            if kind != CARTESIAN:
                raise InputError(where, field, f"type {int(kind)}", "a Cartesian one (type 0)")
            if base != 0 and int(base) not in found:
                raise InputError(
                    where, field, f"one in system {int(base)}", "system 0, or one defined before"
                )
            parent = found.get(int(base), COMMON)
            start, first, second = (parent.place(point) for point in (origin, along, plane))
            found[int(number)] = System(start, _axes(first - start, second - start, where, field))
    return found


def _axes(along: Array, plane: Array, where: str, field: str) -> Array:
    across = np.cross(plane, along)  # y, at right angles to the plane of x and z
    sizes = np.linalg.norm(along), np.linalg.norm(across)
    if not np.isfinite(sizes).all() or sizes[0] == 0 or sizes[1] <= 1e-6 * sizes[0] * np.linalg.norm(plane):
        raise InputError(
            where, field, "points on one line", "an origin, a point on x and one in the plane xz"
        )
    x, y = along / sizes[0], across / sizes[1]
    return np.stack([x, y, np.cross(x, y)], axis=1)


def system_of(number: int, known: Mapping[int, System], shared: bool, where: str) -> System:
    """The system of a number; one that is not defined counts as the common one if all points share it."""
    if number in known:
        return known[number]
    if number == 0 or shared:
        return COMMON
    expected = "one system for all points, or those that data sets 18 define"
    raise InputError(where, "coordinates", f"points in system {number}", expected)
