"""The fast kurtogram of a record whose maximum lies in the anti-alias filter's slope."""

from __future__ import annotations

from matplotlib.figure import Figure

from gearsim_bringup.method_figures.band_maps import draw_choice, draw_envelope, draw_map
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, MARK, mark, new_figure
from gearsim_dsp.band_choice import choose_band, usable_ceiling_hz
from gearsim_dsp.kurtogram import fast_kurtogram

RECORD, BPFO_HZ = "cwru/135_0.mat", 107.6
LEVELS = 6
CHOSEN = "#7dff8a"


def draw(records: Measured) -> Figure:
    """The map with its maximum and the band chosen, and the envelope's spectrum of that."""
    figure = new_figure("fast kurtogram, CWRU 135: plain maximum (red), chosen under guards (green)", 4.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    signal, rate_hz = records.signal(RECORD)
    kurtogram = fast_kurtogram(signal, rate_hz, LEVELS)
    nodes = kurtogram.nodes
    draw_map(left, ((n.level, n.low_hz, n.high_hz, max(n.kurtosis, 0.0)) for n in nodes), "excess kurtosis")
    best = kurtogram.strongest
    levels = [n.level for n in nodes]
    draw_choice(left, levels, best.low_hz, best.high_hz, FAULTY)
    band = choose_band(signal, rate_hz, 8 * BPFO_HZ).band
    assert band is not None
    draw_choice(left, levels, band.low_hz, band.high_hz, CHOSEN)
    mark(left, usable_ceiling_hz(signal, rate_hz) / 1e3, "roll-off", GREY)
    draw_envelope(right, signal, rate_hz, band, BPFO_HZ, MARK)
    right.set_title(f"envelope of {band.low_hz / 1e3:g} to {band.high_hz / 1e3:g} kHz", fontsize=9, pad=14)
    return figure
