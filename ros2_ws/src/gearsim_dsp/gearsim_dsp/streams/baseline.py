"""What the indicators of a healthy machine look like, learnt from a period, kept on disk, and held against.

Each indicator is learnt apart for each step of speed (10 %), as mean and standard deviation on the scale on
which it is judged (`feature_kinds`); a step that was not learnt is judged by its neighbour. Neighbouring
windows overlap and depend on each other: with a correlation r from one to the next, n of them are worth
n (1 - r) / (1 + r) independent ones (an AR(1) process; Bartlett 1935), which is on the safe side for windows
that overlap. A new value x is then improbable by

    P = P(T_nu > (x - mean) / (s sqrt(1 + 1/n_eff))),  nu = n_eff - 1,

the predictive distribution of a further value of a normal sample (Student's t; for example Hahn and Meeker,
Statistical Intervals, 1991, ch. 4). Few windows mean heavy tails, so a short learning period makes alarms
rarer, never more frequent.
"""

from __future__ import annotations

import json
import math
import os
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.special import stdtr, stdtrit

from gearsim_dsp.streams.feature_kinds import kind_of
from gearsim_io.errors import InputError

__all__ = [
    "Baseline",
    "BaselineLearner",
    "Cell",
    "Key",
    "Standing",
    "load_baseline",
    "save_baseline",
    "speed_step",
]

FORMAT = "gearsim baseline 1"
_STEP = math.log(1.1)
_LEAST_WINDOWS = 10
_MOST_CORRELATION = 0.98
_LEAST_SPREAD = 0.05  # of the least change that counts; a smaller spread is the arithmetic's
_LEAST_P = 1e-300

Key = tuple[str, str, str, str]
"""Source, channel, component and name of an indicator."""


@dataclass(frozen=True, slots=True)
class Cell:
    """What was learnt of one indicator at one speed, on its scale.

    `windows` were seen; they are worth `effective` independent ones.
    """

    windows: int
    effective: float
    mean: float
    spread: float


@dataclass(frozen=True, slots=True)
class Standing:
    """A value against the baseline: what was expected and what would be WARN, in the indicator's own unit.

    `deviation` counts standard deviations upwards; `significance` is -log10 of the probability that the
    healthy machine shows as much; `size` is the change over the least one that counts.
    """

    expected: float
    deviation: float
    significance: float
    size: float


@dataclass(frozen=True, slots=True, eq=False)
class Baseline:
    """A learnt baseline.

    Parameters
    ----------
    machine : str
        Name of the machine it was learnt of.
    seconds : float
        Stream time that it rests on.
    cells : mapping
        By indicator and step of speed (`speed_step`).
    """

    machine: str
    seconds: float
    cells: Mapping[tuple[Key, int], Cell]

    @property
    def tests(self) -> int:
        """Indicators that alarms depend on, at the speed that has most of them."""
        counts: dict[int, int] = {}
        for key, step in self.cells:
            if kind_of(key[3]).judged:
                counts[step] = counts.get(step, 0) + 1
        return max(counts.values(), default=0)

    def speeds_hz(self) -> list[float]:
        """Middles of the steps of speed that were learnt (0 where no speed was known)."""
        return [
            0.0 if step == _NO_SPEED else math.exp(step * _STEP)
            for step in sorted({s for _, s in self.cells})
        ]

    def standing(self, key: Key, step: int, value: float) -> Standing | None:
        """Where a value stands; None where nothing was learnt of it at this speed, or it is no number."""
        cell, kind = self._cell(key, step), kind_of(key[3])
        scaled = kind.scaled(value)
        if cell is None or not math.isfinite(scaled):
            return None
        change = scaled - cell.mean
        t = change / _predictive(cell, kind.least)
        p = float(stdtr(cell.effective - 1, -abs(t) if kind.falls else -t))
        p = min(1.0, 2 * p if kind.falls else p)
        return Standing(
            expected=kind.plain(cell.mean),
            deviation=change / max(cell.spread, _LEAST_SPREAD * kind.least, 1e-300),
            significance=-math.log10(max(p, _LEAST_P)),
            size=(abs(change) if kind.falls else change) / kind.least if kind.judged else 0.0,
        )

    def limit(self, key: Key, step: int, significance: float) -> float:
        """The value at which an alarm of that significance would be raised; NaN where none depends on it."""
        cell, kind = self._cell(key, step), kind_of(key[3])
        if cell is None or not kind.judged:
            return math.nan
        t = -float(stdtrit(cell.effective - 1, 10.0**-significance))
        return kind.plain(cell.mean + max(t * _predictive(cell, kind.least), kind.least))

    def _cell(self, key: Key, step: int) -> Cell | None:
        """Of this step of speed or the next one: a speed on the border lies now here, now there."""
        near = (self.cells.get((key, step + d)) for d in (0, -1, 1))
        return next((cell for cell in near if cell is not None), None)

    def extended(self, other: Baseline) -> Baseline:
        """This one with all that `other` knows; where both know something, `other` counts."""
        return Baseline(self.machine, self.seconds + other.seconds, {**self.cells, **other.cells})


_NO_SPEED = -(10**6)


def speed_step(speed_hz: float) -> int:
    """Step of speed (each 10 % wide) that a speed lies in; a number of its own where it is not known."""
    return round(math.log(speed_hz) / _STEP) if math.isfinite(speed_hz) and speed_hz > 0 else _NO_SPEED


@dataclass(slots=True)
class _Sums:
    """Running sums of one indicator at one speed, about the first value (for the sake of cancellation)."""

    origin: float
    last: float
    count: int = 0
    first: float = 0.0
    square: float = 0.0
    product: float = 0.0

    def add(self, value: float) -> None:
        x, before = value - self.origin, self.last - self.origin
        if self.count:
            self.product += x * before
        self.count += 1
        self.first += x
        self.square += x * x
        self.last = value

    def cell(self) -> Cell:
        n = self.count
        mean = self.first / n
        variance = max(self.square - n * mean * mean, 0.0) / (n - 1)
        r = (self.product / (n - 1) - mean * mean) / variance if variance > 0 else 0.0
        r = min(max(r, 0.0), _MOST_CORRELATION)
        effective = max(n * (1 - r) / (1 + r), 2.0)
        return Cell(n, effective, self.origin + mean, math.sqrt(variance))


class BaselineLearner:
    """Learns a baseline in bounded memory: sums for at most `MOST_CELLS` pairs of indicator and speed.

    Parameters
    ----------
    machine : str
    """

    MOST_CELLS = 20_000

    def __init__(self, machine: str) -> None:
        self.machine = machine
        self._sums: dict[tuple[Key, int], _Sums] = {}

    def add(self, key: Key, step: int, value: float) -> None:
        """Take one value; what is no number on the indicator's scale is left out."""
        scaled = kind_of(key[3]).scaled(value)
        if not math.isfinite(scaled):
            return
        place = (key, step)
        if place not in self._sums:
            if len(self._sums) >= self.MOST_CELLS:
                return
            self._sums[place] = _Sums(scaled, scaled)
        self._sums[place].add(scaled)

    def finish(self, seconds: float) -> Baseline:
        """What was learnt; indicators with fewer than ten windows at a speed are left out.

        Raises
        ------
        InputError
            When nothing was seen often enough.
        """
        cells = {place: sums.cell() for place, sums in self._sums.items() if sums.count >= _LEAST_WINDOWS}
        if not cells:
            most = max((sums.count for sums in self._sums.values()), default=0)
            raise InputError("baseline", "windows", most, f"{_LEAST_WINDOWS} or more at one speed")
        return Baseline(self.machine, seconds, cells)


def save_baseline(baseline: Baseline, path: Path) -> None:
    """Write a baseline as JSON; whoever reads meanwhile gets the old file or the new one, whole."""
    rows = [
        {"indicator": list(key), "step": step, **asdict(cell)} for (key, step), cell in baseline.cells.items()
    ]
    content = {
        "format": FORMAT,
        "machine": baseline.machine,
        "seconds": baseline.seconds,
        "speeds_hz": [round(speed, 3) for speed in baseline.speeds_hz()],
        "cells": rows,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=f".{path.name}.", delete=False) as sink:
        json.dump(content, sink, indent=1)
        sink.flush()
        os.fsync(sink.fileno())
    os.replace(sink.name, path)


def load_baseline(path: Path, machine: str) -> Baseline:
    """Read what `save_baseline` wrote.

    Raises
    ------
    InputError
        When it is not such a file, or was learnt of another machine.
    """
    try:
        content = json.loads(path.read_text())
        if content["format"] != FORMAT:
            raise InputError(str(path), "format", content["format"], FORMAT)
        if content["machine"] != machine:
            raise InputError(str(path), "machine", content["machine"], machine)
        return Baseline(machine, float(content["seconds"]), dict(_rows(content["cells"])))
    except OSError as error:
        raise InputError(str(path), "", error.strerror or str(error), "a stored baseline") from None
    except (json.JSONDecodeError, KeyError, TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(str(path), "", f"{type(error).__name__}: {error}", "a stored baseline") from None


def _rows(rows: Iterable[Mapping[str, object]]) -> Iterable[tuple[tuple[Key, int], Cell]]:
    for row in rows:
        source, channel, component, name = (str(part) for part in row["indicator"])  # type: ignore[attr-defined]
        numbers = [float(row[field]) for field in ("effective", "mean", "spread")]  # type: ignore[arg-type]
        if not (np.isfinite(numbers).all() and numbers[0] >= 2 and numbers[2] >= 0):
            raise ValueError(f"numbers of {name} on {channel}: {numbers}")
        cell = Cell(int(row["windows"]), *numbers)  # type: ignore[call-overload]
        yield ((source, channel, component, name), int(row["step"])), cell  # type: ignore[call-overload]


def _predictive(cell: Cell, least: float) -> float:
    """Spread of one further value, the mean's own uncertainty included."""
    spread = max(cell.spread, _LEAST_SPREAD * least, 1e-300)
    return spread * math.sqrt(1 + 1 / cell.effective)
