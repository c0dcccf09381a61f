"""A casing reduced to its bearing seats and a few modes, and the file that holds it.

The only part of this package that a simulation needs: numpy alone, no finite elements. Coordinates are
those of Craig and Bampton (1968): first the six displacements of each master node, then the amplitudes of
mass-normalised modes with the masters held. Axes are the gearbox's: x across the line of action, y along it
(upward), z along the shafts, right-handed; rotations follow the right hand.

    mass q'' + damping q' + stiffness q = forces,   q = (ux uy uz rx ry rz of master 1, ..., modes)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.archive import find_archive, read_archive, write_archive

Array = NDArray[np.float64]

FORMAT = 1
SHIPPED = Path(__file__).with_name("reduced_files")
DIRECTIONS = ("ux", "uy", "uz", "rx", "ry", "rz")


@dataclass(frozen=True)
class Site:
    """A place on the casing where a sensor may sit, in one direction.

    Its displacement is `rows @ q + correction @ (d2/dt2 of the masters)`. The second term is what the modes
    left out of the reduction add below their frequencies (they follow the motion of the masters without delay
    of their own); of an acceleration take both terms with two more derivatives, at a frequency w simply
    `-w**2 * (rows @ q - w**2 * correction @ masters)`.
    """

    name: str
    direction: tuple[float, float, float]
    """Unit vector in which the sensor measures."""
    position_m: tuple[float, float, float]
    rows: Array
    """Shape (n,), displacement [m] over coordinates."""
    correction: Array
    """Shape (6 masters,), displacement over acceleration of the masters [s^2]."""


@dataclass(frozen=True)
class Foot:
    """A spring under the casing, whose lift can be told: a pad, a bolted foot."""

    name: str
    stiffness_n_per_m: float
    """Of its spring along y."""
    rows: Array
    """Shape (n,), lift (along y) over coordinates."""


@dataclass(frozen=True)
class ReducedCasing:
    """Mass, stiffness, damping and sensor sites of a casing in Craig-Bampton coordinates.

    Matrices are symmetric, shape (n, n) with n = 6 masters + modes, in SI.
    """

    name: str
    masters: tuple[str, ...]
    """Names of the master nodes (`b1` to `b4`: bore centres), in the order of the coordinates."""
    positions_m: Array
    """Shape (masters, 3)."""
    mass: Array
    stiffness: Array
    damping: Array
    sites: tuple[Site, ...]
    valid_hz: float
    """Up to here the reduction follows the full model within what `provenance` states."""
    provenance: Mapping[str, Any] = field(default_factory=dict)
    feet: tuple[Foot, ...] = ()
    """Springs to the ground that are in `stiffness` and may come loose."""

    @property
    def size(self) -> int:
        """Number of coordinates n."""
        return len(self.mass)

    @property
    def modes(self) -> int:
        """Number of modes kept besides the masters."""
        return self.size - 6 * len(self.masters)

    @cached_property
    def own_modes(self) -> tuple[Array, Array]:
        """Angular frequencies [rad/s], shape (n,), and shapes (n, n) with `shapes.T @ mass @ shapes` = 1.

        In these coordinates the casing falls apart into n oscillators (`damping` too, as it is modal).
        """
        import scipy.linalg

        squares, shapes = scipy.linalg.eigh(self.stiffness, self.mass)
        return np.sqrt(np.maximum(squares, 0.0)), shapes

    def dof(self, master: str, direction: str) -> int:
        """Index of a master's coordinate, such as `("b3", "uy")`."""
        if master not in self.masters:
            raise InputError(self.name, "master", master, f"one of {', '.join(self.masters)}")
        if direction not in DIRECTIONS:
            raise InputError(self.name, "direction", direction, f"one of {', '.join(DIRECTIONS)}")
        return 6 * self.masters.index(master) + DIRECTIONS.index(direction)

    def site(self, name: str) -> Site:
        """The site of that name."""
        for one in self.sites:
            if one.name == name:
                return one
        names = ", ".join(site.name for site in self.sites)
        raise InputError(self.name, "site", name, f"one of {names}")


def modal_damping(mass: Array, stiffness: Array, ratio: float) -> Array:
    """The damping matrix that gives every mode of the free-standing reduced casing `ratio` of critical.

    Rigid-body modes of a casing without mounts stay undamped.
    """
    import scipy.linalg

    squares, shapes = scipy.linalg.eigh(stiffness, mass)
    half = mass @ shapes
    matrix = (half * (2 * ratio * np.sqrt(np.maximum(squares, 0.0)))) @ half.T
    return np.asarray((matrix + matrix.T) / 2)


def find_reduced(name_or_path: str) -> ReducedCasing:
    """The reduced casing shipped under a name, or in a file of one's own (.npz)."""
    return load_reduced(find_archive(name_or_path, SHIPPED, "reduced casing"))


def save_reduced(casing: ReducedCasing, path: Path) -> None:
    """Write the casing as one compressed .npz; a file that is there is replaced only by a whole one."""
    about = {
        "format": FORMAT,
        "name": casing.name,
        "masters": casing.masters,
        "valid_hz": casing.valid_hz,
        "sites": [site.name for site in casing.sites],
        "feet": {foot.name: foot.stiffness_n_per_m for foot in casing.feet},
        "provenance": dict(casing.provenance),
    }
    arrays = {
        "positions_m": casing.positions_m,
        "mass": casing.mass,
        "stiffness": casing.stiffness,
        "damping": casing.damping,
        "site_directions": np.array([site.direction for site in casing.sites]).reshape(-1, 3),
        "site_positions_m": np.array([site.position_m for site in casing.sites]).reshape(-1, 3),
        "site_rows": np.array([site.rows for site in casing.sites]).reshape(-1, casing.size),
        "foot_rows": np.array([foot.rows for foot in casing.feet]).reshape(-1, casing.size),
        "site_corrections": np.array([site.correction for site in casing.sites]).reshape(
            -1, 6 * len(casing.masters)
        ),
    }
    write_archive(path, about, arrays)


def load_reduced(path: Path) -> ReducedCasing:
    """Read what `save_reduced` wrote; InputError if it is missing, damaged or of another kind."""
    expected = "a reduced casing, as `gearsim casing reduce` writes it"
    with read_archive(path, "a reduced casing", expected) as (about, arrays):
        if about["format"] != FORMAT:
            raise InputError(str(path), "format", about["format"], f"{FORMAT}")
        return _checked(_casing(about, arrays), str(path))


def _casing(about: Mapping[str, Any], arrays: Mapping[str, Any]) -> ReducedCasing:
    count = len(about["sites"])
    columns = ("site_directions", "site_positions_m", "site_rows", "site_corrections")
    if any(len(arrays[name]) != count for name in columns):
        raise ValueError("sites and their rows differ in number")
    sites = tuple(
        Site(name, _triple(direction), _triple(position), _array(rows), _array(correction))
        for name, direction, position, rows, correction in zip(
            about["sites"], *(arrays[name] for name in columns), strict=True
        )
    )
    feet = about.get("feet", {})  # which older files do not tell
    lifts = arrays.get("foot_rows", np.zeros((0, 0)))
    return ReducedCasing(
        name=about["name"],
        masters=tuple(about["masters"]),
        positions_m=_array(arrays["positions_m"]),
        mass=_array(arrays["mass"]),
        stiffness=_array(arrays["stiffness"]),
        damping=_array(arrays["damping"]),
        sites=sites,
        valid_hz=float(about["valid_hz"]),
        provenance=about["provenance"],
        feet=tuple(
            Foot(name, float(stiffness), _array(rows))
            for (name, stiffness), rows in zip(feet.items(), lifts, strict=True)
        ),
    )


def _array(values: Any) -> Array:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


def _triple(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _checked(casing: ReducedCasing, where: str) -> ReducedCasing:
    """The casing, if its arrays fit each other and hold only finite numbers."""
    size, masters = casing.size, len(casing.masters)
    shapes: dict[str, tuple[Array, tuple[int, ...]]] = {
        "mass": (casing.mass, (size, size)),
        "stiffness": (casing.stiffness, (size, size)),
        "damping": (casing.damping, (size, size)),
        "positions_m": (casing.positions_m, (masters, 3)),
    }
    for site in casing.sites:
        shapes[f"rows of {site.name}"] = (site.rows, (size,))
        shapes[f"correction of {site.name}"] = (site.correction, (6 * masters,))
    for foot in casing.feet:
        shapes[f"rows of {foot.name}"] = (foot.rows, (size,))
    if size < 6 * masters:
        raise InputError(where, "mass", f"{size} coordinates", f"at least 6 for each of {masters} masters")
    for name, (array, shape) in shapes.items():
        if array.shape != shape:
            raise InputError(where, name, f"shape {array.shape}", f"shape {shape}")
        if not np.isfinite(array).all():
            raise InputError(where, name, "numbers that are not finite", "finite numbers")
    return casing
