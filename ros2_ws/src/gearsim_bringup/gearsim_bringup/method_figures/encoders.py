"""A measured gear mesh read like an encoder of as many lines as the pinion has teeth."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import butter, sosfiltfilt

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import HEALTHY, mark, new_figure
from gearsim_dsp.angle.encoder import angular_deviation, phase_from_wave

RECORD = "gear0/3027_217_Data_Chan12.mat"
TEETH, SPEED_HZ = 23, 2000 / 60
BAND_HZ = (700.0, 835.0)


def draw(records: Measured) -> Figure:
    """The wave, its torsional deviation over eight turns, and the orders in that."""
    signal, rate_hz = records.signal(RECORD)
    wave = sosfiltfilt(butter(3, BAND_HZ, "bandpass", fs=rate_hz, output="sos"), signal - signal.mean())
    phase = phase_from_wave(wave, rate_hz, TEETH, SPEED_HZ)
    deviation = angular_deviation(phase, TEETH)
    figure = new_figure("the mesh of a gear rig demodulated as an encoder of 23 lines", 6.2)
    rows = figure.subplots(3, 1)
    seconds = np.arange(signal.size) / rate_hz
    shown = (seconds >= 2.0) & (seconds < 2.0 + 4 / SPEED_HZ)
    rows[0].plot(seconds[shown], wave[shown], color=HEALTHY, linewidth=0.8)
    rows[0].set_xlabel("time [s]")
    rows[0].set_ylabel("wave [m/s²]")
    first = deviation.turns[0] + 60
    turns = (deviation.turns >= first) & (deviation.turns < first + 12)
    rows[1].plot(deviation.turns[turns], 1e3 * deviation.values[turns], color=HEALTHY, linewidth=0.9)
    rows[1].set_xlabel("turns of the pinion")
    rows[1].set_ylabel("ahead of even\nrotation [mrad]")
    orders, lines = deviation.spectrum()
    rows[2].semilogy(orders, 1e3 * lines, color=HEALTHY, linewidth=0.8)
    rows[2].set_xlim(0, 4)
    rows[2].set_ylim(1e-3, None)
    for k in (1, 2, 3):
        mark(rows[2], k, f"{k} x shaft")
    rows[2].set_xlabel("order of the pinion")
    rows[2].set_ylabel("amplitude [mrad]")
    return figure
