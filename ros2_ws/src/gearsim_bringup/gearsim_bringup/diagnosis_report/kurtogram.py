"""The kurtogram: in which band of frequency the signal is impulsive."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import fft as sfft

from gearsim_bringup.diagnosis_report.material import LONGEST_S, Material
from gearsim_bringup.pages.plot import FOUND, Plot, axis, packed
from gearsim_dsp.band_choice import usable_ceiling_hz
from gearsim_dsp.envelope import suppress_lines, window_spectrum
from gearsim_dsp.kurtogram import KurtogramNode, fast_kurtogram, largest_level

__all__ = ["draw_kurtogram"]

_LEVELS = 7
_SEGMENTS = 8
_HIGHEST_CUT = 0.995


def draw_kurtogram(material: Material) -> Plot:
    """Kurtosis over frequency and width of the band, as the choice of bands sees it."""
    x = np.asarray(material.samples(material.channel, LONGEST_S), dtype=np.float32)
    spectrum = suppress_lines(window_spectrum(x, material.rate_hz))
    clean = sfft.irfft(spectrum.lines, n=spectrum.samples).astype(np.float32)
    levels = min(_LEVELS, largest_level(clean.size))
    nodes = fast_kurtogram(clean, material.rate_hz, levels, _SEGMENTS).nodes
    rows = sorted({node.level for node in nodes})
    columns = 3 << levels
    z = np.array([_row([n for n in nodes if n.level == level], columns) for level in rows])
    widths = [material.rate_hz / 2 / 2**level for level in rows]
    top = material.rate_hz / 2
    heat: dict[str, Any] = {
        "type": "heatmap",
        "z": packed(z),
        "x0": top / columns / 2,
        "dx": top / columns,
        "y": list(range(len(rows))),
        "zmin": 0.0,
        "zmax": max(1.0, float(np.quantile(z, _HIGHEST_CUT))),
        "colorscale": [
            [0, "#fdfcf3"],
            [0.25, "#fee08b"],
            [0.5, "#f28e4b"],
            [0.75, "#cf3b2e"],
            [1, "#5c0a1e"],
        ],
        "colorbar": {"title": {"text": "kurtosis", "side": "right"}, "thickness": 12, "len": 1.0},
        "hovertemplate": "%{x:.0f} Hz: %{z:.3g}<extra></extra>",
    }
    ceiling = usable_ceiling_hz(x, material.rate_hz)
    shapes = (
        [_box((ceiling, top), (-0.5, len(rows) - 0.5), "rgba(75,85,99,0.25)", 0)] if ceiling < top else []
    )
    for number, finding in enumerate(material.of_bearings()):
        if finding.channel == material.channel:
            band = material.band_hz(finding)
            nearest = int(np.argmin(np.abs(np.log(np.array(widths) / (band[1] - band[0])))))
            rise = (nearest - 0.5, nearest + 0.5)
            shapes.append(_box(band, rise, "rgba(0,0,0,0)", 2.5, FOUND[number % len(FOUND)]))
    framed = len(shapes) > int(ceiling < top)
    layout = {
        "xaxis": axis("frequency, Hz", 0.0, top),
        "yaxis": axis(
            "width of the band, Hz",
            len(rows) - 0.5,
            -0.5,
            tickvals=list(range(len(rows))),
            ticktext=[f"{width:.0f}" for width in widths],
        ),
        "shapes": shapes,
        "showlegend": False,
    }
    return Plot("Kurtogram", _caption(material, x.size, framed, ceiling < top), (heat,), layout, 380)


def _caption(material: Material, count: int, framed: bool, shaded: bool) -> str:
    notes = []
    if framed:
        notes.append("Framed: the band whose envelope shows the fault best.")
    if shaded:
        notes.append("Shaded: beyond what the measuring chain lets through.")
    if count < material.record.sample_count:
        notes.append(f"Of the first {count / material.rate_hz:.0f} s.")
    return " ".join(
        [
            f"How impulsive channel {material.channel} is in bands of every place and width, discrete lines "
            "limited",
            "first; the median of eight parts of the record, so that a single knock does not count. 0 is "
            "noise, dark",
            "is impulsive.",
            *notes,
        ]
    )


def _row(nodes: list[KurtogramNode], columns: int) -> np.ndarray[Any, np.dtype[np.float64]]:
    values = [node.segment_kurtosis for node in sorted(nodes, key=lambda node: node.low_hz)]
    return np.asarray(np.maximum(np.repeat(values, columns // len(values)), 0.0))


def _box(
    x: tuple[float, float], y: tuple[float, float], fill: str, width: float, colour: str = "#6b7280"
) -> dict[str, Any]:
    return {
        "type": "rect",
        "x0": x[0],
        "x1": x[1],
        "y0": y[0],
        "y1": y[1],
        "fillcolor": fill,
        "line": {"width": width, "color": colour} if width else {"width": 0},
    }
