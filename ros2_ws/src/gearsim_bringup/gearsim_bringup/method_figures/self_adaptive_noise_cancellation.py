"""A turbine that slows down by 4 % in 4 s: SANC follows its lines, one filter for all (DRS) does not."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import BoundaryNorm
from matplotlib.figure import Figure
from scipy.signal import spectrogram

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import new_figure
from gearsim_dsp.separation.adaptive import sanc
from gearsim_dsp.separation.random_separation import drs

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
DELAY, LENGTH, STEP = 200, 1024, 0.02
DRS_LENGTH = 4096
TOP_HZ = 2000.0
STEPS = BoundaryNorm(np.arange(-50.0, -9.0, 5.0), 256, extend="both")


def draw(records: Measured) -> Figure:
    """Spectrograms of the record and of the random part by either method."""
    figure = new_figure("a wind turbine's gearbox slowing down: what is left without its lines", 3.6)
    signal, rate_hz = records.signal(RECORD)
    parts = (
        ("record", signal),
        ("random part, SANC", sanc(signal, DELAY, LENGTH, STEP)[1]),
        ("random part, DRS without order tracking", drs(signal, DELAY, DRS_LENGTH)[1]),
    )
    image = None
    for axes, (text, values) in zip(figure.subplots(1, 3, sharey=True), parts, strict=True):
        frequency_hz, time_s, density = spectrogram(values, rate_hz, "hann", 2048, 512)
        shown = frequency_hz < TOP_HZ
        level = 10 * np.log10(density[shown] + 1e-12)
        image = axes.pcolormesh(time_s, frequency_hz[shown], level, norm=STEPS, cmap="magma")
        axes.set_title(text, fontsize=9)
        axes.set_xlabel("time [s]")
        axes.grid(visible=False)
        if not axes.get_subplotspec().colspan.start:
            axes.set_ylabel("frequency [Hz]")
    assert image is not None
    figure.colorbar(image, ax=figure.axes, label="PSD [dB]", pad=0.01)
    return figure
