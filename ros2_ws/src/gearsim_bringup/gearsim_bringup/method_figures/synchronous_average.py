"""A turbine's pinion averaged without tacho while the speed falls, beside the average at constant speed."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.tsa import shaft_average

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
SHOWN_TURNS = 0.3


def draw(records: Measured) -> Figure:
    """Part of a turn of the pinion: by the angle found in the vibration, and by a constant speed."""
    signal, rate_hz = records.signal(RECORD)
    track = track_speed(signal, rate_hz, records.machine(RECORD))
    steady = Phase(track.phase.samples[[0, -1]], track.phase.turns[[0, -1]])
    tracked, blurred = shaft_average(signal, track.phase), shaft_average(signal, steady)
    figure = new_figure(
        f"wind turbine, high-speed pinion, {tracked.count} turns, speed falling by {100 * track.change:.1f} %"
    )
    upper, lower = figure.subplots(2, 1)
    shown = tracked.turns < SHOWN_TURNS
    turns, mean = tracked.turns[shown], (tracked.values - tracked.values.mean())[shown]
    upper.fill_between(
        turns, *_band(mean, tracked.std[shown]), color=HEALTHY, alpha=0.2, label="single turns, +-1 std"
    )
    upper.plot(turns, mean, color=HEALTHY, linewidth=1.0, label="average by the angle found without tacho")
    shown = blurred.turns < SHOWN_TURNS
    upper.plot(
        blurred.turns[shown],
        (blurred.values - blurred.values.mean())[shown],
        color=FAULTY,
        linewidth=0.9,
        label="average at constant speed",
    )
    upper.set_xlabel("turn of the pinion")
    upper.set_ylabel("acceleration [unit not stated]")
    upper.set_xlim(0, SHOWN_TURNS)
    upper.legend(loc="lower right", ncols=3)
    for average, colour, text in ((blurred, FAULTY, "constant speed"), (tracked, HEALTHY, "angle found")):
        orders, lines = average.spectrum()
        inside = (orders > 0) & (orders < 160)
        lower.plot(orders[inside], 20 * np.log10(lines[inside]), color=colour, linewidth=1.0, label=text)
    lower.axhline(
        20 * np.log10(tracked.noise_rms * np.sqrt(4 / tracked.values.size)),
        color=GREY,
        linestyle=":",
        label="what noise leaves in a line",
    )
    lower.set_xlabel("order of the pinion (22 teeth: mesh harmonics at 22, 44, 66 ...)")
    lower.set_ylabel("amplitude [dB]")
    lower.set_xlim(0, 160)
    lower.legend(loc="upper right", ncols=3)
    return figure


def _band(
    mean: NDArray[np.float64], std: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return mean - std, mean + std
