"""An inner-race fault on the plane of carrier and cyclic frequency."""

from __future__ import annotations

from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, mark, new_figure
from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelopes_of_coherence import enhanced_envelope_spectrum

RECORD = "mfpt/InnerRaceFault_vload_3.mat"
SHAFT_HZ, FOUND_HZ = 25.0, 117.98
TOP_HZ = 400.0
RESOLUTION_HZ = 400.0
_COLUMNS = 800


def draw(records: Measured) -> Figure:
    """Squared coherence where it is above chance, and its mean over the carriers."""
    signal, rate_hz = records.signal(RECORD)
    coherence = cyclic_spectrum(signal, rate_hz, RESOLUTION_HZ, TOP_HZ).coherence_map()
    figure = new_figure(f"cyclic coherence, MFPT inner-race fault, bins of {RESOLUTION_HZ:g} Hz", 5.4)
    plane, mean = figure.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    shown, step_hz = coherence.for_picture(_COLUMNS)
    extent = (0.0, _COLUMNS * step_hz, 0.0, rate_hz / 2e3)
    image = plane.imshow(
        shown,
        origin="lower",
        aspect="auto",
        extent=extent,
        cmap="YlOrRd",
        vmin=0.0,
        vmax=0.5,
        interpolation="nearest",
    )
    figure.colorbar(image, ax=plane, label="|coherence|² above chance", pad=0.01)
    plane.set_ylabel("carrier [kHz]")
    plane.grid(False)
    enhanced = enhanced_envelope_spectrum(coherence, (0.03 * rate_hz, 0.46 * rate_hz))
    mean.plot(enhanced.axis, enhanced.power, color=FAULTY, linewidth=0.8, label="mean over carriers (EES)")
    mean.plot(enhanced.axis, enhanced.floor, color=GREY, linewidth=1.0, label="floor of the noise")
    mean.set_yscale("log")
    mean.set_ylim(1.5e-3, 0.6)
    mean.set_xlim(2.0, TOP_HZ)
    mean.set_xlabel("cyclic frequency [Hz]")
    mean.set_ylabel("|coherence|²")
    mean.legend(loc="upper right", ncols=2)
    for k in (1, 2, 3):
        mark(plane, k * FOUND_HZ, f"{k} BPFI")
        for side, text in ((-1, "-"), (1, "+")):
            mark(plane, k * FOUND_HZ + side * SHAFT_HZ, f"{text}1x", GREY)
    return figure
