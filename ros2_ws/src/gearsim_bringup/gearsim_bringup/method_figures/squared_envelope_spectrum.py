"""An outer-race fault in the squared envelope spectrum of the band that the kurtogram chose."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.band_choice import choose_band
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.kinematics import fault_families

RECORD, HEALTHY_RECORD = "mfpt/OuterRaceFault_vload_3.mat", "mfpt/baseline_1.mat"
SHAFT_HZ, TOLERANCE = 25.0, 0.02
TOP_HZ = 400.0
WINDOW_S = 1.0


def draw(records: Measured) -> Figure:
    """Faulty and healthy bearing, the same band, averages of windows of one second."""
    signal, rate_hz = records.signal(RECORD)
    (family,) = (f for f in fault_families(records.machine(RECORD)) if f.fault == "outer_race")
    chosen = choose_band(signal, rate_hz, 2 * TOP_HZ).band
    assert chosen is not None
    band_hz = (chosen.low_hz, chosen.high_hz)
    low, high = (edge / 1e3 for edge in band_hz)
    figure = new_figure(f"squared envelope spectra of {low:.1f} to {high:.1f} kHz, MFPT", 3.8)
    axes = figure.subplots()
    for name, colour, text in ((HEALTHY_RECORD, GREY, "sound"), (RECORD, FAULTY, "outer-race fault")):
        samples, rate_hz = records.signal(name)
        spectrum = squared_envelope_spectrum(samples, rate_hz, band_hz, TOP_HZ, window_s=WINDOW_S)
        shown = spectrum.axis > 4
        level = 10 * np.log10(spectrum.power[shown])
        axes.plot(spectrum.axis[shown], level, color=colour, linewidth=0.9, label=text)
    floor = 10 * np.log10(spectrum.floor)
    axes.plot(spectrum.axis, floor, color=HEALTHY, linewidth=1.0, label="floor of the noise under the fault")
    comb = spectrum.comb(family.order * SHAFT_HZ, TOLERANCE, shafts=(SHAFT_HZ,))
    for k in (1, 2, 3, 4):
        mark(axes, k * comb.found, f"{k} BPFO")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("modulation power [dB]")
    axes.set_xlim(0, TOP_HZ)
    axes.set_ylim(-50, 0)
    axes.legend(loc="upper right", ncols=3)
    return figure
