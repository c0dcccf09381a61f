"""Cyclic coherence: which carrier frequencies swing, and how often."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_bringup.diagnosis_report.lines import drawn, expected_marks, finding_marks
from gearsim_bringup.diagnosis_report.material import LONGEST_S, Material
from gearsim_bringup.diagnosis_report.words import shaft_words
from gearsim_bringup.pages.plot import BLUE, Plot, axis, curve, packed, strongest
from gearsim_dsp.band_choice import usable_ceiling_hz
from gearsim_dsp.cyclic.averaging import averaged_coherence

__all__ = ["draw_coherence"]

_WINDOW_S = 2.0
_BINS = 96
_LEAST_BIN_HZ = 128.0
_COLUMNS = 240
_MEAN_POINTS = 2000
_TOP_HZ = 400.0
_CHANCE = 1e-3


def draw_coherence(material: Material) -> Plot:
    """Squared cyclic coherence where it exceeds what noise shows, and its mean over the carriers."""
    seconds = min(LONGEST_S, material.record.seconds)
    x = material.samples(material.channel, seconds)
    phase = material.cut(seconds)
    bin_hz = max(_LEAST_BIN_HZ, material.rate_hz / 2 / _BINS)
    top_hz = min(_top_hz(material), 0.2 * material.rate_hz)
    top = top_hz if phase is None else top_hz / material.speed_hz
    whole = averaged_coherence(x, material.rate_hz, bin_hz, top, min(_WINDOW_S, 0.999 * seconds), phase)
    used = whole.bins((whole.first_bin * bin_hz, usable_ceiling_hz(x, material.rate_hz)))
    values = np.asarray(whole.values[used], dtype=np.float64)
    values[:, : _first(whole.alpha_step, top)] = 0.0
    threshold = whole.threshold(_CHANCE / whole.values.shape[0])
    pooled, length = _pooled(values)
    pooled = np.where(pooled >= threshold, pooled, 0.0)
    mean, stretch = strongest(values.mean(axis=0), _MEAN_POINTS)
    step = whole.alpha_step
    unit = "Hz" if phase is None else f"order of {shaft_words(material.machine.reference_shaft)}"
    heat: dict[str, Any] = {
        "type": "heatmap",
        "z": packed(pooled),
        "x0": 0.5 * (length - 1) * step,
        "dx": length * step,
        "y0": float(whole.frequency_hz[used][0]) / 1000,
        "dy": bin_hz / 1000,
        "zmin": 0.0,
        "zmax": max(2 * threshold, float(np.quantile(pooled[pooled > 0], 0.98)) if np.any(pooled) else 0.0),
        "colorscale": [[0, "#ffffff"], [0.15, "#dbe7f4"], [0.5, "#5b92cf"], [1, "#0b2f5e"]],
        "yaxis": "y",
        "colorbar": {"title": {"text": "coherence²", "side": "right"}, "thickness": 12, "len": 0.6, "y": 0.7},
        "hovertemplate": "cyclic %{x:.5~g}, carrier %{y:.3g} kHz: %{z:.3g}<extra></extra>",
    }
    high = 1.1 * float(mean.max())
    low = 0.9 * float(np.quantile(mean[mean > 0], 0.01)) if np.any(mean > 0) else 0.0
    data = [
        heat,
        curve(mean, 0.5 * (stretch - 1) * step, stretch * step, "mean over carriers", BLUE, yaxis="y2"),
        *_marked(material, top, 1.0 if phase is not None else material.speed_hz, (low, high)),
    ]
    layout = {
        "xaxis": axis(f"cyclic frequency, {unit}", 0.0, top, anchor="y2"),
        "yaxis": axis("carrier, kHz", domain=[0.40, 1.0]),
        "yaxis2": axis("mean", low, high, domain=[0.0, 0.30], nticks=4),
    }
    caption = (
        f"For every frequency of channel {material.channel} (upwards) how regularly its strength swings at "
        "every rate (to the right); white is what noise may show. Impacts give upright lines at the rate "
        "of the fault and its multiples. No band has to be chosen first, so this checks the envelope "
        "spectrum independently."
    )
    return Plot("Cyclic coherence", caption, tuple(data), layout, 470)


def _top_hz(material: Material) -> float:
    found = [finding.found_hz for finding in material.of_bearings()]
    if found:
        return max(4.5 * max(found), 2.0)
    orders = [order for _, _, order in material.expected()]
    if orders and math.isfinite(material.speed_hz):
        return 2.5 * max(orders) * material.speed_hz
    return _TOP_HZ


def _first(step: float, top: float) -> int:
    """Columns next to zero hold the mean itself and slow drifts."""
    return max(4, math.ceil(0.01 * top / step))


def _pooled(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    length = max(1, -(-values.shape[1] // _COLUMNS))
    short = -values.shape[1] % length
    whole = np.pad(values, ((0, 0), (0, short)))
    return whole.reshape(values.shape[0], -1, length).max(axis=2), length


def _marked(material: Material, top: float, scale: float, rise: tuple[float, float]) -> list[dict[str, Any]]:
    if not math.isfinite(scale):
        return []
    marks = [m for n, f in enumerate(material.diagnosis.findings) if "band_hz" in f.evidence
             for m in finding_marks(material, n, f, 4)]  # fmt: skip
    marks += expected_marks(material, 2, "legendonly" if marks else True)
    return drawn(marks, top, rise, scale, yaxis="y2", opacity=0.7)
