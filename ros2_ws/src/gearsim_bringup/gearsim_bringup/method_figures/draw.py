"""Draws registered pictures into a folder: those of the methods, and those of the stories."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from matplotlib.figure import Figure

from gearsim_bringup.method_figures import FIGURES
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import save, styled
from gearsim_bringup.stories import STORIES
from gearsim_io.errors import InputError

__all__ = ["KINDS", "drawer", "make_figures"]

KINDS = {"methods": ("method_figures", FIGURES), "stories": ("stories", STORIES)}
"""Package and names of the pictures of docs/methods and of docs/stories.md."""


def drawer(name: str, kind: str = "methods") -> Callable[[Measured], Figure]:
    """The function `draw(records)` of a registered picture, imported now."""
    package, names = KINDS[kind]
    if name not in names:
        raise InputError(f"figures of {kind}", "name", name, f"one of {', '.join(names)}")
    draw = import_module(f"gearsim_bringup.{package}.{name}").draw
    assert callable(draw)
    return draw  # type: ignore[no-any-return]


def make_figures(
    out: Path, only: tuple[str, ...], progress: Callable[[int, int, str], None], kind: str = "methods"
) -> list[Path]:
    """Draw the pictures into the folder `out`.

    Parameters
    ----------
    out : Path
        Made if it is not there.
    only : tuple of str
        Names of pictures; all if empty.
    progress : callable
        Called with what is done, how much there is, and the name at hand.
    kind : str
        A key of `KINDS`.

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
    chosen = [(name, drawer(name, kind)) for name in only or KINDS[kind][1]]
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
