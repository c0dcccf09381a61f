"""The page: which plots, in which order, put together with their words."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from importlib import resources
from typing import Any

from jinja2 import Environment, StrictUndefined
from markupsafe import Markup

import gearsim_bringup
from gearsim_bringup.diagnosis_report import words
from gearsim_bringup.diagnosis_report.coherence import draw_coherence
from gearsim_bringup.diagnosis_report.envelope import draw_closest_envelope, draw_envelope
from gearsim_bringup.diagnosis_report.kurtogram import draw_kurtogram
from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.orders import draw_orders
from gearsim_bringup.diagnosis_report.plot import FOUND, Plot
from gearsim_bringup.diagnosis_report.spectrum import draw_low_spectrum, draw_spectrum
from gearsim_bringup.diagnosis_report.tooth import draw_turn
from gearsim_bringup.diagnosis_report.trend import draw_trend
from gearsim_bringup.diagnosis_report.waveform import draw_blows, draw_waveform
from gearsim_dsp.judges.finding import Finding
from gearsim_io.errors import InputError

__all__ = ["PLOTLY", "make_page", "script_safe"]

PLOTLY = "plotly-cartesian-4.1.1.min.js"
"""The bundle with the chart types of two axes, of the npm package plotly.js-cartesian-dist-min."""

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
class _Shown:
    """A plot with its place on the page, or the reason why there is none."""

    key: str
    title: str
    caption: str
    height: int = 0
    spec: str = ""


@dataclass(frozen=True, slots=True)
class _Section:
    finding: Finding
    name: str
    meaning: str
    colour: str
    rows: list[words.Row]
    plots: list[_Shown] = field(default_factory=list)


def make_page(material: Material) -> str:
    """The whole page as HTML; it needs nothing besides itself."""
    environment = Environment(
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    state, title, below = words.headline(material.diagnosis)
    return environment.from_string(_file("page.html.j2")).render(
        machine=material.machine.name,
        below_name=words.record_line(material),
        state=state,
        title=title,
        below=below,
        version=gearsim_bringup.__version__,
        record=words.record_rows(material),
        sections=list(_sections(material)),
        closest=_closest(material),
        plots=[
            _shown(f"plot-{n}", name, partial(draw, material)) for n, (name, draw) in enumerate(_RECORD_PLOTS)
        ],
        families=words.family_rows(material),
        quality=material.diagnosis.quality,
        style=Markup(_file("page.css")),
        script=Markup(_file("page.js")),
        plotly=Markup(_file(PLOTLY)),
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


def _of_finding(material: Material, number: int, finding: Finding) -> Iterator[_Shown]:
    key, whole = f"finding-{number}", (material, number, finding)
    if finding in material.of_bearings():
        yield _shown(f"{key}-envelope", "Squared envelope spectrum", partial(draw_envelope, *whole))
        yield _shown(f"{key}-blows", "The blows one by one", partial(draw_blows, *whole))
    else:
        turn = _shown(f"{key}-turn", "", partial(draw_turn, *whole))
        if turn.title:
            yield turn


def _closest(material: Material) -> list[_Shown]:
    """The envelope spectrum where no finding shows it."""
    if material.of_bearings():
        return []
    return [_shown("closest-envelope", "Squared envelope spectrum", partial(draw_closest_envelope, material))]


def _shown(key: str, title: str, draw: Callable[[], Plot | None]) -> _Shown:
    try:
        plot = draw()
    except InputError as error:
        return _Shown(key, title, f"Not shown: {error}")
    if plot is None:
        return _Shown(key, title, "")
    spec: dict[str, Any] = {"data": plot.data, "layout": plot.layout}
    return _Shown(key, plot.title, plot.caption, plot.height, script_safe(spec))


def script_safe(content: object) -> Markup:
    """JSON that cannot end the element it stands in."""
    whole = json.dumps(content, allow_nan=False, separators=(",", ":"))
    return Markup(whole.replace("<", "\\u003c"))


def _file(name: str) -> str:
    return resources.files("gearsim_bringup.diagnosis_report").joinpath("files", name).read_text("utf-8")
