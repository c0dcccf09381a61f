"""Draws registered pictures into a folder."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from matplotlib.figure import Figure

from gearsim_bringup.method_figures import FIGURES
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import save, styled
from gearsim_io.errors import InputError

__all__ = ["drawer", "make_figures"]


def drawer(name: str) -> Callable[[Measured], Figure]:
    """The function `draw(records)` of a registered picture, imported now."""
    if name not in FIGURES:
        raise InputError("method figures", "name", name, f"one of {', '.join(FIGURES)}")
    draw = import_module(f"gearsim_bringup.method_figures.{name}").draw
    assert callable(draw)
    return draw  # type: ignore[no-any-return]


def make_figures(out: Path, only: tuple[str, ...], progress: Callable[[int, int, str], None]) -> list[Path]:
    """Draw the pictures into the folder `out`.

    Parameters
    ----------
    out : Path
        Made if it is not there.
    only : tuple of str
        Names of pictures; all if empty.
    progress : callable
        Called with what is done, how much there is, and the name at hand.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    InputError
        When there is no picture of that name.
    EnvironmentLackError
        When a record is not in any data folder.
    """
    chosen = [(name, drawer(name)) for name in only or FIGURES]
    out.mkdir(parents=True, exist_ok=True)
    records = Measured()
    files = []
    for number, (name, draw) in enumerate(chosen):
        progress(number, len(chosen), name)
        with styled():
            figure = draw(records)
        files.append(out / f"{name}.png")
        save(figure, files[-1])
    return files
