"""The order spectrum of a wind turbine whose speed falls by 4 %, by time and by angle."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import GREY, HEALTHY, mark, new_figure
from gearsim_dsp.angle.resample import AngleSignal, full_rate, to_angle
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.speed import Phase

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
INTERMEDIATE = 21 * 22 / 112


def draw(records: Measured) -> Figure:
    """Grey: as if the speed were steady; blue: by the angle that was found in the vibration."""
    signal, rate_hz = records.signal(RECORD)
    phase = track_speed(signal, rate_hz, records.machine(RECORD)).phase
    steady = Phase(phase.samples[[0, -1]], phase.turns[[0, -1]])
    per_turn = full_rate(phase)
    by_time, by_angle = to_angle(signal, steady, per_turn), to_angle(signal, phase, per_turn)
    figure = new_figure(
        "order spectra of a wind turbine's high-speed stage, 4 s, speed falling by 4.3 %", 5.2
    )
    rows = figure.subplots(2, 1)
    _panel(rows[0], by_time, by_angle, (2.0, 26.0))
    for k in range(1, 7):
        mark(rows[0], k * INTERMEDIATE, f"{k} x 4.125" if k < 5 else "")
    mark(rows[0], 22.0, "mesh")
    _panel(rows[1], by_time, by_angle, (85.0, 91.0))
    mark(rows[1], 88.0, "4 x mesh")
    for k in (-2, -1, 1, 2):
        mark(rows[1], 88.0 + k, f"{k:+d}")
    rows[1].set_xlabel("order of the high-speed shaft")
    rows[0].legend(loc="upper left", ncols=2)
    return figure


def _panel(axes: Axes, by_time: AngleSignal, by_angle: AngleSignal, shown: tuple[float, float]) -> None:
    for signal, colour, label in (
        (by_time, GREY, "steady speed assumed"),
        (by_angle, HEALTHY, "resampled by angle"),
    ):
        orders, lines = signal.spectrum()
        inside = (orders >= shown[0]) & (orders <= shown[1])
        level = 20 * np.log10(np.maximum(lines[inside], 1e-9))
        axes.plot(orders[inside], level, color=colour, linewidth=0.8, label=label)
        axes.set_ylim(np.percentile(level, 2) - 4, level.max() + 6)
    axes.set_xlim(*shown)
    axes.set_ylabel("amplitude [dB re 1]")
