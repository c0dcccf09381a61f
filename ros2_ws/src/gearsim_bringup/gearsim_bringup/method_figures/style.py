"""How the pictures of the methods look: one size, one set of colours, small files."""

from __future__ import annotations

import os
from contextlib import AbstractContextManager
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

__all__ = ["FAULTY", "GREY", "HEALTHY", "MARK", "mark", "new_figure", "save", "styled"]

GREY, HEALTHY, FAULTY, MARK = "#8a8a8a", "#2c6fbb", "#c0392b", "#1e8449"
LARGEST_BYTES = 150_000
_DPI = 80


def styled() -> AbstractContextManager[None]:
    """A context in which axes are made and written in the common style."""
    return mpl.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True})


def new_figure(title: str, height: float = 5.0) -> Figure:
    """An empty figure 11 inches wide; its axes take the style when made inside `draw`."""
    figure = Figure(figsize=(11, height), layout="constrained")
    figure.suptitle(title, fontsize=11)
    return figure


def mark(axes: Axes, at: float, text: str, colour: str = MARK) -> None:
    """A dashed vertical line with its name written along the top of the axes."""
    axes.axvline(at, color=colour, linewidth=0.8, linestyle="--", alpha=0.8, zorder=0.5)
    axes.text(
        at,
        1.01,
        text,
        color=colour,
        fontsize=7.5,
        ha="center",
        va="bottom",
        transform=axes.get_xaxis_transform(),
    )


def save(figure: Figure, out: Path) -> None:
    """Write the picture as PNG, whole or not at all."""
    half = out.with_name(f".{out.name}")
    with styled():
        figure.savefig(half, dpi=_DPI, format="png", metadata={"Software": None})
    os.replace(half, out)
