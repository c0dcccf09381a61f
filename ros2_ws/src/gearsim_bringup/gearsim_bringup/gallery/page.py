"""The page of the gallery: a section for every kind, with its picture."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from gearsim_bringup.gallery.analysis import Comparison, compare
from gearsim_bringup.gallery.cases import Case, cases
from gearsim_bringup.gallery.picture import draw
from gearsim_sim.model.faults import REGISTRY

PAGE = "README.md"
_HEAD = """# Gallery

One picture for every kind of fault that can be injected, and two of the gearbox in its flexible casing: the
channel that shows it best, in grey without it and in red with it; nothing else differs, and the sensors are
ideal. Made by `./gearsim gallery --out docs/gallery`; each section names the shipped scenario that has the
fault (`./gearsim run NAME`). The band of the envelope is the one in which the fault adds most (in a casing
below 4 kHz, where the reduction is valid); dashed lines are the orders that the nameplate predicts for the
component.
"""


def make_gallery(
    out: Path, only: tuple[str, ...], seconds: float, progress: Callable[[int, int, str], None]
) -> list[Path]:
    """Draw the pictures into the folder `out`, and its page if all kinds are asked for.

    Parameters
    ----------
    out : Path
        Made if it is not there.
    only : tuple of str
        Names of cases to draw; all if empty.
    seconds : float
        Simulated time of each record.
    progress : callable
        Called with what is done, how much there is, and the name at hand.

    Returns
    -------
    list of Path
        The files written.
    """
    chosen = cases(only)
    out.mkdir(parents=True, exist_ok=True)
    files, sections = [], []
    for number, case in enumerate(chosen):
        progress(number, len(chosen), case.name)
        comparison = compare(case, seconds)
        picture = out / f"{case.name}.png"
        half = picture.with_name(f".{case.name}.png")
        draw(comparison, f"{case.kind} at {case.component} (scenario {case.example})", half)
        os.replace(half, picture)
        files.append(picture)
        sections.append(_section(case, comparison))
    if not only:
        page = out / PAGE
        contents = "\n".join(f"- [{case.name}](#{case.name})" for case in chosen)
        page.write_text(_HEAD + "\n" + contents + "\n\n" + "\n".join(sections), encoding="utf-8")
        files.append(page)
    return files


def _section(case: Case, comparison: Comparison) -> str:
    kind = REGISTRY[case.kind]
    healthy, faulty = comparison.rms
    change = f"rms of {comparison.channel} {healthy:.3g} to {faulty:.3g} {comparison.unit}"
    return (
        f"## {case.name}\n{_sentence(kind.summary)}\n\n*Look for:* {kind.look_for}\n\n"
        f"Scenario `{case.example}`, {case.component}, {comparison.speed_hz:g} Hz: {change}.\n\n"
        f"![{case.name}]({case.name}.png)\n"
    )


def _sentence(text: str) -> str:
    text = text[:1].upper() + text[1:]
    return text if text.endswith(".") else text + "."
