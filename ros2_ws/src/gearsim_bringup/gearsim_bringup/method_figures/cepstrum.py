"""The cepstrum of a gearbox with its rahmonics, and a bearing's impacts brought out by pre-whitening."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.cepstrum import comb_lifter, liftered, prewhitened, real_cepstrum

GEARBOX, SHAFT_HZ = "sq_gearbox/h30hz0.csv.gz", 29.76
BEARING = "hit_sm/SQ_IR2_1200.mat"
SHOWN_S = (2.0, 2.25)


def draw(records: Measured) -> Figure:
    """Above: real cepstrum before and after a comb lifter; below: record and pre-whitened record."""
    figure = new_figure("cepstrum: SpectraQuest gearbox (above), HIT-SM inner race (below)", 5.2)
    rows = figure.subplots(3, 1, height_ratios=(3, 2, 2))
    signal, rate_hz = records.signal(GEARBOX)
    lifter = comb_lifter(signal.size, rate_hz / SHAFT_HZ, 2.0)
    for values, colour, text in (
        (signal, FAULTY, "record"),
        (liftered(signal, lifter), GREY, "shaft's rahmonics liftered"),
    ):
        cepstrum = real_cepstrum(values)
        quefrency_s = np.arange(cepstrum.size) / rate_hz
        shown = (quefrency_s > 0.008) & (quefrency_s < 0.145)
        rows[0].plot(quefrency_s[shown], cepstrum[shown], color=colour, linewidth=0.7, label=text)
    for k in (1, 2, 3, 4):
        mark(rows[0], k / SHAFT_HZ, f"{k} / shaft speed")
    rows[0].set_xlabel("quefrency [s]")
    rows[0].set_ylabel("real cepstrum")
    rows[0].legend(loc="upper right")
    signal, rate_hz = records.signal(BEARING)
    part = slice(int(SHOWN_S[0] * rate_hz), int(SHOWN_S[1] * rate_hz))
    for axes, values, colour, text in (
        (rows[1], signal, GREY, "record"),
        (rows[2], prewhitened(signal), HEALTHY, "pre-whitened"),
    ):
        axes.plot(np.arange(part.start, part.stop) / rate_hz, values[part], color=colour, linewidth=0.6)
        axes.set_ylabel(f"{text}\n[not stated]", fontsize=8)
        axes.text(0.01, 0.88, f"kurtosis {kurtosis(values):.0f}", transform=axes.transAxes, fontsize=8)
    rows[2].set_xlabel("time [s]")
    return figure
