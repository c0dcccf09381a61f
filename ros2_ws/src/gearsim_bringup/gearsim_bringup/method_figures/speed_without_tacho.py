"""The speed of a wind turbine without tacho, found in its vibration."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from scipy.signal import ShortTimeFFT

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, HEALTHY, new_figure
from gearsim_dsp.angle.tacholess import track_speed

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
TOP_HZ = 2000.0
WINDOW_S, HOP_S = 0.25, 0.025


def draw(records: Measured) -> Figure:
    """Short spectra with the lines that the speed found puts there, and that speed."""
    signal, rate_hz = records.signal(RECORD)
    track = track_speed(signal, rate_hz, records.machine(RECORD))
    window = np.hanning(round(WINDOW_S * rate_hz))
    stft = ShortTimeFFT(window, round(HOP_S * rate_hz), rate_hz, fft_mode="onesided")
    power = np.abs(stft.stft(signal - signal.mean())) ** 2
    seconds = stft.t(signal.size)
    fine = (seconds >= 0) & (seconds <= signal.size / rate_hz)
    low = stft.f <= TOP_HZ
    level = 10 * np.log10(power[np.ix_(low, fine)])
    figure = new_figure("a wind turbine's high-speed stage, no tacho: short spectra and the speed found", 6.5)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    limits = np.percentile(level, (75, 99.9))
    top.pcolormesh(
        seconds[fine], stft.f[low], level, cmap="Greys", vmin=limits[0], vmax=limits[1], rasterized=True
    )
    for order, text in ((21 * 22 / 112, "4.125"), (22, "mesh"), (44, "2"), (66, "3"), (88, "4")):
        top.plot(track.time_s, order * track.speed_hz, color=FAULTY, linewidth=0.8, linestyle=(0, (4, 6)))
        top.text(4.02, order * track.speed_hz[-1], text, color=FAULTY, va="center", fontsize=8)
    top.set_ylabel("frequency [Hz]")
    top.grid(visible=False)
    bottom.plot(track.time_s, track.speed_hz, color=HEALTHY)
    bottom.set_ylabel("speed [Hz]")
    bottom.set_xlabel("time [s]")
    bottom.set_xlim(0, 4)
    bottom.text(
        0.98,
        0.9,
        f"confidence {track.confidence:.2f}, mean {track.mean_hz:.3f} Hz, {track.note}",
        transform=bottom.transAxes,
        ha="right",
        va="top",
    )
    return figure
