"""Spectra of each model against one of the full casing with all its modes to 20 kHz, in dB per band.

The full casing stands for the rig: finite-element shafts on a reduction with a thousand modes, another
specimen of gears than the models know (its own seed). Figures 5.15 to 5.20 and 5.33 to 5.38 of the thesis.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import welch

from gearsim_bringup.casing_results.records import FAULTS, MODELS, RATE_HZ, Records, Run
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure

__all__ = ["BANDS_HZ", "STATES", "Spectra", "band_levels", "draw", "misfit_db", "table", "tell"]

Array = NDArray[np.float64]

STATES = ("healthy", "inner", "outer")
BANDS_HZ = ((0.0, 1e3), (1e3, 2e3), (2e3, 4e3), (4e3, 8e3))
BIN_HZ = 100.0  # ten lines of the shaft: shape of the spectrum, not the height of each line
RIG_SEED = 7
_LINE_HZ = 10.0
_SHOWN_HZ = 10e3
_SECONDS = 4.0  # 40 turns; a thousand modes take as long as they last


@dataclass(frozen=True)
class Spectra:
    """Misfits in dB: rms over the bins of a band of the difference of levels.

    Attributes
    ----------
    misfit_db : dict
        State and model over the bands.
    lumped_internals_db : dict
        Model over the bands, spall of the inner race: against the full casing under the lumped shafts of
        `cb146`, of the same seed, so that in `cb146` the casing's missing modes are all that differs.
    rise_db : dict
        State (not healthy) and model, the rig being `rig`, over the bands: level with the fault less that
        without.
    """

    misfit_db: dict[tuple[str, str], tuple[float, ...]]
    lumped_internals_db: dict[str, tuple[float, ...]]
    rise_db: dict[tuple[str, str], tuple[float, ...]]


def band_levels(samples: Array, rate_hz: float = RATE_HZ) -> tuple[Array, Array]:
    """Middles [Hz] of bins of `BIN_HZ` and the mean density in them [dB re (m/s^2)^2/Hz]."""
    per_segment = round(rate_hz / _LINE_HZ)
    frequency, density = welch(samples, rate_hz, nperseg=per_segment)
    count = int(frequency[-1] / BIN_HZ)
    index = (frequency / BIN_HZ).astype(int)
    means = [float(np.mean(density[index == k])) for k in range(count)]
    return np.asarray((np.arange(count) + 0.5) * BIN_HZ), 10 * np.log10(np.array(means))


def misfit_db(model: Array, rig: Array) -> tuple[float, ...]:
    """Rms difference of two signals' levels in each of `BANDS_HZ`."""
    frequency, level = band_levels(model)
    difference = level - band_levels(rig)[1]
    inside = [(frequency >= low) & (frequency < high) for low, high in BANDS_HZ]
    return tuple(float(np.sqrt(np.mean(difference[one] ** 2))) for one in inside)


def rig(state: str, model: str = "cb182", casing: str = "", seed: int = RIG_SEED) -> Run:
    """The rig: the full casing under the internals of a model."""
    return Run(model, FAULTS[state], _SECONDS, seed, casing)


def tell(records: Records) -> Spectra:
    """All misfits; `records.full_casing` is the casing with all its modes."""
    full = records.full_casing
    truth = {state: records.signal(rig(state, casing=full)) for state in STATES}
    made = {(state, model): records.signal(Run(model, FAULTS[state])) for state in STATES for model in MODELS}
    alike = records.signal(rig("inner", "cb146", full, seed=1))
    signals = {**{(state, "rig"): one for state, one in truth.items()}, **made}
    return Spectra(
        {(state, model): misfit_db(made[state, model], truth[state]) for state, model in made},
        {model: misfit_db(made["inner", model], alike) for model in MODELS},
        {
            (state, model): _rise(signals["healthy", model], one)
            for (state, model), one in signals.items()
            if state != "healthy"
        },
    )


def _rise(healthy: Array, faulty: Array) -> tuple[float, ...]:
    frequency, before = band_levels(healthy)
    after = band_levels(faulty)[1]
    inside = [(frequency >= low) & (frequency < high) for low, high in BANDS_HZ]
    return tuple(float(np.mean((after - before)[one])) for one in inside)


def table(told: Spectra) -> list[str]:
    """Misfits with the gain over the lumped model, and how much a fault raises the bands."""
    names = [f"{low / 1e3:g} to {high / 1e3:g} kHz" for low, high in BANDS_HZ]
    lines = [
        "| misfit against the full casing, dB | " + " | ".join(names) + " |",
        "|---|" + "---|" * len(names),
    ]
    for state in STATES:
        of_state = {model: told.misfit_db[state, model] for model in MODELS}
        lines += _rows(state, of_state)
    lines += _rows("inner, lumped shafts in the full casing, too", told.lumped_internals_db)
    lines += ["", "| fault above healthy, mean of the levels, dB | " + " | ".join(names) + " |"]
    lines.append("|---|" + "---|" * len(names))
    for (state, model), values in told.rise_db.items():
        shown = "full casing" if model == "rig" else f"`{model}`"
        lines.append(f"| {state}: {shown} | " + " | ".join(f"{value:+.1f}" for value in values) + " |")
    return lines


def _rows(name: str, misfit: Mapping[str, tuple[float, ...]]) -> list[str]:
    """A row for each model; what it gains over the lumped one in brackets."""
    rows = []
    for model, values in misfit.items():
        cells = [
            f"{own:.1f}" if model == "lpm34" else f"{own:.1f} (gain {other - own:+.1f})"
            for own, other in zip(values, misfit["lpm34"], strict=True)
        ]
        rows.append(f"| {name}: `{model}` | " + " | ".join(cells) + " |")
    return rows


def draw(records: Records, told: Spectra) -> Figure:
    """Four panels: the full casing and each model, good and with the spall of the inner race."""
    figure = new_figure("spall of the inner race: spectra above bearing 3", 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    full = records.full_casing
    panels = {"full casing, to 20 kHz": (rig("healthy", casing=full), rig("inner", casing=full))}
    panels |= {model: (Run(model, FAULTS["healthy"]), Run(model, FAULTS["inner"])) for model in MODELS}
    reference = band_levels(records.signal(rig("inner", casing=full)))
    for panel, (name, pair) in zip(axes.flat, panels.items(), strict=True):
        if not name.startswith("full"):
            panel.plot(
                reference[0] / 1e3, reference[1], color=GREY, linewidth=1.6, label="full casing, inner race"
            )
        for run, colour, text in zip(pair, (HEALTHY, FAULTY), ("good", "inner race"), strict=True):
            frequency, level = band_levels(records.signal(run))
            panel.plot(frequency / 1e3, level, color=colour, linewidth=0.9, label=text)
        misfit = told.misfit_db.get(("inner", name))
        panel.set_title(
            name if misfit is None else f"{name}: {misfit[2]:.1f} dB off at 2 to 4 kHz", fontsize=9
        )
        panel.axvspan(2, 4, color=GREY, alpha=0.12)
    axes[0, 0].set_xlim(0, _SHOWN_HZ / 1e3)
    axes[0, 0].set_ylim(-75, 0)
    axes[0, 1].legend(loc="upper right", fontsize=7.5)
    for one in axes[1]:
        one.set_xlabel("frequency [kHz]")
    for one in axes[:, 0]:
        one.set_ylabel("[dB re (m/s²)²/Hz]")
    return figure
