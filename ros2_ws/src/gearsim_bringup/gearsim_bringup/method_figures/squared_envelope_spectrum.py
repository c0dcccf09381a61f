"""An outer-race fault in the squared envelope spectrum of one band."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, mark, new_figure
from gearsim_dsp.envelope import envelope_spectrum, squared_envelopes, window_spectrum
from gearsim_dsp.kinematics import fault_families

RECORD, HEALTHY_RECORD = "mfpt/OuterRaceFault_vload_3.mat", "mfpt/baseline_1.mat"
SHAFT_HZ = 25.0
BAND_HZ = (3000.0, 6000.0)
TOP_HZ = 400.0


def draw(records: Measured) -> Figure:
    """Faulty and healthy bearing, the same band."""
    figure = new_figure(
        f"squared envelope spectra of {BAND_HZ[0] / 1e3:g} to {BAND_HZ[1] / 1e3:g} kHz, MFPT", 3.6
    )
    axes = figure.subplots()
    for name, colour, text in ((RECORD, FAULTY, "outer-race fault"), (HEALTHY_RECORD, GREY, "healthy")):
        signal, rate_hz = records.signal(name)
        envelopes = squared_envelopes(
            window_spectrum(signal, rate_hz), np.array([BAND_HZ[0]]), BAND_HZ[1] - BAND_HZ[0]
        )
        power, step_hz = envelope_spectrum(envelopes)
        at = np.arange(power.shape[1]) * step_hz
        shown = (at > 1) & (at < TOP_HZ)
        axes.plot(at[shown], 10 * np.log10(power[0][shown]), color=colour, linewidth=0.8, label=text)
    for family in fault_families(records.machine(RECORD)):
        if family.fault == "outer_race":
            for k in (1, 2, 3, 4):
                mark(axes, k * family.order * SHAFT_HZ, f"{k} BPFO")
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("modulation power [dB]")
    axes.set_xlim(0, TOP_HZ)
    axes.set_ylim(-60, 0)
    axes.legend(loc="upper right")
    return figure
