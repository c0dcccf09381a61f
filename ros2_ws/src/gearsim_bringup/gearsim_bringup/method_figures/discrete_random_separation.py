"""Gear lines and the rest of a gear rig, told apart by DRS."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.separation.random_separation import drs, separation_gain
from gearsim_dsp.spectra import welch_psd

RECORD = "gear0/3027_217_Data_Chan12.mat"
DELAY, LENGTH = 500, 8192
MESH_HZ = 766.7
TOP_HZ = 2600.0


def draw(records: Measured) -> Figure:
    """Spectra of the record and of its two parts, and the filter's gain."""
    figure = new_figure("discrete/random separation, Gear0 (23 teeth at 33.3 Hz)", 4.8)
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    signal, rate_hz = records.signal(RECORD)
    deterministic, random = drs(signal, DELAY, LENGTH)
    parts = (
        (signal, GREY, 1.6, "record"),
        (deterministic, FAULTY, 0.7, "deterministic part"),
        (random, HEALTHY, 0.7, "random part"),
    )
    for values, colour, width, text in parts:
        psd = welch_psd(values, rate_hz, 2.5)
        shown = psd.frequency_hz < TOP_HZ
        level = 10 * np.log10(psd.density[shown])
        upper.plot(psd.frequency_hz[shown], level, color=colour, linewidth=width, label=text)
    for k in (1, 2, 3):
        mark(upper, k * MESH_HZ, f"{k} GMF")
    upper.set_ylim(-85, None)
    upper.set_ylabel("PSD [dB]")
    upper.legend(loc="upper right")
    gain = np.abs(separation_gain(signal, DELAY, LENGTH))
    at = np.arange(gain.size) * rate_hz / LENGTH
    lower.plot(at[at < TOP_HZ], gain[at < TOP_HZ], color=GREY, linewidth=0.7)
    lower.set_ylabel("|G|")
    lower.set_xlabel("frequency [Hz]")
    lower.set_xlim(0, TOP_HZ)
    lower.set_ylim(0, 1)
    return figure
