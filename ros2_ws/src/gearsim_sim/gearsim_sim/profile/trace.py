"""Measured speeds (and loads) over time as smooth curves.

Through the points goes a spline of degree 5: speed has four continuous derivatives, so acceleration has
no kink. With a tolerance it is the smoothest such spline whose rms distance from the points is that
(Dierckx, Curve and Surface Fitting with Splines, 1993). Stretches of rest are kept at exactly zero.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PPoly, make_interp_spline, splrep

from gearsim_io.errors import InputError
from gearsim_sim.profile.curve import Laid, Stretch, hermite_stretch

Array = NDArray[np.float64]
# A trace that begins or ends with an acceleration gets a lead-in or a fade-out of this length.
LEAD_S = 0.25
_GAP = 10.0  # times the usual interval
_LEAST_POINTS = 4
_DEGREE = 5
_REST_HZ = 1e-9  # what rounding leaves of a rest


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """Points of a measured trace: `time_s` ascending, `values` in SI."""

    where: str
    time_s: Array
    values: Array

    def checked(self, field: str, max_gap_s: float | None) -> Trace:
        """The trace, if it can be followed.

        Raises
        ------
        InputError
            Too few points, values that are not finite or negative, times that do not ascend from 0 on,
            or a gap.
        """
        time_s, values = self.time_s, self.values
        if time_s.size < _LEAST_POINTS:
            raise InputError(self.where, field, f"{time_s.size} points", f"at least {_LEAST_POINTS} points")
        bad = np.flatnonzero(~(np.isfinite(time_s) & np.isfinite(values)))
        if bad.size:
            found = f"{values[bad[0]]:g} at {time_s[bad[0]]:g} s (point {bad[0] + 1})"
            raise InputError(self.where, field, found, "finite numbers at all points")
        if time_s[0] < 0:
            raise InputError(self.where, "time", f"{time_s[0]:g} s", "times from 0 s on; shift the trace")
        steps = np.diff(time_s)
        if np.any(steps <= 0):
            i = int(np.flatnonzero(steps <= 0)[0])
            found = f"{time_s[i + 1]:g} s after {time_s[i]:g} s (point {i + 2})"
            raise InputError(self.where, "time", found, "ascending times")
        if np.any(values < 0):
            i = int(np.argmin(values))
            found = f"{values[i]:g} at {time_s[i]:g} s"
            raise InputError(self.where, field, found, "values >= 0; a shaft turns in one sense here")
        usual = float(np.median(steps))
        limit = _GAP * usual if max_gap_s is None else max_gap_s
        if steps.max() > limit * (1 + 1e-9):
            i = int(np.argmax(steps))
            found = f"nothing between {time_s[i]:g} and {time_s[i + 1]:g} s"
            expected = (
                f"no gap longer than {limit:g} s (usual interval {usual:g} s; max_gap allows longer ones)"
            )
            raise InputError(self.where, "time", found, expected)
        return self


def trace_curve(trace: Trace, step_s: float, tolerance: float, field: str) -> Laid:
    """A checked trace as a curve over steps; before and after it the first and the last value hold.

    Raises
    ------
    InputError
        Where the smooth curve falls below zero.
    """
    stretches: list[Stretch] = []
    for first, last, rests in _moving(trace.values):
        time_s, values = trace.time_s[first : last + 1], trace.values[first : last + 1]
        if last > first and not (rests[0] and rests[1] and not np.any(values)):
            stretches += _spline(time_s, values, rests, step_s, tolerance)
    if not stretches:  # it never moves
        return Laid([], float(trace.values[0]), float(trace.values[0]))
    stretches = _led_in(stretches, step_s)
    curve = Laid(_closed(stretches), stretches[0].coefficients[0], stretches[-1].value(stretches[-1].end))
    for one in curve.stretches:
        low, high = one.extremes()
        if low < -1e-9 * max(high, 1.0):
            found = f"a smooth curve that falls to {low:.3g} between {one.start * step_s:.4g} and "
            found += f"{one.end * step_s:.4g} s"
            raise InputError(trace.where, field, found, "more points there, or a tolerance that smooths them")
    return curve


def _moving(values: Array) -> list[tuple[int, int, tuple[bool, bool]]]:
    """Parts between rests: first and last point, and whether the part begins and ends at rest.

    A rest is a zero at either end of the trace, or two zeros and more in a row.
    """
    zero = values == 0
    rest = zero & (np.concatenate([[True], zero[:-1]]) | np.concatenate([zero[1:], [True]]))
    parts = []
    first = 0
    for i in range(1, values.size):
        if i == values.size - 1 or (rest[i] and not rest[i - 1]) or (rest[i] and not rest[i + 1]):
            parts.append((first, i, (bool(rest[first]), bool(rest[i]))))
            first = i
    return parts


def _spline(
    time_s: Array, values: Array, rests: tuple[bool, bool], step_s: float, tolerance: float
) -> list[Stretch]:
    """The spline of one part."""
    if any(rests):
        spline = _between_rests(time_s, values, rests, tolerance)
    elif tolerance > 0.0:
        spline = PPoly.from_spline(_smooth(time_s, values, tolerance))
    else:
        degree = _DEGREE if time_s.size > _DEGREE else 3
        spline = PPoly.from_spline(make_interp_spline(time_s, values, k=degree).tck)
    result = []
    for i, start in enumerate(spline.x[:-1].tolist()):
        length = float(spline.x[i + 1]) - start
        if length > 0 and time_s[0] <= start < time_s[-1]:  # knots at the ends are manifold
            coefficients = spline.c[::-1, i] * length ** np.arange(spline.c.shape[0])
            result.append(Stretch(start / step_s, length / step_s, tuple(coefficients.tolist())))
    return result


def _between_rests(time_s: Array, values: Array, rests: tuple[bool, bool], tolerance: float) -> PPoly:
    """At a rest speed, acceleration and its slope are zero; another end is free (natural)."""
    if tolerance > 0.0:
        values = np.maximum(PPoly.from_spline(_smooth(time_s, values, tolerance))(time_s), 0.0)
        values[0] = 0.0 if rests[0] else values[0]
        values[-1] = 0.0 if rests[1] else values[-1]
    still, free = [(1, 0.0), (2, 0.0)], [(3, 0.0), (4, 0.0)]
    ends: Any = tuple(still if rest else free for rest in rests)
    return PPoly.from_spline(make_interp_spline(time_s, values, k=_DEGREE, bc_type=ends).tck)


def _smooth(time_s: Array, values: Array, tolerance: float) -> Any:
    """The smoothest spline within an rms distance, as scipy's knots, coefficients and degree."""
    return splrep(time_s, values, k=min(_DEGREE, time_s.size - 1), s=time_s.size * tolerance**2)


def _led_in(stretches: list[Stretch], step_s: float) -> list[Stretch]:
    """With a smooth way in and out where the trace begins or ends with an acceleration."""
    first, last = stretches[0], stretches[-1]
    result = list(stretches)
    jet = _jet(first, first.start)
    if jet[0] > _REST_HZ and any(jet[1:]):
        steps = _lead_steps(jet, step_s)
        result.insert(0, hermite_stretch(first.start - steps, steps, (jet[0], 0.0, 0.0), jet))
    jet = _jet(last, last.end)
    if jet[0] > _REST_HZ and any(jet[1:]):
        steps = _lead_steps(jet, step_s)
        result.append(hermite_stretch(last.end, steps, jet, (jet[0], 0.0, 0.0)))
    return result


def _jet(stretch: Stretch, step: float) -> tuple[float, float, float]:
    """Value, slope and curvature per step."""
    derivative = tuple(k * c / stretch.length for k, c in enumerate(stretch.coefficients))[1:]
    slope = Stretch(stretch.start, stretch.length, derivative or (0.0,))
    return stretch.value(step), slope.value(step), slope.slope(step)


def _lead_steps(jet: tuple[float, float, float], step_s: float) -> float:
    """Short enough for the speed to stay positive: a slope of 1 adds at most 0.17 of the length."""
    steps = LEAD_S / step_s
    if jet[1]:
        steps = min(steps, 2.0 * jet[0] / abs(jet[1]))
    if jet[2]:
        steps = min(steps, (20.0 * jet[0] / abs(jet[2])) ** 0.5)
    return max(steps, 1.0)


def _closed(stretches: list[Stretch]) -> list[Stretch]:
    """With rests of exactly zero between the parts."""
    result = [stretches[0]]
    for one in stretches[1:]:
        gap = one.start - result[-1].end
        if gap > 1e-6:
            result.append(Stretch(result[-1].end, gap, (0.0,)))
        result.append(one)
    return result


def read_columns(path: Path, names: tuple[str, ...]) -> dict[str, Array]:
    """Columns of a CSV file with a header, or arrays of an npz file.

    Raises
    ------
    InputError
        If the file cannot be read or lacks one of the names.
    """
    if not path.is_file():
        raise InputError(str(path), "", "no such file", "a .csv file with a header, or an .npz file")
    try:
        found = _read_npz(path) if path.suffix == ".npz" else _read_csv(path)
    except (OSError, ValueError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(str(path), "", error, "a .csv file with a header, or an .npz file") from None
    return chosen_columns(str(path), found, names)


def chosen_columns(
    where: str, found: Mapping[str, Array | Sequence[float]], names: tuple[str, ...]
) -> dict[str, Array]:
    """The columns of these names, all of one length.

    Raises
    ------
    InputError
        If one is missing, or their lengths differ.
    """
    for name in names:
        if name not in found:
            raise InputError(where, name, "nothing", "this column; there are " + ", ".join(found))
    columns = {name: np.asarray(found[name], dtype=np.float64) for name in names}
    first, *others = columns
    for name in others:
        if columns[name].size != columns[first].size:
            expected = f"{columns[first].size} values, as {first} has"
            raise InputError(where, name, f"{columns[name].size} values", expected)
    return columns


def _read_npz(path: Path) -> dict[str, Array]:
    with np.load(path, allow_pickle=False) as content:
        return {name: np.asarray(content[name], dtype=np.float64).ravel() for name in content.files}


def _read_csv(path: Path) -> dict[str, Array]:
    text = path.read_text(encoding="utf-8-sig")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    if len(lines) < 2:
        raise ValueError("no rows below a header")
    dialect = csv.Sniffer().sniff("\n".join(lines[:10]), delimiters=",;\t ")
    rows = list(csv.reader(lines, dialect))
    names = [name.strip() for name in rows[0]]
    if any(len(row) != len(names) for row in rows):
        raise ValueError("rows of different length")
    table = np.array([[float(cell) if cell.strip() else np.nan for cell in row] for row in rows[1:]])
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}
