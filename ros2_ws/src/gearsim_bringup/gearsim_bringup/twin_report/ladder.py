"""The ladder of scores: how far each model is from held-out records, by domain and by band."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gearsim_bringup.pages.plot import BLUE, GREEN, GREY, LIGHT, ORANGE, Plot, axis, text
from gearsim_bringup.twin_report.numbers import domain_name, step_name
from gearsim_twin.compare.places import band_text
from gearsim_twin.exhibit import Exhibit
from gearsim_twin.score import DomainScore

__all__ = ["COLOURS", "draw_bands", "draw_domains"]

COLOURS = (LIGHT, GREY, BLUE, GREEN, "#7d3c98", ORANGE)
"""Of the steps, the baseline's first."""
_ROW_PX = 20


def draw_domains(exhibit: Exhibit) -> Plot:
    """Errors of all steps over all places and domain by domain."""
    scores = {"everything": exhibit.scores.overall}
    scores |= {domain_name(name): each for name, each in exhibit.scores.by_domain.items() if each.places}
    caption = (
        "Weighted root mean square difference between held-out records and each model, in dB, with 95 % "
        "intervals; less is better. The dash is what chance alone leaves: no model can be nearer than that."
    )
    return _bars("How far each model is from the records", caption, exhibit, scores)


def draw_bands(exhibit: Exhibit) -> Plot:
    """The same by bands of frequency."""
    scores = {f"{band_text(one.band_hz)}": one.score for one in exhibit.bands}
    caption = (
        "The same by frequency: noise and lines of the band, and everything that has it as carrier. It tells "
        "whether a cause mends the band in which it should show."
    )
    return _bars("By band", caption, exhibit, scores)


def _bars(title: str, caption: str, exhibit: Exhibit, scores: dict[str, DomainScore]) -> Plot:
    names = [text(name) for name in scores]
    data = [
        _bar(names, scores, key, step_name(step.name, step.component), COLOURS[k % len(COLOURS)])
        for k, (key, step) in enumerate(zip(exhibit.keys, exhibit.steps, strict=True))
    ]
    data.append(_floor(names, [score.noise_floor for score in scores.values()]))
    highest = max(
        score.models[key].ci95[1] for score in scores.values() for key in exhibit.keys if score.places
    )
    layout = {
        "barmode": "group",
        "bargap": 0.3,
        "xaxis": axis("error, dB", 0.0, 1.05 * max(highest, 1.0)),
        "yaxis": {"autorange": "reversed", "type": "category", "ticks": ""},
    }
    height = 110 + len(scores) * (14 + _ROW_PX * len(exhibit.steps))
    return Plot(title, caption, tuple(data), layout, height)


def _bar(
    names: Sequence[str], scores: dict[str, DomainScore], key: str, label: str, colour: str
) -> dict[str, Any]:
    found = [score.models[key] for score in scores.values()]
    return {
        "type": "bar",
        "orientation": "h",
        "y": list(names),
        "x": [round(each.value, 3) for each in found],
        "name": text(label),
        "marker": {"color": colour},
        "error_x": {
            "type": "data",
            "symmetric": False,
            "array": [round(max(each.ci95[1] - each.value, 0.0), 3) for each in found],
            "arrayminus": [round(max(each.value - each.ci95[0], 0.0), 3) for each in found],
            "color": "#374151",
            "thickness": 1,
            "width": 2,
        },
        "hovertemplate": "%{x:.2f} dB<extra></extra>",
    }


def _floor(names: Sequence[str], values: Sequence[float]) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [round(value, 3) for value in values],
        "y": list(names),
        "name": "chance alone",
        "marker": {"symbol": "line-ns", "size": 26, "line": {"color": "#c0392b", "width": 2}},
        "hovertemplate": "chance alone: %{x:.2f} dB<extra></extra>",
    }
