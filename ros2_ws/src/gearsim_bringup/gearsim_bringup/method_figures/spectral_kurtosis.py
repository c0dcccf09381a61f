"""Spectral kurtosis of a sound and of a damaged bearing, with the limit of chance."""

from __future__ import annotations

from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.features import kurtosis
from gearsim_dsp.impulsive.spectral_kurtosis import spectral_kurtosis

FAULTY_RECORD, HEALTHY_RECORD = "mfpt/OuterRaceFault_vload_5.mat", "mfpt/baseline_1.mat"
WINDOW_S = 0.0026
SHOWN_S = (1.0, 1.1)


def draw(records: Measured) -> Figure:
    """Left: SK over frequency; right: the record before and after the filter made of it."""
    figure = new_figure("spectral kurtosis, MFPT: outer race (red) and baseline (blue)", 3.8)
    grid = figure.add_gridspec(2, 2)
    axes = figure.add_subplot(grid[:, 0])
    for name, colour in ((HEALTHY_RECORD, HEALTHY), (FAULTY_RECORD, FAULTY)):
        signal, rate_hz = records.signal(name)
        found = spectral_kurtosis(signal, rate_hz, round(WINDOW_S * rate_hz))
        axes.plot(found.frequency_hz / 1e3, found.values, color=colour, linewidth=0.9)
        limit = found.chance_limit()
        axes.axhline(limit, color=colour, linewidth=0.8, linestyle="--")
    axes.set_xlim(0, 24.4)
    axes.set_ylim(-0.5, None)
    axes.set_xlabel("frequency [kHz]")
    axes.set_ylabel("SK; dashed: one false alarm in 1000 records")
    part = slice(int(SHOWN_S[0] * rate_hz), int(SHOWN_S[1] * rate_hz))
    filtered = found.filtered(signal)
    for row, (values, colour, text) in enumerate(
        ((signal, GREY, "record"), (filtered, FAULTY, "filtered by sqrt(SK)"))
    ):
        axes = figure.add_subplot(grid[row, 1])
        time_s = [k / rate_hz for k in range(part.start, part.stop)]
        axes.plot(time_s, values[part], color=colour, linewidth=0.7)
        axes.set_title(f"{text}: kurtosis {kurtosis(values):.1f}", fontsize=9)
        axes.set_ylabel("[g]")
    axes.set_xlabel("time [s]")
    return figure
