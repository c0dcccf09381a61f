"""What the scene draws on: a rerun recording with lines, columns of values and lanes of states."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from gearsim_io.scene import style

TIMELINE = "time"


class Canvas:
    """Entities with their style, and rows that wait until they fill a chunk.

    Parameters
    ----------
    stream : rerun.RecordingStream
    chunk_rows : int
        Values of one line that are sent together. Many small chunks make a recording slow to load;
        live, few of them keep the delay short.
    """

    def __init__(self, stream: Any, chunk_rows: int = 8192) -> None:
        self.stream = stream
        self._chunk_rows = chunk_rows
        self._styled: set[str] = set()
        self._below: Counter[str] = Counter()
        self._lanes: dict[str, dict[str, style.Rgb]] = {}
        self._waiting: dict[str, list[tuple[NDArray[np.float64], NDArray[Any]]]] = {}
        self._counts: dict[str, int] = {}

    def at(self, t_s: float) -> None:
        """What is logged next belongs to this time."""
        self.stream.set_time(TIMELINE, duration=t_s)

    def line(self, path: str, name: str, colour: style.Rgb, width: float = 1.5) -> None:
        """Name and colour of a line, before its first value; a second time does nothing."""
        if path not in self._styled:
            self._styled.add(path)
            self._below[path.partition("/")[0]] += 1
            lines = rr.SeriesLines(names=name, colors=colour, widths=width, aggregation_policy="MinMax")
            self.stream.log(path, lines, static=True)

    def lines_below(self, root: str) -> int:
        """How many lines there are below an entity of the first level, such as `speed`."""
        return self._below[root]

    def rows(self, path: str, times_s: NDArray[np.float64], values: NDArray[Any]) -> None:
        """More values of a line."""
        if not times_s.size:
            return
        self._waiting.setdefault(path, []).append((times_s, values))
        self._counts[path] = self._counts.get(path, 0) + times_s.size
        if self._counts[path] >= self._chunk_rows:
            self._send(path)

    def value(self, path: str, t_s: float, value: float) -> None:
        """One more value of a line."""
        self.rows(path, np.array([t_s]), np.array([value]))

    def upright(self, path: str, t_s: float, low: float, high: float) -> None:
        """A vertical line."""
        index = rr.TimeColumn(TIMELINE, duration=np.array([t_s, t_s]))
        self.stream.send_columns(path, [index], rr.Scalars.columns(scalars=np.array([low, high])))

    def state(self, path: str, t_s: float, word: str, colour: style.Rgb) -> None:
        """From this time on the lane shows this word in this colour."""
        known = self._lanes.setdefault(path, {})
        if known.get(word) != colour:
            known[word] = colour
            styled = rr.StateConfiguration(values=list(known), colors=list(known.values()))
            self.stream.log(path, styled, static=True)
        self.at(t_s)
        self.stream.log(path, rr.StateChange(state=word))

    def flush(self) -> None:
        """Send all rows that still wait for more."""
        for path in list(self._waiting):
            self._send(path)
        self.stream.flush()

    def _send(self, path: str) -> None:
        parts = self._waiting.pop(path)
        del self._counts[path]
        times = np.concatenate([part for part, _ in parts])
        values = np.concatenate([part for _, part in parts])
        index = rr.TimeColumn(TIMELINE, duration=times)
        self.stream.send_columns(path, [index], rr.Scalars.columns(scalars=values))
