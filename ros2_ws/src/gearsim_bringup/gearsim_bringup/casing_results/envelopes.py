"""Squared envelope spectra of localised faults: BPFI with sidebands of the shaft, BPFO without.

Figures 5.21 to 5.26 and 5.39 to 5.44 of the thesis. Heights are powers over the local floor.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.casing_results.records import BEARING, FAULTS, MODELS, RATE_HZ, SPEED_HZ, Records, Run
from gearsim_bringup.method_figures.style import FAULTY, GREY, mark, new_figure
from gearsim_dsp.cyclic.envelope_spectra import squared_envelope_spectrum
from gearsim_dsp.cyclic.modulation import ModulationSpectrum
from gearsim_dsp.kinematics import bearing_orders
from gearsim_dsp.separation.cepstrum import prewhitened
from gearsim_io.machines import load_machine

__all__ = ["BANDS_HZ", "Lines", "draw", "envelope_of", "expected_hz", "lines_of", "table", "tell"]

Array = NDArray[np.float64]

BANDS_HZ = ((500.0, 3500.0), (1e3, 20e3))
"""Within what the reduced casing is valid for, and all that a sensor hears."""
TOP_HZ = 400.0
WINDOW_S = 3.0
_SLIP = 0.02  # searched about the frequency without slip
_NEAR_HZ = 0.5


@dataclass(frozen=True)
class Lines:
    """Heights over the floor [dB].

    Attributes
    ----------
    found_hz : float
        Of the fault.
    harmonics : tuple of float
        First three.
    sidebands : tuple of float
        One and two turns of the shaft below and above the first: -2, -1, +1, +2.
    healthy : float
        At the first harmonic, in the record without the fault.
    """

    found_hz: float
    harmonics: tuple[float, ...]
    sidebands: tuple[float, ...]
    healthy: float


def expected_hz(race: str) -> float:
    """Ball passes of a race without slip, from the nameplate."""
    orders = bearing_orders(load_machine("unsw_parallel").bearing(BEARING))
    return SPEED_HZ * (orders.bpfi if race == "inner" else orders.bpfo)


def envelope_of(samples: Array, band_hz: tuple[float, float]) -> ModulationSpectrum:
    """Squared envelope spectrum of the pre-whitened signal in a band, as in thesis 5.6."""
    white = prewhitened(samples, band_hz=band_hz, sample_rate_hz=RATE_HZ)
    return squared_envelope_spectrum(white, RATE_HZ, band_hz, TOP_HZ, window_s=WINDOW_S)


def lines_of(faulty: Array, healthy: Array, race: str, band_hz: tuple[float, float]) -> Lines:
    """Lines of a fault of a race, found near where the nameplate has them."""
    spectrum = envelope_of(faulty, band_hz)
    found = spectrum.comb(expected_hz(race), _SLIP, shafts=(SPEED_HZ,)).found
    harmonics = tuple(spectrum.line(k * found, _NEAR_HZ).snr_db for k in (1, 2, 3))
    sides = tuple(spectrum.line(found + k * SPEED_HZ, _NEAR_HZ).snr_db for k in (-2, -1, 1, 2))
    return Lines(found, harmonics, sides, envelope_of(healthy, band_hz).line(found, _NEAR_HZ).snr_db)


def tell(records: Records) -> dict[tuple[str, str, tuple[float, float]], Lines]:
    """Lines over model, race and band."""
    return {
        (model, race, band): lines_of(
            records.signal(Run(model, FAULTS[race])),
            records.signal(Run(model, FAULTS["healthy"])),
            race,
            band,
        )
        for race in ("inner", "outer")
        for band in BANDS_HZ
        for model in MODELS
    }


def table(told: dict[tuple[str, str, tuple[float, float]], Lines]) -> list[str]:
    """One row for each record and band."""
    lines = [
        "| fault, band, model | found | 1st, 2nd, 3rd harmonic | ±10 Hz | ±20 Hz | healthy, same place |",
        "|---|---|---|---|---|---|",
    ]
    for (model, race, band), one in told.items():
        name = f"{race} race, {band[0] / 1e3:g} to {band[1] / 1e3:g} kHz, `{model}`"
        heights = ", ".join(f"{value:.0f}" for value in one.harmonics)
        far, near, near_above, far_above = one.sidebands
        lines.append(
            f"| {name} | {one.found_hz:.2f} Hz | {heights} dB | {near:.0f}, {near_above:.0f} dB "
            f"| {far:.0f}, {far_above:.0f} dB | {one.healthy:.0f} dB |"
        )
    return lines


def draw(records: Records, told: dict[tuple[str, str, tuple[float, float]], Lines]) -> Figure:
    """Both faults in both models with a casing."""
    figure = new_figure("squared envelope spectra above bearing 3, pre-whitened, 1 to 20 kHz", 5.6)
    axes = figure.subplots(2, 2, sharex=True)
    for row, race in enumerate(("inner", "outer")):
        for column, model in enumerate(("cb146", "cb182")):
            panel = axes[row, column]
            for state, colour in ((race, FAULTY), ("healthy", GREY)):
                spectrum = envelope_of(records.signal(Run(model, FAULTS[state])), BANDS_HZ[1])
                panel.plot(spectrum.axis, spectrum.snr_db(), color=colour, linewidth=0.7)
            found = told[model, race, BANDS_HZ[1]].found_hz
            name = "BPFI" if race == "inner" else "BPFO"
            for k in range(1, 4):
                mark(panel, k * found, f"{k} {name}" if k > 1 else name)
            panel.set_ylim(-5, 45)
            panel.set_title(f"{model}, {race} race", fontsize=9, pad=14)
        axes[row, 0].set_ylabel("over the local floor [dB]")
    axes[0, 0].set_xlim(5, 250)
    for one in axes[1]:
        one.set_xlabel("cyclic frequency [Hz]")
    return figure
