"""A measured average cut into its regular and its difference signal."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.synchronous.indicators import gear_indicators
from gearsim_dsp.synchronous.signals import difference_signal, mesh_lines, regular_signal
from gearsim_dsp.synchronous.tsa import shaft_average

RECORD, TEETH = "wt_hss_gear/health_20160306171241_25600.csv", 22
TOP_ORDER = 200


def draw(records: Measured) -> Figure:
    """The lines that are regular, and both signals over the turn of the pinion."""
    signal, rate_hz = records.signal(RECORD)
    average = shaft_average(signal, track_speed(signal, rate_hz, records.machine(RECORD)).phase)
    orders, lines = average.spectrum()
    regular = mesh_lines(average, [TEETH], 1)
    found = gear_indicators(average, TEETH)
    figure = new_figure(
        f"wind turbine, high-speed pinion of {TEETH} teeth: FM0 {found.fm0:.2f}, FM4 {found.fm4:.2f}, "
        f"M6A {found.m6a:.1f}, energy ratio {found.energy_ratio:.2f}, sidebands {found.sideband_level:.2f}",
        5.6,
    )
    upper, middle, lower = figure.subplots(3, 1)
    inside = (orders > 0) & (orders < TOP_ORDER)
    level = 20 * np.log10(lines)
    for part, colour, text in (
        (inside & ~regular, GREY, "difference"),
        (inside & regular, HEALTHY, "regular"),
    ):
        upper.vlines(orders[part], -90, level[part], color=colour, linewidth=1.2, label=text)
    upper.set_xlabel("order of the pinion")
    upper.set_ylabel("amplitude [dB]")
    upper.set_xlim(0, TOP_ORDER)
    upper.set_ylim(-90, 5)
    upper.legend(loc="upper right")
    wave = regular_signal(average, [TEETH])
    for axes, values, colour, text in (
        (middle, wave - wave.mean(), HEALTHY, "regular"),
        (lower, difference_signal(average, [TEETH]), FAULTY, "difference"),
    ):
        axes.plot(average.turns, values, color=colour, linewidth=0.7)
        axes.set_ylabel(text)
        axes.set_xlim(0, 1)
    lower.set_xlabel("turn of the pinion")
    return figure
