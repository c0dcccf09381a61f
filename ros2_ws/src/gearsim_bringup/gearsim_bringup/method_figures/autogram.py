"""The autogram of a damaged bearing with the band chosen, and the envelope of that band."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.band_maps import draw_choice, draw_envelope, draw_map
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, MARK, new_figure
from gearsim_dsp.impulsive.autogram import autogram, choose_by_autogram

RECORD, BPFO_HZ = "mfpt/OuterRaceFault_vload_3.mat", 80.3
LEVELS = 6


def draw(records: Measured) -> Figure:
    """The map with the band chosen, and the envelope's spectrum of that."""
    figure = new_figure("autogram, MFPT outer race, 100 lb: chosen under guards (red)", 4.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    signal, rate_hz = records.signal(RECORD)
    bands = autogram(signal, rate_hz, LEVELS).bands
    draw_map(left, ((b.level, b.low_hz, b.high_hz, b.value) for b in bands), "V")
    band = choose_by_autogram(signal, rate_hz, 4 * BPFO_HZ, np.random.default_rng(1)).band
    assert band is not None
    draw_choice(left, [b.level for b in bands], band.low_hz, band.high_hz, FAULTY)
    draw_envelope(right, signal, rate_hz, band, BPFO_HZ, MARK)
    right.set_title(
        f"envelope of {band.low_hz / 1e3:.1f} to {band.high_hz / 1e3:.1f} kHz", fontsize=9, pad=14
    )
    return figure
