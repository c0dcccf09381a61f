"""Dashed lines at the orders that the nameplate predicts, with names that keep clear of each other."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axes import Axes

from gearsim_dsp.kinematics import FaultFamily

_COLOUR = "#2c6fbb"
_WIDTH = 0.12  # that a name takes, as a share of the axis
_HEIGHT = 0.08  # of a row of names


def mark_orders(axes: Axes, families: Sequence[FaultFamily]) -> None:
    """A line at the order of each family and its name beside it, in rows of names above the curves."""
    left, right = axes.get_xlim()
    width = _WIDTH * (right - left)
    shown = sorted((one for one in families if left <= one.order <= right), key=lambda one: one.order)
    starts = [one.order if one.order + width <= right else one.order - width for one in shown]
    rows = rows_of(starts, width)
    axes.set_ylim(top=axes.get_ylim()[1] / (1 - _HEIGHT * (max(rows, default=-1) + 1)))
    for family, start, row in zip(shown, starts, rows, strict=True):
        ahead = start == family.order
        axes.axvline(family.order, color=_COLOUR, linestyle="--", linewidth=0.7)
        axes.annotate(
            family.label, (family.order, 1 - _HEIGHT * row), (3 if ahead else -3, -2),
            xycoords=("data", "axes fraction"), textcoords="offset points", color=_COLOUR, fontsize=8,
            va="top", ha="left" if ahead else "right",
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8},
        )  # fmt: skip


def rows_of(starts: Sequence[float], width: float) -> list[int]:
    """The row of each name of that width, 0 at the top: the first one where nothing is in its way."""
    taken: list[list[float]] = []
    rows = []
    for start in starts:
        free = (k for k, row in enumerate(taken) if all(abs(start - other) >= width for other in row))
        row = next(free, len(taken))
        if row == len(taken):
            taken.append([])
        taken[row].append(start)
        rows.append(row)
    return rows
