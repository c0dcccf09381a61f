"""A weak outer-race fault in three envelope spectra, and the carriers it modulates."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.cyclic.envelopes_of_coherence import (
    best_band,
    carrier_profile,
    enhanced_envelope_spectrum,
)
from gearsim_dsp.kinematics import fault_families

RECORD = "mfpt/OuterRaceFault_vload_1.mat"
SHAFT_HZ, TOLERANCE = 25.0, 0.02
TOP_HZ = 420.0


def draw(records: Measured) -> Figure:
    """How improbable each line is as noise in three envelope spectra; carriers to the right."""
    signal, rate_hz = records.signal(RECORD)
    (family,) = (f for f in fault_families(records.machine(RECORD)) if f.fault == "outer_race")
    expected_hz = family.order * SHAFT_HZ
    trusted = (0.03 * rate_hz, 0.46 * rate_hz)
    coherence = cyclic_spectrum(signal, rate_hz, rate_hz / 256, TOP_HZ + 20).coherence_map()
    enhanced = enhanced_envelope_spectrum(coherence, trusted)
    improved, comb = best_band(coherence, expected_hz, TOLERANCE, shafts=(SHAFT_HZ,), band_hz=trusted)
    squared = squared_envelope_spectrum(signal, rate_hz, trusted, TOP_HZ + 20)
    figure = new_figure(
        "probability of every line as noise (cut at 1e-26): outer-race fault, MFPT at 25 lb", 6.0
    )
    grid = figure.subplot_mosaic(
        [["SES", "profile"], ["EES", "profile"], ["IES", "profile"]], width_ratios=[3, 1]
    )
    rows = (("SES", squared, GREY), ("EES", enhanced, HEALTHY), ("IES", improved, FAULTY))
    for kind, one, colour in rows:
        axes = grid[kind]
        shown = one.axis > 10
        low, high = (edge / 1e3 for edge in one.band_hz)
        label = f"{kind}, {low:.1f} to {high:.1f} kHz"
        axes.plot(
            one.axis[shown], -np.log10(one.false_alarm()[shown]), color=colour, linewidth=0.7, label=label
        )
        axes.set_ylim(0, 28)
        axes.set_xlim(10, TOP_HZ)
        axes.set_ylabel("-log10 P(noise)")
        axes.legend(loc="upper right")
        for k in (1, 2, 3, 4, 5):
            mark(axes, k * comb.found, f"{k} BPFO" if kind == "SES" else "")
    grid["IES"].set_xlabel("cyclic frequency [Hz]")
    profile = carrier_profile(coherence, comb.found)
    grid["profile"].plot(np.maximum(profile, 0.0), coherence.frequency_hz / 1e3, color=FAULTY, linewidth=1.0)
    grid["profile"].axhspan(*(edge / 1e3 for edge in improved.band_hz), color=FAULTY, alpha=0.15)
    grid["profile"].set_xlabel("sum of |coherence|²")
    grid["profile"].set_ylabel("carrier [kHz]")
    grid["profile"].set_ylim(0, rate_hz / 2e3)
    grid["profile"].set_title("which carriers", fontsize=9)
    return figure
