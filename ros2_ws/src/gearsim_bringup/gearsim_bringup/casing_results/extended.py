"""Extended faults: slices of the spectral correlation after DRS, and what a fault and the mesh do together.

Figures 5.56 to 5.59 and 5.71 to 5.73 of the thesis. A fault that adds to the gears gives the same signal
whether the mesh is excited or not; one that modulates them does not. What is left of

    x(mesh, fault) - x(mesh) - x(fault) + x(neither)

is therefore the interaction; a simulation can switch the mesh's excitation off, a rig cannot.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import welch

from gearsim_bringup.casing_results.envelopes import BANDS_HZ, envelope_of, expected_hz
from gearsim_bringup.casing_results.records import FAULTS, IN_CASING, MODELS, RATE_HZ, SPEED_HZ, Records, Run
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.cyclic.slices import BeforeAfter, gain_db, slices_before_and_after
from gearsim_dsp.separation.random_separation import drs

__all__ = ["NO_EXCITATION", "Extended", "draw", "interaction_db", "slices_of", "table", "tell"]

Array = NDArray[np.float64]

LOW_HZ, HIGH_HZ = 100.0, 5e3  # the thesis's "below 5 kHz"
_STEP_HZ = 100.0
_DELAY, _BLOCK = 2048, 16384
_SLIP = 0.02
# Every kinematic excitation of the mesh off: its stiffness does not vary, its flanks are perfect.
NO_EXCITATION = {
    "mesh.pair_stiffness_ratio": 1.0,
    "gear_errors.runout": "0 um",
    "gear_errors.profile": "0 um",
    "gear_errors.pitch_rms": "0 um",
    "gear_errors.surface_rms": "0 um",
}


@dataclass(frozen=True)
class Extended:
    """Differences from good to faulty.

    Attributes
    ----------
    alpha_hz : float
        Cyclic frequency: of the shaft, or the BPFO found in the record.
    before_db, after_db : tuple of float
        At cyclic frequency 0 and at `alpha_hz`, of the signal and of what DRS leaves of it, 100 Hz to 5 kHz.
    """

    alpha_hz: float
    before_db: tuple[float, float]
    after_db: tuple[float, float]


@dataclass(frozen=True)
class Told:
    """Over state and model: slices, and the interaction [dB re the fault's own signal]."""

    slices: dict[tuple[str, str], Extended]
    interaction_db: dict[tuple[str, str], float]


def slices_of(samples: Array, alpha_hz: float) -> BeforeAfter:
    """Slices at 0 and at a cyclic frequency, before and after DRS."""
    random_part = partial(_random, delay=_DELAY, length=_BLOCK)
    return slices_before_and_after(samples, RATE_HZ, (0.0, alpha_hz), _STEP_HZ, random_part)


def _random(samples: Array, *, delay: int, length: int) -> Array:
    return drs(samples, delay, length)[1]


def alpha_of(faulty: Array, state: str) -> float:
    """The shaft's speed for the inner race; BPFO, found in the envelope, for the outer one."""
    if state == "extended_inner":
        return SPEED_HZ
    spectrum = envelope_of(faulty, BANDS_HZ[0])
    return spectrum.comb(expected_hz("outer"), _SLIP, shafts=(SPEED_HZ,)).found


def compared(faulty: Array, healthy: Array, state: str) -> Extended:
    """Slices of a faulty record over those of a good one."""
    alpha = alpha_of(faulty, state)
    bad, good = slices_of(faulty, alpha), slices_of(healthy, alpha)
    before = [gain_db(bad.before, good.before, row, LOW_HZ, HIGH_HZ) for row in (0, 1)]
    after = [gain_db(bad.after, good.after, row, LOW_HZ, HIGH_HZ) for row in (0, 1)]
    return Extended(alpha, (before[0], before[1]), (after[0], after[1]))


def interaction_db(records: Records, model: str, state: str) -> float:
    """Power of the interaction below 5 kHz over that of the fault without the mesh's excitation."""
    both, mesh = (records.signal(Run(model, FAULTS[name])) for name in (state, "healthy"))
    fault, neither = (
        records.signal(Run(model, FAULTS[name], parameters=NO_EXCITATION)) for name in (state, "healthy")
    )
    own = fault - neither
    return 10 * float(np.log10(_low_power(both - mesh - own) / _low_power(own)))


def _low_power(samples: Array) -> float:
    frequency, density = welch(samples, RATE_HZ, nperseg=8192)
    return float(np.sum(density[(frequency >= LOW_HZ) & (frequency < HIGH_HZ)]))


def tell(records: Records) -> Told:
    """Extended faults of both races; localised ones beside them for the interaction."""
    healthy = {model: records.signal(Run(model, FAULTS["healthy"])) for model in MODELS}
    slices = {
        (state, model): compared(records.signal(Run(model, FAULTS[state])), healthy[model], state)
        for state in ("extended_inner", "extended_outer")
        for model in MODELS
    }
    states = ("inner", "outer", "extended_inner", "extended_outer")
    return Told(slices, {(s, m): interaction_db(records, m, s) for s in states for m in MODELS})


def table(told: Told) -> list[str]:
    """Slices, then interaction."""
    lines = [
        "| faulty over good, dB, 100 Hz to 5 kHz | α | before DRS at 0 | at α | after DRS at 0 | at α |",
        "|---|---|---|---|---|---|",
    ]
    for (state, model), one in told.slices.items():
        values = " | ".join(f"{value:+.1f}" for value in (*one.before_db, *one.after_db))
        lines.append(f"| {state.replace('_', ' ')} race, `{model}` | {one.alpha_hz:.2f} Hz | {values} |")
    lines += [
        "",
        "| interaction with the mesh over the fault's own signal, dB | " + " | ".join(MODELS) + " |",
    ]
    lines.append("|---|" + "---|" * len(MODELS))
    for state in dict.fromkeys(state for state, _ in told.interaction_db):
        cells = " | ".join(f"{told.interaction_db[state, model]:+.1f}" for model in MODELS)
        name = state.replace("_", " ") if state.startswith("extended") else f"localised {state}"
        lines.append(f"| {name} race | {cells} |")
    return lines


def draw(records: Records, told: Told) -> Figure:
    """Slices at the cyclic frequency after DRS, good and faulty, both races and both models."""
    figure = new_figure("spectral correlation at the shaft's speed and at BPFO, after DRS", 5.6)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    for row, state in enumerate(("extended_inner", "extended_outer")):
        for column, model in enumerate(IN_CASING):
            panel, one = axes[row, column], told.slices[state, model]
            for fault, colour, text in (("healthy", HEALTHY, "good"), (state, FAULTY, "faulty")):
                pair = slices_of(records.signal(Run(model, FAULTS[fault])), one.alpha_hz)
                kilohertz = pair.after.frequency_hz / 1e3
                panel.plot(kilohertz, pair.after.level_db()[1], color=colour, linewidth=0.9, label=text)
                if fault == state:
                    chance = pair.after.chance_db()[1]
                    panel.plot(
                        kilohertz, chance, color=GREY, linewidth=0.7, linestyle=":", label="reached by chance"
                    )
            name = f"{state.replace('_', ' ')} race, α = {one.alpha_hz:.2f} Hz"
            panel.set_title(f"{model}, {name}: {one.after_db[1]:+.0f} dB", fontsize=9)
        axes[row, 0].set_ylabel("|S| [dB re (m/s²)²/Hz]")
    axes[0, 0].set_xlim(0, 10)
    axes[0, 0].set_ylim(-100, -10)
    axes[0, 0].legend(loc="upper right", fontsize=7.5)
    for one in axes[1]:
        one.set_xlabel("carrier [kHz]")
    return figure
