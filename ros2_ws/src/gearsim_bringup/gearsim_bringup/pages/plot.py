"""Plots as plotly.js takes them: plain dictionaries, numbers packed, one style."""

from __future__ import annotations

import base64
import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "BLUE",
    "FOUND",
    "GREEN",
    "GREY",
    "LIGHT",
    "ORANGE",
    "SERIES",
    "Plot",
    "axis",
    "comb",
    "curve",
    "extremes",
    "packed",
    "strongest",
    "text",
]

BLUE, ORANGE, GREEN, GREY, LIGHT = "#2463a8", "#b9770e", "#1e7d46", "#6b7280", "#c3c9d1"
FOUND = ("#c0392b", "#7d3c98", "#a04000", "#117a65")
"""Colours of the findings, strongest first."""
SERIES = (BLUE, ORANGE, GREEN, "#7d3c98", "#117a65", "#8e5a2a", "#4b5563", "#c2577c")
"""Colours of channels."""
_TALL = 340


@dataclass(frozen=True, slots=True)
class Plot:
    """A figure of the page.

    Parameters
    ----------
    title, caption : str
        Plain text; the caption says what to look for.
    data : tuple of dict
        Traces.
    layout : dict
        Axes and the like; what all plots share is added by the page.
    height : int
        In CSS pixels.
    """

    title: str
    caption: str
    data: tuple[dict[str, Any], ...]
    layout: dict[str, Any] = field(default_factory=dict)
    height: int = _TALL


def packed(values: ArrayLike) -> dict[str, Any]:
    """Numbers as plotly's typed array: base64 of little-endian float32, with the shape of two dimensions."""
    array = np.ascontiguousarray(values, dtype="<f4")
    whole: dict[str, Any] = {"dtype": "f4", "bdata": base64.b64encode(array.tobytes()).decode("ascii")}
    if array.ndim == 2:
        whole["shape"] = f"{array.shape[0]}, {array.shape[1]}"
    return whole


def text(words: str) -> str:
    """Words from outside (names of channels and parts) for plotly, which reads tags in its labels."""
    return html.escape(words, quote=False)


def axis(title: str, low: float | None = None, high: float | None = None, **more: Any) -> dict[str, Any]:
    """An axis; `low` and `high` are in its unit, also where `type` is "log"."""
    found: dict[str, Any] = {"title": {"text": text(title)}, **more}
    if low is not None and high is not None:
        ends = np.log10([low, high]) if more.get("type") == "log" else [low, high]
        found["range"] = [float(end) for end in ends]
    return found


def curve(
    values: ArrayLike, first: float, step: float, name: str, colour: str, **more: Any
) -> dict[str, Any]:
    """A line through values at equal distances."""
    width = more.pop("width", 1.2)
    return {
        "type": "scatter",
        "mode": "lines",
        "x0": float(first),
        "dx": float(step),
        "y": packed(values),
        "name": text(name),
        "line": {"color": colour, "width": width},
        **more,
    }


def comb(
    places: Sequence[float], low: float, high: float, name: str, colour: str, **more: Any
) -> dict[str, Any]:
    """Vertical lines at some places, one entry of the legend that shows and hides them."""
    dash = more.pop("dash", "dash")
    x: list[float | None] = []
    y: list[float | None] = []
    for place in places:
        x += [float(place), float(place), None]
        y += [float(low), float(high), None]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": x,
        "y": y,
        "name": text(name),
        "line": {"color": colour, "width": 1.2, "dash": dash},
        "hovertemplate": f"{text(name)}: %{{x:.5~g}}<extra></extra>",
        **more,
    }


def extremes(values: NDArray[np.floating], pairs: int) -> tuple[NDArray[np.float64], float]:
    """Least and greatest of equal stretches, in turn, and the distance of two of them in samples.

    A screen has some thousand columns: more points than that say nothing that these do not.
    """
    if values.size <= 2 * pairs:
        return np.asarray(values, dtype=np.float64), 1.0
    length = -(-values.size // pairs)
    rest = values.size % length
    whole = values[: values.size - rest].reshape(-1, length)
    low, high = whole.min(axis=1), whole.max(axis=1)
    if rest:
        low, high = np.append(low, values[-rest:].min()), np.append(high, values[-rest:].max())
    return np.column_stack([low, high]).ravel().astype(np.float64), length / 2


def strongest(values: NDArray[np.floating], most: int) -> tuple[NDArray[np.float64], int]:
    """The greatest of equal stretches, at most `most` of them, and the stretches' length.

    Peaks of a spectrum keep their height.
    """
    length = max(1, -(-values.size // most))
    whole = np.append(values, np.full(-values.size % length, values[-1]))
    return whole.reshape(-1, length).max(axis=1).astype(np.float64), length
