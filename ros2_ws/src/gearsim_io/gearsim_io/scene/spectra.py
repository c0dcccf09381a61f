"""Envelope spectra as bar charts, the lines of each fault family in its colour."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from gearsim_io.scene import style

_HARMONICS_SHOWN = 5.6
_WITHOUT_MARKERS = 30.0
_HALF_WIDTH_LINES = 2
_STICK_WIDTH = 1 / 200
_CLEAR_DB = 10.0
_LOWEST_SHOWN = 0.4


def bars(msg: Any) -> Iterator[tuple[str, Any]]:
    """Entity paths and charts of one Spectrum message: the lines of each family, and what is left."""
    values = np.frombuffer(msg.values, dtype=np.float32)
    count = min(values.size, int(_end(msg) / msg.axis_step) + 1)
    values, axis = values[:count], msg.axis_start + msg.axis_step * np.arange(count)
    rest = np.where(axis < _start(msg), np.float32(0), values)
    root = style.entity("spectrum", msg.channel)
    wide = max(msg.axis_step, float(axis[-1] - axis[0]) * _STICK_WIDTH)
    for marker in sorted(msg.markers, key=_clarity, reverse=True):
        lines = _lines(marker, axis, rest, msg.axis_step)
        path = f"{root}/{style.entity(marker.label)}"
        yield path, _chart(axis[lines], rest[lines], wide, style.family(marker.label))
        rest[lines] = 0.0
    yield f"{root}/other_lines", _chart(axis, rest, msg.axis_step, style.SPECTRUM)


def _clarity(marker: Any) -> float:
    return float(marker.snr) if math.isfinite(marker.snr) else -math.inf


def _end(msg: Any) -> float:
    """Five harmonics of the family that shows best."""
    best = max(msg.markers, key=_clarity, default=None)
    if best is None:
        return float(_WITHOUT_MARKERS if msg.axis_unit == "order" else math.inf)
    highest = max(marker.position for marker in msg.markers)
    return float(_HARMONICS_SHOWN * (best.position if _clarity(best) >= _CLEAR_DB else highest))


def _start(msg: Any) -> float:
    """Far below the lowest family there is only the rest of the mean, which would dwarf all else."""
    return _LOWEST_SHOWN * min((float(marker.position) for marker in msg.markers), default=0.0)


def _chart(axis: NDArray[Any], values: NDArray[Any], width: float, colour: style.Rgb) -> Any:
    widths = np.full(values.size, width, dtype=np.float32)
    return rr.BarChart(values, abscissa=axis, widths=widths, color=colour)


def _lines(marker: Any, axis: NDArray[Any], values: NDArray[np.float32], step: float) -> NDArray[np.int64]:
    """The highest line at each multiple of a family's order."""
    found: list[int] = []
    for k in range(1, int(marker.harmonics) + 1):
        centre = round((k * marker.position - float(axis[0])) / step)
        low, high = max(0, centre - _HALF_WIDTH_LINES), min(axis.size, centre + _HALF_WIDTH_LINES + 1)
        if low < high:
            found.append(low + int(np.argmax(values[low:high])))
    return np.unique(np.asarray(found, dtype=np.int64))
