"""Impacts of an outer race turned back from ringing into pulses by MED and by MCKD."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.features import kurtosis
from gearsim_dsp.separation.deconvolution import correlated_kurtosis, mckd, med

RECORD = "mfpt/OuterRaceFault_vload_5.mat"
IMPACTS_HZ = 80.3
TAPS = 120
SHOWN_S = (1.0, 1.1)


def draw(records: Measured) -> Figure:
    """Record and both outputs over the same stretch."""
    figure = new_figure("deconvolution, MFPT outer race, 200 lb", 4.8)
    signal, rate_hz = records.signal(RECORD)
    period = round(rate_hz / IMPACTS_HZ)
    part = slice(int(SHOWN_S[0] * rate_hz), int(SHOWN_S[1] * rate_hz))
    rows = (
        ("record", signal, GREY),
        ("MED", med(signal, TAPS).values, HEALTHY),
        ("MCKD, 1 shift", mckd(signal, TAPS, period, 1).values, FAULTY),
    )
    for axes, (text, values, colour) in zip(figure.subplots(3, 1, sharex=True), rows, strict=True):
        axes.plot(np.arange(part.start, part.stop) / rate_hz, values[part], color=colour, linewidth=0.7)
        share = 1e4 * correlated_kurtosis(values, period, 1)
        axes.set_title(f"{text}: kurtosis {kurtosis(values):.1f}, CK {share:.2f}e-4", fontsize=9)
        axes.set_ylabel("[g]")
    axes.set_xlabel("time [s]")
    return figure
