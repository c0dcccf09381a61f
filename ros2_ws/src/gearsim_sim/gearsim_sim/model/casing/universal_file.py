"""Modal tests in universal files (SDRC's, .uff or .unv): what they hold, at points by their numbers.

Read are frequency responses (data sets 58 of function type 4), mode shapes (55), coordinates (15, 2411),
systems of coordinates (18) and units (164), by pyuff. Which side was struck does not matter: the references
are the few places that every response has at one of its ends, the points those at the other.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.model.casing.identify import IdentifiedModes
from gearsim_sim.model.casing.local_systems import System, read_systems, system_of
from gearsim_sim.model.casing.material import Array
from gearsim_sim.model.casing.modal_test import ModalTest

Complex = NDArray[np.complex128]

RESPONSE = 4  # function type of data set 58
FORCE = 13
# Ordinates of responses over force by their type, and the power of i omega that makes them accelerations.
KINDS = {"displacement": (8, 2), "velocity": (11, 1), "acceleration": (12, 0)}
NORMAL, COMPLEX_MODES = 2, (3, 7)  # analysis types of data set 55
STANDARD_GRAVITY = 9.80665
_IN_G = re.compile(r"\(?g(\b|/|n?$)", re.IGNORECASE)
_EVEN = 1e-4  # of the distance of lines: abscissae are kept with six digits


@dataclass(frozen=True)
class Direction:
    """A translation at a point, along an axis of the file: 0, 1, 2 are x, y, z."""

    point: int
    axis: int

    def __str__(self) -> str:
        return f"point {self.point} along {'xyz'[self.axis]}"


@dataclass(frozen=True)
class Measured:
    """A modal test: responses or modes."""

    where: str
    """The file, for messages."""
    places: Mapping[int, Array]
    """Coordinates of each point in the file's axes and unit of length."""
    turns: Mapping[int, Array]
    """Axes of each point's directions by columns, in the file's, shape (3, 3)."""
    metres: float | None
    """The unit of length; None where the file does not tell it."""
    points: tuple[Direction, ...]
    references: tuple[Direction, ...]
    """Empty for modes."""
    test: ModalTest | None
    modes: IdentifiedModes | None


def read_modal_test(path: Path, kind: str | None = None) -> Measured:
    """Responses of a universal file, or the mode shapes of one that holds no responses.

    Parameters
    ----------
    path : Path
    kind : str, optional
        What responses over force are that do not say so: a key of `KINDS`.

    Raises
    ------
    InputError
        If the file is none, or holds nothing that a casing can be updated to.
    """
    where = str(path)
    sets = _read(path)
    metres, newtons = _units(sets.get(164, []), where)
    places, turns = _places(
        sets.get(15, []) + sets.get(2411, []), read_systems(sets.get(18, []), where), where
    )
    functions = sets.get(58, [])
    responses = [one for one in functions if one["func_type"] == RESPONSE]
    if responses:
        scale = 1.0 if metres is None else metres / newtons
        points, references, test = _responses(responses, kind, scale, where)
        return Measured(where, places, turns, metres, points, references, test, None)
    if not sets.get(55):
        others = sorted({int(one["func_type"]) for one in functions})
        what = f"functions of type {others} alone" if others else "none"
        expected = "data sets 58 of function type 4, or mode shapes (data sets 55)"
        raise InputError(where, "frequency responses", what, expected)
    shaped, modes = _modes(sets[55], where)
    return Measured(where, places, turns, metres, shaped, (), None, modes)


def _read(path: Path) -> dict[int, list[dict[str, Any]]]:
    """Data sets of the kinds that count, by their number."""
    import pyuff

    where = str(path)
    if not path.is_file():
        raise InputError(where, "", "no such file", "a universal file (.uff, .unv)")
    file = pyuff.UFF(where)
    kinds = [int(kind) for kind in file.get_set_types()]
    if not any(kinds):
        raise InputError(
            where, "", "no data sets", "a universal file (.uff, .unv), with lines of -1 about each set"
        )
    found: dict[int, list[dict[str, Any]]] = {}
    for number, kind in enumerate(kinds):
        if kind not in (15, 18, 55, 58, 164, 2411):
            continue
        try:
            found.setdefault(kind, []).append(file.read_sets(number))
        except Exception:  # pyuff raises nothing else
            what = f"one that cannot be read (number {number + 1} in the file)"
            raise InputError(where, f"data set {kind}", what, "a whole data set") from None
    return found


def _units(sets: list[dict[str, Any]], where: str) -> tuple[float | None, float]:
    """Metres and newtons in the file's units of length and force."""
    if not sets:
        return None, 1.0
    # Universal files keep by what to divide.
    length, force = float(sets[0]["length"]), float(sets[0]["force"])
    if not (np.isfinite([length, force]).all() and length > 0 and force > 0):
        raise InputError(where, "units (data set 164)", f"{length:g} and {force:g}", "factors above 0")
    return 1 / length, 1 / force


def _places(
    sets: list[dict[str, Any]], known: Mapping[int, System], where: str
) -> tuple[dict[int, Array], dict[int, Array]]:
    """Places of points, and the axes of their directions."""
    found: dict[int, Array] = {}
    turns: dict[int, Array] = {}
    for one in sets:
        numbers = np.asarray(one["node_nums"]).astype(int).tolist()
        columns = [np.asarray(one[axis], dtype=float) for axis in "xyz"]
        systems = np.asarray([one["def_cs"], one["disp_cs"]], dtype=float)
        if any(len(column) != len(numbers) for column in columns) or systems.shape[1] != len(numbers):
            raise InputError(
                where, f"data set {one['type']}", "a line too short", "seven numbers for each point"
            )
        shared = np.ptp(systems, axis=1) == 0
        rows = zip(numbers, np.stack(columns, axis=1), systems.T.astype(int).tolist(), strict=True)
        for number, place, (own, moved) in rows:
            found[number] = system_of(own, known, bool(shared[0]), where).place(place)
            turns[number] = system_of(moved, known, bool(shared[1]), where).axes
    for number, place in found.items():
        if not np.isfinite(place).all():
            raise InputError(where, f"point {number}", "coordinates that are not finite", "three numbers")
    return found, turns


def _responses(
    sets: list[dict[str, Any]], kind: str | None, scale: float, where: str
) -> tuple[tuple[Direction, ...], tuple[Direction, ...], ModalTest]:
    """Points, references and accelerance."""
    table: dict[tuple[Direction, Direction], Complex] = {}
    lines = _lines(sets, where)
    for one in sets:
        (moved, first), (struck, second) = (_direction(one, end, where) for end in ("rsp", "ref"))
        if (moved, struck) in table:
            raise InputError(where, "frequency responses", f"two of {moved} to {struck}", "each of them once")
        values = np.asarray(one["data"], dtype=np.complex128)
        if not np.isfinite(values).all():
            what = f"numbers that are not finite ({moved} to {struck})"
            raise InputError(where, "frequency responses", what, "finite numbers")
        table[moved, struck] = first * second * _accelerance(one, values, lines, kind, scale, where)
    # In the file's order.
    ends = [list(dict.fromkeys(pair[end] for pair in table)) for end in (0, 1)]
    swapped = len(ends[0]) > len(ends[1])
    references, points = ends[::-1] if swapped else ends
    pairs = [[(b, a) if swapped else (a, b) for b in points] for a in references]
    lacking = [pair for row in pairs for pair in row if pair not in table]
    if lacking:
        example = " to ".join(str(end) for end in lacking[0])
        what = f"{len(lacking)} of {len(references)} x {len(points)} missing (first {example})"
        raise InputError(where, "frequency responses", what, "one for each point and reference")
    whole = np.array([[table[pair] for pair in row] for row in pairs])
    # From 0 Hz on, as those who identify want it; what lies below the band is not looked at.
    lead = round(lines[0] / (lines[1] - lines[0]))
    whole = np.concatenate([np.repeat(whole[:, :, :1], lead, axis=2), whole], axis=2)
    step = (lines[-1] - lines[0]) / (len(lines) - 1)
    return tuple(points), tuple(references), ModalTest(step * np.arange(whole.shape[2]), whole)


def _lines(sets: list[dict[str, Any]], where: str) -> Array:
    """The frequencies that all responses share [Hz]."""
    field = "frequencies"
    lines = np.asarray(sets[0]["x"], dtype=float)
    for one in sets:
        kind = one.get("abscissa_spec_data_type", 0)
        if kind not in (0, 18):
            raise InputError(where, field, f"an abscissa of type {kind}", "18 (frequency)")
        own = np.asarray(one["x"], dtype=float)
        if not np.iscomplexobj(one["data"]) or len(own) != len(np.asarray(one["data"])):
            raise InputError(where, "frequency responses", "real numbers, or some missing", "complex numbers")
        if len(own) != len(lines) or not np.allclose(own, lines, atol=1e-6 * abs(lines[-1])):
            raise InputError(
                where, field, "responses of different frequencies", "the same lines in all of them"
            )
    if len(lines) < 3 or lines[0] < 0 or not np.isfinite(lines).all():
        raise InputError(
            where, field, f"{len(lines)} lines from {lines[:1]}", "three or more from 0 Hz upward"
        )
    steps = np.diff(lines)
    step = float(steps.mean())
    # Files keep abscissae with six digits.
    slack = _EVEN * step + 1e-5 * lines[-1] * (sets[0]["abscissa_spacing"] == 0)
    off = abs(lines[0] / step - round(lines[0] / step)) * step if step > 0 else np.inf
    if step <= 0 or np.abs(steps - step).max() > slack or off > 10 * slack:
        raise InputError(where, field, "lines at uneven distances", "multiples of one distance")
    return lines


def _direction(one: Mapping[str, Any], end: str, where: str) -> tuple[Direction, int]:
    """A response's place at one end, and the sign of its direction."""
    node, way = int(one[f"{end}_node"]), int(one[f"{end}_dir"])
    if not 1 <= abs(way) <= 3:
        what = "a rotation" if way else "no direction"
        raise InputError(where, f"point {node}", what, "a translation (1 to 3, or -1 to -3, for x, y and z)")
    return Direction(node, abs(way) - 1), 1 if way > 0 else -1


def _accelerance(
    one: Mapping[str, Any], values: Complex, lines: Array, kind: str | None, scale: float, where: str
) -> Complex:
    """Acceleration over force in SI."""
    top, bottom = int(one["ordinate_spec_data_type"]), int(one["orddenom_spec_data_type"])
    known = {number: name for name, (number, _) in KINDS.items()}
    name = known.get(top, kind if top in (0, 1) else None)
    if name is None or bottom not in (FORCE, *((0, 1) if kind else ())):
        what = f"a response of type {top} over one of type {bottom}"
        expected = "acceleration (12), velocity (11) or displacement (8) over force (13)"
        if {top, bottom} & {0, 1}:
            expected += "; `response` in --placement says what types 0 and 1 are"
        raise InputError(where, "frequency responses", what, expected)
    if _IN_G.match(str(one.get("ordinate_axis_units_lab", "")).strip()):
        scale = STANDARD_GRAVITY
    return np.asarray(values * scale * (2j * np.pi * lines) ** KINDS[name][1])


def _modes(sets: list[dict[str, Any]], where: str) -> tuple[tuple[Direction, ...], IdentifiedModes]:
    """Directions in which anything moves, and the modes in them."""
    read: dict[int, Callable[[Mapping[str, Any]], complex]] = {NORMAL: _normal_pole}
    read |= {kind: lambda one: complex(one["eig"]) for kind in COMPLEX_MODES}
    used = [one for one in sets if one.get("analysis_type") in read]
    if not used:
        kinds = sorted({int(one.get("analysis_type", 0)) for one in sets})
        raise InputError(where, "mode shapes", f"analyses of type {kinds} alone", "modes (2, 3 or 7)")
    numbers = np.asarray(used[0]["node_nums"]).tolist()
    poles, columns = [], []
    for one in used:
        if np.asarray(one["node_nums"]).tolist() != numbers or len(set(numbers)) != len(numbers):
            raise InputError(where, "mode shapes", "shapes at different points", "the same points, each once")
        poles.append(read[one["analysis_type"]](one))
        columns.append(
            np.stack([np.asarray(one[name], dtype=complex) for name in ("r1", "r2", "r3")], axis=1)
        )
    shapes = np.array(columns)
    values = np.array(poles)
    if not (np.isfinite(values).all() and np.isfinite(shapes).all() and (np.abs(values) > 0).all()):
        raise InputError(
            where, "mode shapes", "no frequency, or numbers that are not finite", "modes above 0 Hz"
        )
    moving = np.abs(shapes).max(axis=0) > 0
    if not moving.any():
        raise InputError(where, "mode shapes", "zeros alone", "at least one direction that moves")
    dofs = tuple(Direction(int(numbers[k]), int(axis)) for k, axis in zip(*np.nonzero(moving), strict=True))
    picked = shapes[:, moving].T
    sizes = np.linalg.norm(picked, axis=0)
    order = np.argsort(np.abs(values))[sizes[np.argsort(np.abs(values))] > 0]
    frequencies = np.abs(values) / (2 * np.pi)
    damping = -values.real / np.abs(values)
    picked = picked / np.maximum(sizes, 1e-300)
    nobody = np.full(len(order), np.nan)
    return dofs, IdentifiedModes(frequencies[order], damping[order], picked[:, order], nobody)


def _normal_pole(one: Mapping[str, Any]) -> complex:
    speed = 2 * np.pi * float(one["freq"])
    ratio = float(one.get("modal_damp_vis", 0.0)) or float(one.get("modal_damp_his", 0.0)) / 2
    return complex(-ratio * speed, speed)
