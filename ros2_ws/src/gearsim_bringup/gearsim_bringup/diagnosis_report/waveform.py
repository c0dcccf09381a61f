"""The signals over time: the whole record, and the blows of a fault one by one."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.pages.plot import (
    BLUE,
    FOUND,
    GREY,
    SERIES,
    Plot,
    axis,
    comb,
    curve,
    extremes,
)
from gearsim_dsp.envelope import squared_envelopes, window_spectrum
from gearsim_dsp.judges.finding import Finding
from gearsim_io.errors import InputError

__all__ = ["draw_blows", "draw_waveform"]

_PAIRS = 1000
_MOST_CHANNELS = 8
_BLOWS_SHOWN = 8
_BLOWS_FOLDED = 200
_PHASES = 128
_MOST_POINTS = 6000


def draw_waveform(material: Material) -> Plot:
    """All channels over the whole record, one above the other."""
    fit = list(material.channels)
    if not fit:
        raise InputError("waveform", "channels", "none", "a channel that is fit to be judged")
    names = fit[:_MOST_CHANNELS]
    share = 1.0 / len(names)
    data, layout = [], {}
    for row, name in enumerate(names):
        samples = material.samples(name)
        values, stride = extremes(samples, _PAIRS)
        colour = SERIES[row % len(SERIES)]
        number = "" if row == 0 else str(row + 1)
        data.append(
            curve(values, 0.0, stride / material.rate_hz, name, colour, width=0.8, yaxis=f"y{number}")
        )
        top = 1.0 - row * share
        title = material.unit if len(names) <= 4 else ""
        layout[f"yaxis{number}"] = axis(
            title, domain=[top - share * 0.92, top], nticks=6 if len(names) == 1 else 4
        )
    layout["xaxis"] = axis(
        "time, s", 0.0, material.record.seconds, anchor=f"y{len(names)}".replace("y1", "y")
    )
    rest = f" The first {len(names)} of {len(fit)} channels." if len(fit) > len(names) else ""
    spread = "" if len(names) == 1 else f" In {material.unit}; every channel has a scale of its own."
    caption = (
        "The whole record: for every moment the least and the greatest value, so no peak is lost. Look for "
        f"single knocks, changes of level, and flat tops of a signal that ran into its limits.{spread}{rest}"
    )
    layout["showlegend"] = len(names) > 1  # type: ignore[assignment]
    return Plot(
        "Vibration over time", caption, tuple(data), layout, 300 if len(names) == 1 else 130 + 95 * len(names)
    )


def draw_blows(material: Material, number: int, finding: Finding) -> Plot:
    """Some periods of the fault: the signal in the band of the finding, and its envelope."""
    band = material.band_hz(finding)
    x = material.samples(finding.channel, _BLOWS_FOLDED / finding.found_hz)
    envelopes = squared_envelopes(
        window_spectrum(x, material.rate_hz), np.array([band[0]]), band[1] - band[0]
    )
    power = envelopes.values[0].astype(np.float64)
    time = (envelopes.first + envelopes.stride * np.arange(power.size)) / material.rate_hz
    start, phase = _loudest(time, power, finding.found_hz)
    stop = start + _BLOWS_SHOWN / finding.found_hz
    inside = (time >= start) & (time <= stop)
    shown = x[int(start * material.rate_hz) : int(stop * material.rate_hz)]
    values, stride = extremes(shown - np.mean(shown), _MOST_POINTS // 2)
    first = int(start * material.rate_hz) / material.rate_hz
    level = np.sqrt(2 * power[inside])
    first_level, step = float(time[inside][0]), float(time[1] - time[0])
    bound = 1.05 * float(np.max(np.abs(values)))
    top = 1.08 * float(level.max())
    periods = np.arange(np.ceil((start - phase) * finding.found_hz), (stop - phase) * finding.found_hz)
    colour = FOUND[number % len(FOUND)]
    data = (
        curve(values, first, stride / material.rate_hz, "signal", GREY, width=0.8),
        curve(level, first_level, step, "envelope of the band", BLUE, yaxis="y2"),
        comb(
            (phase + periods / finding.found_hz).tolist(), 0.0, top,
            f"every {_in_ms(finding.found_hz)} ms", colour, yaxis="y2",
        ),
    )  # fmt: skip
    layout = {
        "xaxis": axis("time, s", start, stop, anchor="y2"),
        "yaxis": axis(material.unit, -bound, bound, domain=[0.56, 1.0]),
        "yaxis2": axis(material.unit, 0.0, top, domain=[0.0, 0.46]),
    }
    caption = (
        f"{_BLOWS_SHOWN} periods of the fault on channel {finding.channel}. Above the signal, below how "
        f"loud it is between {band[0]:.0f} and {band[1]:.0f} Hz. Blows of a fault come where the dashed "
        "lines are, or a little beside them, as rolling elements slip; their strength may change from one "
        "to the next."
    )
    return Plot("The blows one by one", caption, data, layout, 400)


def _in_ms(rate_hz: float) -> str:
    return f"{1000 / rate_hz:.4g}"


def _loudest(time: NDArray[np.float64], power: NDArray[np.float64], rate_hz: float) -> tuple[float, float]:
    """Where to begin, and the moment of a blow: folded over some periods the blows add up."""
    best = (-np.inf, float(time[0]), 0.0)
    span = _BLOWS_SHOWN / rate_hz
    for start in np.arange(time[0], max(time[-1] - span, time[0]) + 1e-12, span):
        inside = (time >= start) & (time < start + span)
        bins = ((time[inside] * rate_hz) % 1.0 * _PHASES).astype(np.intp)
        counts = np.maximum(np.bincount(bins, minlength=_PHASES), 1)
        folded = np.bincount(bins, power[inside], minlength=_PHASES) / counts
        peak = int(np.argmax(folded))
        contrast = float(folded[peak] / max(float(np.mean(power[inside])), 1e-300))
        if contrast > best[0]:
            best = (contrast, float(start), (peak + 0.5) / _PHASES / rate_hz)
    return best[1], best[2]
