"""A wide outer-race defect in slices of the spectral correlation, before and after removal of lines."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, new_figure
from gearsim_dsp.cyclic.slices import slices_before_and_after
from gearsim_dsp.separation.random_separation import drs

RECORDS = (
    ("hit_sm/SQ_OR8_600.mat", FAULTY, "outer race, 8° wide"),
    ("hit_sm/SQ_Normal_600.mat", GREY, "sound"),
)
FOUND_HZ = 35.98
STEP_HZ = 100.0
TOP_HZ = 13_000.0


def draw(records: Measured) -> Figure:
    """Four panels: cyclic frequency 0 and BPFO, with and without what can be foretold."""
    figure = new_figure(f"spectral correlation at 0 and {FOUND_HZ:g} Hz, HIT-SM rig at 10 Hz", 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for name, colour, text in RECORDS:
        signal, rate_hz = records.signal(name)
        quarter = round(rate_hz / 8) * 2

        def random_part(x: NDArray[np.float64], length: int = quarter) -> NDArray[np.float64]:
            return drs(x, length // 8, length)[1]

        # The gains of the two files are not stated: each is shown relative to its own random part.
        signal = signal / np.std(random_part(signal))
        pair = slices_before_and_after(signal, rate_hz, (0.0, FOUND_HZ), STEP_HZ, random_part)
        for row, slices in enumerate((pair.before, pair.after)):
            chance = slices.chance_db()
            for column, level in enumerate(slices.level_db()):
                axes[row, column].plot(
                    slices.frequency_hz / 1e3, level, color=colour, linewidth=0.9, label=text
                )
            axes[row, 1].plot(
                slices.frequency_hz / 1e3, chance[1], color=colour, linewidth=0.7, linestyle=":"
            )
    for row, what in enumerate(("as recorded", "random part (DRS)")):
        for column, at in enumerate(("α = 0: power spectral density", "α = BPFO; dotted: reached by chance")):
            axes[row, column].set_title(f"{what}, {at}", fontsize=9)
        axes[row, 0].set_ylabel("|S| [dB re random part²/Hz]")
    for one in axes[1]:
        one.set_xlabel("carrier [kHz]")
    axes[0, 0].set_xlim(0, TOP_HZ / 1e3)
    axes[0, 0].set_ylim(-80, 10)
    axes[0, 0].legend(loc="upper right")
    return figure
