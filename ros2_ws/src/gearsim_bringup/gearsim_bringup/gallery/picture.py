"""One picture: waveform, spectrum and envelope spectrum, healthy behind faulty."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearsim_bringup.gallery.analysis import Comparison
from gearsim_bringup.gallery.marks import mark_orders

_HEALTHY, _FAULTY = "#8a8a8a", "#c0392b"
_LOWEST_HZ = 1.0
_DPI = 80


def draw(comparison: Comparison, title: str, out: Path) -> None:
    """Write the picture as PNG."""
    with mpl.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True}):
        figure = Figure(figsize=(11, 6.2), layout="constrained")
        figure.suptitle(title, fontsize=11)
        axes = figure.subplot_mosaic([["waveform", "waveform"], ["spectrum", "envelope"]])
        _waveform(axes["waveform"], comparison)
        _spectrum(axes["spectrum"], comparison)
        _envelope(axes["envelope"], comparison)
        figure.savefig(out, dpi=_DPI, metadata={"Software": None})


def _waveform(axes: Axes, comparison: Comparison) -> None:
    healthy, faulty = comparison.waveforms
    axes.plot(comparison.time_s, faulty, color=_FAULTY, linewidth=0.6, label="with the fault")
    axes.plot(comparison.time_s, healthy, color=_HEALTHY, linewidth=0.6, label="without")
    axes.set_xlabel("time [s]")
    axes.set_ylabel(f"{comparison.channel} [{comparison.unit}]")
    axes.margins(x=0)
    axes.legend(loc="upper right", ncols=2, framealpha=0.9)


def _spectrum(axes: Axes, comparison: Comparison) -> None:
    shown = comparison.frequency_hz >= _LOWEST_HZ
    # Healthy in front: what rises above it in red is the fault's.
    for density, colour in zip(comparison.densities[::-1], (_FAULTY, _HEALTHY), strict=True):
        level = 10 * np.log10(np.maximum(density[shown], np.finfo(float).tiny))
        axes.plot(comparison.frequency_hz[shown], level, color=colour, linewidth=0.7)
    highest = max(10 * np.log10(density[shown].max()) for density in comparison.densities)
    axes.set_ylim(highest - 110, highest + 5)
    axes.set_xscale("log")
    axes.set_xlim(comparison.frequency_hz[shown][0], comparison.frequency_hz[-1])
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel(f"PSD [dB re 1 ({comparison.unit})²/Hz]")
    axes.set_title("power spectral density", fontsize=9)


def _envelope(axes: Axes, comparison: Comparison) -> None:
    shown = comparison.orders > 0.05
    for power, colour in zip(comparison.envelopes[::-1], (_FAULTY, _HEALTHY), strict=True):
        axes.plot(comparison.orders[shown], 2 * np.sqrt(power[shown]), color=colour, linewidth=0.8)
    low, high = (edge / 1e3 for edge in comparison.band_hz)
    axes.set_xlabel("order of the reference shaft")
    axes.set_ylabel("modulation of the squared envelope")
    axes.set_title(f"squared envelope spectrum of {low:.3g} to {high:.3g} kHz", fontsize=9)
    axes.set_xlim(0, comparison.orders[-1])
    axes.set_ylim(bottom=0)
    mark_orders(axes, comparison.families)
