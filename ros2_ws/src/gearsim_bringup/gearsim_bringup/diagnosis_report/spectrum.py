"""The power spectrum: the whole range, and the part in which faults have their own lines."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gearsim_bringup.diagnosis_report.lines import all_marks, drawn
from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.pages.plot import BLUE, FOUND, Plot, axis, curve, strongest
from gearsim_dsp.spectra import welch_psd

__all__ = ["draw_low_spectrum", "draw_spectrum"]

_POINTS = 2500
_LOW_POINTS = 5000
_FINE_S = 2.0
_LEAST_TOP_HZ = 50.0
_SMEARING = 0.005


def draw_spectrum(material: Material) -> Plot:
    """Power spectral density up to half the sampling rate, with the bands that were demodulated."""
    x = material.samples(material.channel)
    psd = welch_psd(x, material.rate_hz, max(1.0, material.rate_hz / 8192))
    level, length = strongest(psd.density[1:], _POINTS)
    step = psd.step_hz * length
    low, high = _ends(level)
    data = [curve(level, psd.step_hz + 0.5 * (step - psd.step_hz), step, material.channel, BLUE)]
    shapes = []
    for number, finding in enumerate(material.of_bearings()):
        if finding.channel == material.channel:
            shapes.append(_shade(material.band_hz(finding), FOUND[number % len(FOUND)]))
    layout: dict[str, Any] = {
        "xaxis": axis("frequency, Hz", 0.0, material.rate_hz / 2),
        "yaxis": axis(material.density_unit, low, high, type="log", exponentformat="power", dtick=1),
        "shapes": shapes,
        "showlegend": False,
    }
    shaded = " The shaded band is the one whose envelope shows the fault best." if shapes else ""
    caption = (
        f"How the power of channel {material.channel} spreads over frequency. Broad hills are resonances, "
        f"sharp peaks are gears, shafts and electrical supply.{shaded}"
    )
    return Plot("Power spectrum", caption, tuple(data), layout)


def draw_low_spectrum(material: Material) -> Plot:
    """The same where shafts, meshes and faults have their first lines, with these marked."""
    x = material.samples(material.channel)
    psd = welch_psd(x, material.rate_hz, max(1 / _FINE_S, 1 / material.record.seconds))
    top = _top_hz(material)
    kept = psd.density[1 : max(16, round(top / psd.step_hz) + 1)]
    level, length = strongest(kept, _LOW_POINTS)
    step = psd.step_hz * length
    low, high = _ends(level)
    data = [curve(level, psd.step_hz + 0.5 * (step - psd.step_hz), step, material.channel, BLUE)]
    if math.isfinite(material.speed_hz):
        data += drawn(all_marks(material), top, (low, high), material.speed_hz)
    layout = {
        "xaxis": axis("frequency, Hz", 0.0, top),
        "yaxis": axis(material.density_unit, low, high, type="log", exponentformat="power", dtick=1),
    }
    change = material.speed_change
    smeared = f" The speed changes by {100 * change:.2g} %, which smears lines; the order spectrum does not."
    caption = (
        "The lower part of the same spectrum with the lines that nameplate and speed foretell; a click on an "
        "entry of the legend shows or hides its lines. Bearing faults often hide here, while the envelope "
        f"shows them.{smeared if change > _SMEARING else ''}"
    )
    return Plot("Power spectrum with the expected lines", caption, tuple(data), layout, 400)


def _top_hz(material: Material) -> float:
    speed = material.speed_hz
    limit = 0.45 * material.rate_hz
    if not math.isfinite(speed):
        return min(limit, 1000.0)
    orders = [order for _, _, order in material.expected()]
    top = max([8.0, *(3.3 * order for order in orders), *(2.3 * mesh.order for mesh in material.meshes())])
    return min(limit, max(_LEAST_TOP_HZ, top * speed))


def _ends(level: np.ndarray[Any, np.dtype[np.float64]]) -> tuple[float, float]:
    """Ends of a logarithmic axis that one empty line does not stretch."""
    positive = level[level > 0]
    if positive.size == 0:
        return 1e-12, 1.0
    return float(np.quantile(positive, 0.002)) / 2, 2 * float(positive.max())


def _shade(band_hz: tuple[float, float], colour: str) -> dict[str, Any]:
    return {
        "type": "rect",
        "xref": "x",
        "yref": "paper",
        "x0": band_hz[0],
        "x1": band_hz[1],
        "y0": 0,
        "y1": 1,
        "fillcolor": colour,
        "opacity": 0.18,
        "line": {"width": 0},
        "layer": "below",
    }
