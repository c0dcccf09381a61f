"""A bearing's impacts in the residual of linear prediction, and the length chosen by kurtosis."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.linear_prediction import ar_residual, kurtosis_by_length, longest_ar_length

RECORD, HEALTHY_RECORD = "cwru/135_0.mat", "cwru/97_Normal_0.mat"
IMPACTS_HZ = 107.6
SHOWN_S = (1.0, 1.1)


def draw(records: Measured) -> Figure:
    """Waveform, residual, and kurtosis over the length."""
    figure = new_figure("linear prediction, CWRU 135 (outer race) and 97 (sound)", 4.6)
    grid = figure.add_gridspec(2, 3)
    signal, rate_hz = records.signal(RECORD)
    longest = longest_ar_length(rate_hz, IMPACTS_HZ, signal.size)
    curve = kurtosis_by_length(signal, longest)
    best = int(np.argmax(curve)) + 1
    part = slice(int(SHOWN_S[0] * rate_hz), int(SHOWN_S[1] * rate_hz))
    time_s = np.arange(part.start, part.stop) / rate_hz
    residual = ar_residual(signal, best)
    for row, (values, colour, text) in enumerate(
        ((signal, GREY, "record"), (residual, FAULTY, f"residual, length {best}"))
    ):
        axes = figure.add_subplot(grid[row, :2])
        axes.plot(time_s, values[part], color=colour, linewidth=0.7)
        axes.set_title(f"{text}: kurtosis {kurtosis(values):.1f}", fontsize=9)
        axes.set_ylabel("acceleration [g]")
    axes.set_xlabel("time [s]")
    axes = figure.add_subplot(grid[:, 2])
    sound, _ = records.signal(HEALTHY_RECORD)
    lengths = np.arange(1, longest + 1)
    axes.plot(lengths, curve, color=FAULTY, label="outer race")
    axes.plot(lengths, kurtosis_by_length(sound, longest), color=HEALTHY, label="sound")
    mark(axes, best, str(best))
    axes.set_xlabel("length [samples]")
    axes.set_ylabel("kurtosis of the residual")
    axes.legend(loc="center right")
    return figure
