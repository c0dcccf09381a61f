"""Makes the results: pictures into a folder, tables between the marks of a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

from gearsim_bringup.casing_results import RESULTS
from gearsim_bringup.casing_results.records import Records
from gearsim_bringup.method_figures.style import save, styled
from gearsim_io.errors import InputError
from gearsim_io.page_marks import check_marks, put_into

__all__ = ["make_results", "result"]


def result(name: str) -> Any:
    """The module of a registered result, imported now."""
    if name not in RESULTS:
        raise InputError("figures of the casing", "name", name, f"one of {', '.join(RESULTS)}")
    return import_module(f"gearsim_bringup.casing_results.{name}")


def make_results(
    records: Records,
    out: Path,
    page: Path | None,
    only: Sequence[str],
    progress: Callable[[int, int, str], None],
) -> list[Path]:
    """Measure, draw into the folder `out`, and put the tables into the page.

    Parameters
    ----------
    records : Records
    out : Path
        Made if it is not there.
    page : Path, optional
        Markdown with a line `<!-- NAME: begin -->` and a line `<!-- NAME: end -->` for each result; what is
        between them is replaced.
    only : sequence of str
        Names of results; all if empty.
    progress : callable
        Called with what is done, how much there is, and the name at hand.

    Returns
    -------
    list of Path
        The files written.
    """
    chosen = [(name, result(name)) for name in only or RESULTS]
    if page is not None:
        for name, _ in chosen:
            check_marks(page, name)  # refused before anything is simulated
    files = []
    for number, (name, module) in enumerate(chosen):
        progress(number, len(chosen), name)
        told = module.tell(records)
        with styled():
            figure = module.draw(records, told)
        out.mkdir(parents=True, exist_ok=True)
        files.append(out / f"{name}.png")
        save(figure, files[-1])
        if page is not None:
            put_into(page, name, module.table(told))
    return [*files, *([page] if page is not None else [])]
