"""The record beside the models: which channel and band to show, and what is marked."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_bringup.pages.plot import BLUE, FOUND, GREY, ORANGE, comb
from gearsim_dsp.kinematics import mesh_orders
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError
from gearsim_twin.compare.discrepancy import Comparison, significant
from gearsim_twin.compare.merged import Discrepancy, base
from gearsim_twin.compare.places import DOMAINS, Place
from gearsim_twin.exhibit import BASELINE, Exhibit
from gearsim_twin.verdict import Verdict
from gearsim_twin.view import View

__all__ = ["Mark", "Side", "Sides", "drawn"]

LIME = "#57b947"
"""Of the last model: seen on the record's blue."""
_MARKED = (FOUND[0], FOUND[1], FOUND[3])
_MOST_MARKS = 3
_MULTIPLES = 6
_MOST_LINES = 12


@dataclass(frozen=True, slots=True, eq=False)
class Side:
    """The record or a model: its name, colour and width on the page, and its view."""

    name: str
    colour: str
    width: float
    view: View

    @property
    def rate_hz(self) -> float:
        """Sampling rate."""
        return self.view.record.sample_rate_hz

    def samples(self, channel: str) -> NDArray[np.float64]:
        """A channel without its mean."""
        values = self.view.signal(channel)
        return np.asarray(values - values.mean())

    @property
    def phase(self) -> Phase | None:
        """Angle of the reference shaft, that of a constant speed where only a mean is known."""
        if self.view.phase is not None:
            return self.view.phase
        speed = self.view.speed_hz
        if not (math.isfinite(speed) and speed > 0):
            return None
        ends = np.array([0.0, self.view.record.sample_count - 1.0])
        return Phase(ends, ends * speed / self.rate_hz)


@dataclass(frozen=True, slots=True)
class Mark:
    """Lines of one entry of the legend, as orders of the reference shaft."""

    name: str
    orders: tuple[float, ...]
    colour: str
    dash: str
    hidden: bool = False


class Sides:
    """The held-out record and the models in its place.

    Parameters
    ----------
    verdict : Verdict
        With its exhibit.
    """

    def __init__(self, verdict: Verdict) -> None:
        if verdict.exhibit is None:
            raise InputError("page", "exhibit", "none", "a verdict judged with show=True")
        self.verdict = verdict
        self.exhibit: Exhibit = verdict.exhibit

    @cached_property
    def all(self) -> tuple[Side, ...]:
        """Baseline, the record as a broad line, and on it the last model as a thin one."""
        last = "extended" if len(self.exhibit.steps) > 2 else "tuned"
        return (
            Side("baseline", ORANGE, 1.0, self.exhibit.sides[BASELINE]),
            Side("measured", BLUE, 2.2, self.exhibit.measured),
            Side(last, LIME, 0.9, self.exhibit.sides["extended"]),
        )

    @property
    def unit(self) -> str:
        """Of the samples."""
        unit = self.exhibit.measured.record.unit
        return {"m/s^2": "m/s²", "1": "as recorded"}.get(unit, unit)

    @property
    def speed_hz(self) -> float:
        """Mean speed of the record's reference shaft."""
        return self.exhibit.measured.speed_hz

    @cached_property
    def channel(self) -> str:
        """On which the record differs most surely from the tuned model."""
        return self._surest(tuple(DOMAINS)).channel

    @cached_property
    def envelope(self) -> tuple[str, tuple[float, float]]:
        """Channel and band whose envelopes differ most surely."""
        place = self._surest(("envelope", "cyclic"))
        if place.band_hz is None:
            alike = [p for p in self._comparison.places if p.band_hz and p.channel == place.channel]
            if not alike:
                raise InputError("envelope spectrum", "speed", "not known", "one, for lines over the angle")
            return place.channel, alike[-1].band_hz or (0.0, 0.0)
        return place.channel, place.band_hz

    def marks(self, domains: tuple[str, ...]) -> tuple[Mark, ...]:
        """What differs most surely in some domains, then shafts and meshes."""
        return (*self._differing(domains), *self._known())

    @property
    def _comparison(self) -> Comparison:
        """The held-out records beside the tuned model."""
        return self.exhibit.steps[1].comparison

    def _surest(self, domains: tuple[str, ...]) -> Place:
        """The place that is off most surely; where none is for sure, the first of what is compared most."""
        both = self._comparison
        mine = np.array([p.domain in domains and p.channel in self._channels for p in both.places])
        if not mine.any():
            raise InputError("page", "domain", "nothing", f"places of {' or '.join(domains)}")
        sure = mine & significant(both)
        rows = np.flatnonzero(sure if sure.any() else mine & both.counted)
        rows = rows if rows.size else np.flatnonzero(mine)
        return both.places[int(rows[np.argmax(np.abs(both.z[rows]))])]

    @property
    def _channels(self) -> tuple[str, ...]:
        return self.exhibit.measured.record.channels

    def _differing(self, domains: tuple[str, ...]) -> Iterator[Mark]:
        named: dict[str, Mark] = {}
        for each in self.verdict.discrepancies:
            mark = self._mark(each, _MARKED[len(named) % len(_MARKED)]) if each.domain in domains else None
            if mark is not None and mark.name not in named:
                named[mark.name] = mark
            if len(named) == _MOST_MARKS:
                break
        yield from named.values()

    def _mark(self, each: Discrepancy, colour: str) -> Mark | None:
        """Its lines, of a family that modulates with multiples; None for what is no line."""
        first, speed = each.places[0], self.speed_hz
        if first.unit not in ("order", "Hz") or first.kind == "floor" or not (speed > 0):
            return None
        orders = sorted({p.at if p.unit == "order" else p.at / speed for p in each.places if p.at > 0})
        if not orders:
            return None
        name = base(first.label)
        family = " of " in name and each.domain in ("envelope", "cyclic")
        if not family and first.kind in ("tone", "half"):
            name = f"line at {orders[0] * speed:.4g} Hz"
        lines = [k * orders[0] for k in range(1, _MULTIPLES + 1)] if family else orders[:_MOST_LINES]
        return Mark(name or first.kind, tuple(lines), colour, "dash")

    def _known(self) -> Iterator[Mark]:
        machine = self.exhibit.machine
        ratios: dict[float, list[str]] = {}
        for shaft in machine.shafts:
            ratios.setdefault(round(shaft.ratio, 9), []).append(shaft.name)
        for ratio, names in ratios.items():
            yield Mark(
                f"turns of {', '.join(names)}", tuple(k * ratio for k in range(1, 5)), GREY, "dot", True
            )
        for name, order in mesh_orders(machine).items():
            yield Mark(
                f"all of mesh {name}", tuple(k * order for k in range(1, 4)), "#8e5a2a", "dashdot", True
            )


def drawn(marks: Iterable[Mark], end_order: float, rise: tuple[float, float]) -> list[dict[str, Any]]:
    """Marks below the end of an axis in orders."""
    found = []
    for mark in marks:
        places = [order for order in mark.orders if order < end_order]
        if places:
            look: dict[str, Any] = {
                "dash": mark.dash,
                "opacity": 0.6,
                "visible": "legendonly" if mark.hidden else True,
            }
            found.append(comb(places, *rise, mark.name, mark.colour, **look))
    return found
