"""How the indicators move along the record."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.words import fault_name
from gearsim_bringup.pages.plot import BLUE, FOUND, SERIES, Plot, axis, text
from gearsim_dsp.envelope import squared_envelopes, suppress_lines, window_spectrum
from gearsim_dsp.features import crest_factor, kurtosis, rms
from gearsim_dsp.judges.finding import Finding
from gearsim_io.errors import InputError

__all__ = ["draw_trend", "fault_level"]

_MOST_WINDOWS = 40
_LEAST_S = 0.1
_TURNS = 3.0
_BLOWS = 12.0
_HARMONICS = 4
_MOST_CHANNELS = 8
_SPEED = "speed, Hz"
_LEAST_SPAN = 0.005


def draw_trend(material: Material) -> Plot:
    """Level, kurtosis, crest factor, speed and each finding's modulation, window by window."""
    fit = list(material.channels)[:_MOST_CHANNELS]
    if not fit:
        raise InputError("trend", "channels", "none", "a channel that is fit to be judged")
    edges = _edges(material)
    if edges.size < 4:
        shortest = 3 * (edges[1] - edges[0]) / material.rate_hz
        raise InputError("trend", "record", f"{material.record.seconds:.3g} s", f"{shortest:.3g} s or more")
    middle = 0.5 * (edges[1:] + edges[:-1]) / material.rate_hz
    rows: list[tuple[str, list[dict[str, Any]]]] = []
    for title, feature in (
        (f"RMS, {material.unit}", rms),
        ("kurtosis", kurtosis),
        ("crest factor", crest_factor),
    ):
        traces = []
        for number, name in enumerate(fit):
            x = material.samples(name)
            values = [feature(x[a:b]) for a, b in pairwise(edges)]
            traces.append(
                _trace(middle, values, name, SERIES[number % len(SERIES)], not rows and len(fit) > 1)
            )
        rows.append((title, traces))
    for number, finding in enumerate(material.of_bearings()):
        values = _levels(material, finding, edges)
        name = f"modulation by the {fault_name(finding)}"
        rows.append(("fault, %", [_trace(middle, values, name, FOUND[number % len(FOUND)], True)]))
    angle = material.turning.phase
    if angle is not None:
        turns = np.interp(edges, angle.samples, angle.turns)
        speeds = np.diff(turns) / np.diff(edges) * material.rate_hz
        rows.append((_SPEED, [_trace(middle, speeds.tolist(), "speed", BLUE, False)]))
    data, layout = _stacked(rows, material.record.seconds)
    window = (edges[1] - edges[0]) / material.rate_hz
    fault = (
        "; the fault's own modulation tells whether it is there all the time"
        if material.of_bearings()
        else ""
    )
    caption = (
        f"Indicators in windows of {window:.2g} s. Level steps and drifts mean that load or speed changed "
        f"on the way; a kurtosis of 3 is noise, more means impacts{fault}."
    )
    return Plot("Trend over the record", caption, tuple(data), layout, 110 + 105 * len(rows))


def fault_level(
    samples: NDArray[np.floating], rate_hz: float, band_hz: tuple[float, float], fault_hz: float
) -> float:
    """Depth in per cent to which the envelope of a band swings at a frequency and its first multiples.

    What noise shows on the average, 1.5 / (B T) a line, is taken off.
    """
    spectrum = suppress_lines(window_spectrum(np.asarray(samples, dtype=np.float32), rate_hz))
    envelopes = squared_envelopes(spectrum, np.array([band_hz[0]]), band_hz[1] - band_hz[0])
    power = envelopes.values[0].astype(np.float64)
    power = power / np.mean(power) - 1.0
    window = np.hanning(power.size)
    turn = np.exp(-2j * np.pi * fault_hz / envelopes.rate_hz * np.arange(power.size))
    lines = [abs(np.sum(power * window * turn**k)) ** 2 for k in range(1, _HARMONICS + 1)]
    noise = _HARMONICS * 1.5 / ((band_hz[1] - band_hz[0]) * power.size / envelopes.rate_hz)
    return 200 * math.sqrt(max(float(sum(lines)) / float(window.sum()) ** 2 - noise, 0.0))


def _edges(material: Material) -> NDArray[np.int64]:
    seconds = max(_LEAST_S, material.record.seconds / _MOST_WINDOWS)
    if math.isfinite(material.speed_hz):
        seconds = max(seconds, _TURNS / material.speed_hz)
    seconds = max([seconds, *(_BLOWS / finding.found_hz for finding in material.of_bearings())])
    length = max(64, round(seconds * material.rate_hz))
    count = max(1, material.record.sample_count // length)
    return np.arange(count + 1, dtype=np.int64) * length


def _levels(material: Material, finding: Finding, edges: NDArray[np.int64]) -> list[float]:
    x = material.samples(finding.channel)
    band = material.band_hz(finding)
    speeds = np.full(edges.size - 1, finding.found_hz)
    if material.phase is not None:
        turns = np.interp(edges, material.phase.samples, material.phase.turns)
        speeds = finding.found_order * np.diff(turns) / np.diff(edges) * material.rate_hz
    windows = zip(edges[:-1], edges[1:], speeds, strict=True)
    return [fault_level(x[a:b], material.rate_hz, band, float(hz)) for a, b, hz in windows]


def _trace(x: NDArray[np.floating], y: list[float], name: str, colour: str, told: bool) -> dict[str, Any]:
    return {
        "type": "scatter",
        "mode": "lines+markers",
        "x": [round(float(value), 6) for value in x],
        "y": [float(f"{value:.5g}") if math.isfinite(value) else None for value in y],
        "name": text(name),
        "legendgroup": text(name),
        "showlegend": told,
        "line": {"color": colour, "width": 1.4},
        "marker": {"color": colour, "size": 4},
    }


def _around(values: list[float]) -> tuple[float, float]:
    """Ends of the axis of speed, half a per cent either way at least: jitter is not to look like a change."""
    low, high = min(values), max(values)
    room = max(0.1 * (high - low), _LEAST_SPAN * high)
    return low - room, high + room


def _stacked(
    rows: list[tuple[str, list[dict[str, Any]]]], seconds: float
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    data: list[dict[str, Any]] = []
    layout: dict[str, Any] = {}
    share = 1.0 / len(rows)
    for row, (title, traces) in enumerate(rows):
        number = "" if row == 0 else str(row + 1)
        data += [{**trace, "yaxis": f"y{number}"} for trace in traces]
        top = 1.0 - row * share
        ends = _around(traces[0]["y"]) if title == _SPEED else ()
        more: dict[str, Any] = {} if ends else {"rangemode": "tozero"}
        vertical = axis(title, *ends, domain=[top - 0.82 * share, top], nticks=4, **more)
        layout[f"yaxis{number}"] = vertical
    last = "" if len(rows) == 1 else str(len(rows))
    layout["xaxis"] = axis("time, s", 0.0, seconds, anchor=f"y{last}")
    return data, layout
