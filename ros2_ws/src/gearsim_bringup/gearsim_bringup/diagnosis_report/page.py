"""The page: which plots, in which order, put together with their words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial

from gearsim_bringup.diagnosis_report import words
from gearsim_bringup.diagnosis_report.coherence import draw_coherence
from gearsim_bringup.diagnosis_report.envelope import draw_closest_envelope, draw_envelope
from gearsim_bringup.diagnosis_report.kurtogram import draw_kurtogram
from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.orders import draw_orders
from gearsim_bringup.diagnosis_report.spectrum import draw_low_spectrum, draw_spectrum
from gearsim_bringup.diagnosis_report.tooth import draw_turn
from gearsim_bringup.diagnosis_report.trend import draw_trend
from gearsim_bringup.diagnosis_report.waveform import draw_blows, draw_waveform
from gearsim_bringup.pages.assembled import Shown, assembled, shown
from gearsim_bringup.pages.plot import FOUND, Plot
from gearsim_dsp.judges.finding import Finding

__all__ = ["make_page"]

_RECORD_PLOTS: tuple[tuple[str, Callable[[Material], Plot]], ...] = (
    ("Vibration over time", draw_waveform),
    ("Power spectrum", draw_spectrum),
    ("Power spectrum with the expected lines", draw_low_spectrum),
    ("Kurtogram", draw_kurtogram),
    ("Order spectrum", draw_orders),
    ("Cyclic coherence", draw_coherence),
    ("Trend over the record", draw_trend),
)


@dataclass(frozen=True, slots=True)
class _Section:
    finding: Finding
    name: str
    meaning: str
    colour: str
    rows: list[words.Row]
    plots: list[Shown] = field(default_factory=list)


def make_page(material: Material) -> str:
    """The whole page as HTML; it needs nothing besides itself."""
    state, title, below = words.headline(material.diagnosis)
    return assembled(
        "gearsim_bringup.diagnosis_report",
        "page.html.j2",
        machine=material.machine.name,
        below_name=words.record_line(material),
        state=state,
        title=title,
        below=below,
        record=words.record_rows(material),
        sections=list(_sections(material)),
        closest=_closest(material),
        plots=[
            shown(f"plot-{n}", name, partial(draw, material)) for n, (name, draw) in enumerate(_RECORD_PLOTS)
        ],
        families=words.family_rows(material),
        quality=material.diagnosis.quality,
    )


def _sections(material: Material) -> Iterator[_Section]:
    for number, finding in enumerate(material.diagnosis.findings):
        yield _Section(
            finding,
            words.fault_name(finding),
            words.meaning(finding),
            FOUND[number % len(FOUND)],
            words.evidence_rows(material, finding),
            list(_of_finding(material, number, finding)),
        )


def _of_finding(material: Material, number: int, finding: Finding) -> Iterator[Shown]:
    key, whole = f"finding-{number}", (material, number, finding)
    if finding in material.of_bearings():
        yield shown(f"{key}-envelope", "Squared envelope spectrum", partial(draw_envelope, *whole))
        yield shown(f"{key}-blows", "The blows one by one", partial(draw_blows, *whole))
    else:
        turn = shown(f"{key}-turn", "", partial(draw_turn, *whole))
        if turn.title:
            yield turn


def _closest(material: Material) -> list[Shown]:
    """The envelope spectrum where no finding shows it."""
    if material.of_bearings():
        return []
    return [shown("closest-envelope", "Squared envelope spectrum", partial(draw_closest_envelope, material))]
