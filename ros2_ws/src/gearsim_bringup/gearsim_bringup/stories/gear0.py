"""Gear0: what a model without teeth leaves unexplained, what a mate would explain, and what still remains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_bringup.stories.views import learnt_and_held_out, view_at
from gearsim_dsp.angle.resample import AngleSignal
from gearsim_twin.view import View

__all__ = ["MATE", "RECORD", "TEETH", "Explained", "Gear0", "draw", "tell"]

RECORD = "gear0/3027_217_Data_Chan12.mat"
_CHANNEL, _PER_TURN = "ch12", 512
TEETH, MATE = 23, 46
_LINES, _WIDTH, _APART = 4, 0.02, 0.04
_BAND = (10.0, 36.0)  # orders, about the mesh

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Explained:
    """Shares of the power of a part of the record.

    Attributes
    ----------
    mesh : float
        At the multiples of the 23 teeth.
    pinion : float
        At whole orders: what repeats with each turn of the pinion, the mesh among it.
    mate : float
        At half orders beside: what repeats with every second turn.
    """

    mesh: float
    pinion: float
    mate: float

    @property
    def unexplained(self) -> float:
        """What neither repeats with the pinion nor with a mate of 46 teeth."""
        return 1.0 - self.pinion - self.mate


@dataclass(frozen=True, slots=True)
class Gear0:
    """Shares and the strongest lines that no known part has, on two thirds and on the last third."""

    speed_hz: float
    learnt: Explained
    held_out: Explained
    strange: tuple[float, ...]
    strange_again: tuple[float, ...]


def tell(records: Measured) -> Gear0:
    """Part the power by what repeats.

    Raises
    ------
    EnvironmentLackError
        If the record is in no data folder.
    """
    view = view_at(records, RECORD)
    first, last = map(_turns, learnt_and_held_out(view))
    return Gear0(view.speed_hz, _explained(first), _explained(last), _strange(first), _strange(last))


def _turns(view: View) -> Array:
    """The channel over whole pairs of turns, shape (pairs, samples of two turns), mean zero."""
    signal = view.angle(_CHANNEL, _PER_TURN)
    assert isinstance(signal, AngleSignal)
    pairs = signal.values.size // (4 * _PER_TURN) * 2
    table = signal.values[: pairs * 2 * _PER_TURN].reshape(pairs, 2 * _PER_TURN)
    return np.asarray(table - table.mean())


def _explained(table: Array) -> Explained:
    """Powers of averages over every other pair, multiplied: noise of the two is not alike and drops out."""
    one, other = (np.fft.rfft(half.mean(axis=0)) / half.shape[1] for half in (table[0::2], table[1::2]))
    power = 2 * np.real(one * np.conj(other)) / float(table.var())
    half_orders = np.arange(power.size)
    whole = half_orders % 2 == 0
    mesh = whole & (half_orders % (2 * TEETH) == 0) & (half_orders > 0)
    return Explained(float(power[mesh].sum()), float(power[whole].sum()), float(power[~whole].sum()))


def _strange(table: Array) -> tuple[float, ...]:
    """Orders of the strongest lines that repeat with no pair of turns, ascending."""
    rest = (table - table.mean(axis=0)).ravel()
    window = np.hanning(rest.size)
    amplitude = np.abs(np.fft.rfft(rest * window))
    order = np.arange(amplitude.size) * _PER_TURN / rest.size
    beside_half = np.abs(2 * order - np.round(2 * order)) > 2 * _WIDTH
    amplitude = np.where(beside_half & (order > _BAND[0]) & (order < _BAND[1]), amplitude, 0.0)
    found = []
    for _ in range(_LINES):
        top = int(np.argmax(amplitude))
        found.append(float(order[top]))
        amplitude[np.abs(order - order[top]) < _APART] = 0.0
    return tuple(sorted(found))


def draw(records: Measured) -> Figure:
    """Orders about the mesh: whole, half and strange ones."""
    told, view = tell(records), view_at(records, RECORD)
    table = _turns(view)
    values = table.ravel()
    window = np.hanning(values.size)
    amplitude = 2 * np.abs(np.fft.rfft(values * window)) / window.sum()
    order = np.arange(amplitude.size) * _PER_TURN / values.size
    near = (order > 16.0) & (order < 30.0)
    figure = new_figure("gear0: whole orders are the pinion's, half orders a mate's of 46 teeth", 4.0)
    axes = figure.subplots()
    axes.semilogy(order[near], amplitude[near], color=GREY, linewidth=0.5)
    for step, offset, colour, name in ((1.0, 0.0, HEALTHY, "pinion"), (1.0, 0.5, FAULTY, "mate of 46 teeth")):
        at = np.arange(16.0 + offset, 30.0, step)
        index = np.searchsorted(order, at)
        top = [amplitude[max(k - 2, 0) : k + 3].max() for k in index]
        axes.plot(at, top, "o", ms=4, color=colour, label=name)
    for line in told.strange:
        mark(axes, line, f"{line:.2f}")
    axes.set_ylim(1e-3 * float(amplitude.max()), None)
    axes.set_xlabel("order of the pinion's shaft; dashed: the strongest lines that no known part has")
    axes.legend(fontsize=8)
    return figure
