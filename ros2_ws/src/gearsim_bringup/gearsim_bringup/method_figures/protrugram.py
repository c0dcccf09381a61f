"""The protrugram of a sound bearing on an inverter-fed rig, with and without the guards, and of a fault."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.band_maps import draw_envelope
from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, HEALTHY, MARK, mark, new_figure
from gearsim_dsp.impulsive.protrugram import choose_by_protrugram, protrugram

SOUND, OUTER_RACE = "hit_sm/SQ_Normal_1200.mat", "hit_sm/SQ_OR2_1200.mat"
BPFO_HZ, CARRIER_HZ = 71.75, 6001.0
WIDTH_HZ = 345.0


def draw(records: Measured) -> Figure:
    """Kurtosis over the band's centre for both records, and the envelope's spectrum of the chosen band."""
    figure = new_figure(
        "protrugram, HIT-SM at 1200 rpm: sound (blue), outer race (red), chosen for it (green)", 4.0
    )
    left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
    for name, colour in ((SOUND, HEALTHY), (OUTER_RACE, FAULTY)):
        signal, rate_hz = records.signal(name)
        bands = protrugram(signal, rate_hz, WIDTH_HZ).bands
        centre_khz = [0.5e-3 * (b.low_hz + b.high_hz) for b in bands]
        left.plot(centre_khz, [b.value for b in bands], color=colour, linewidth=0.9)
    band = choose_by_protrugram(signal, rate_hz, WIDTH_HZ, np.random.default_rng(1)).band
    assert band is not None
    for k in (1, 2):
        mark(left, k * CARRIER_HZ / 1e3, "inverter" if k == 1 else "its double")
    left.axvspan(band.low_hz / 1e3, band.high_hz / 1e3, color=MARK, alpha=0.3)
    left.set_xlabel("centre of the band [kHz]")
    left.set_ylabel("kurtosis of the envelope spectrum")
    draw_envelope(right, signal, rate_hz, band, BPFO_HZ, FAULTY)
    right.set_title(f"envelope of {band.low_hz:.0f} to {band.high_hz:.0f} Hz", fontsize=9, pad=14)
    return figure
