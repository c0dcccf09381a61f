"""Lines of the gear mesh in both models with a casing, and what makes them less clear.

The thesis ends with the question why they were less clear with 182 degrees of freedom than with 146 (5.9).
Clear is, for the eye, a line above all that lies between it and the next, and in the waveform the share of
the power that the lines of the mesh hold. What shafts let pass from the teeth to the bearings tells why.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.signal import welch

from gearsim_bringup.casing_results.records import BEARING, FAULTS, IN_CASING, RATE_HZ, SPEED_HZ, Records, Run
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_sim.model.finite_gearbox import make_finite_gearbox
from gearsim_sim.model.parallel_shaft import make_parallel_shaft
from gearsim_sim.params.casing_gearbox import load_casing_gearbox_params

__all__ = ["CASES", "MESH_HZ", "Clarity", "clarity_of", "draw", "table", "tell"]

Array = NDArray[np.float64]

TEETH = 32
MESH_HZ = TEETH * SPEED_HZ
HARMONICS = 10
_SECONDS = 6.0
_LINE_HZ = 1.0  # half width of a line: Hann's window over 2 s
_UNFILTERED = 4
_PASSED_HZ = (1e3, 2e3, 4e3, 5e3, 6e3, 7e3, 8e3, 10e3)

# Equation (4.17) adds 0.2 um of noise to the transmission error at every sample, up to half the sampling
# rate: here from tooth to tooth up to 100 times the mesh, 32 kHz.
NOISE_417: Mapping[str, Any] = {"gear_errors.surface_rms": "0.2 um", "gear_errors.harmonics": 100}
CASES: Mapping[str, Mapping[str, Any]] = {
    "as shipped": {},
    "without slip": {"faults": ()},
    "sensor on the ring of bearing 3": {"site": "b3_y"},
    "sensor on the side wall": {"site": "side_output_x"},
    "modes of the shafts with 4 % of damping (0.5 %)": {"parameters": {"finite_shafts.damping_ratio": 0.04}},
    "runout and profile error of the wheels off": {
        "parameters": {"gear_errors.runout": "0 um", "gear_errors.profile": "0 um"}
    },
    "white noise in the transmission error, (4.17)": {"parameters": NOISE_417},
    "ideal sensor": {"chain": "ideal"},
    "ideal sensor, sampled without a filter": {"rate_hz": RATE_HZ * _UNFILTERED, "chain": "ideal"},
    "white noise, and sampled without a filter": {
        "parameters": NOISE_417, "rate_hz": RATE_HZ * _UNFILTERED, "chain": "ideal",
    },
}  # fmt: skip


@dataclass(frozen=True)
class Clarity:
    """How clear the lines of the mesh are in a record.

    Attributes
    ----------
    heights_db : tuple of float
        Power of each of the first ten over the floor (median) about it, in a line's width.
    lead_db : tuple of float
        Power of each over that of all else within half the distance to the next.
    share : float
        Of the record's power that all multiples of the mesh hold.
    rms : float
        Of the record [m/s^2].
    """

    heights_db: tuple[float, ...]
    lead_db: tuple[float, ...]
    share: float
    rms: float

    @property
    def median_lead_db(self) -> float:
        """Of the ten."""
        return float(np.median(self.lead_db))


def clarity_of(samples: Array) -> Clarity:
    """Of a record at `RATE_HZ` and 10 Hz."""
    frequency, density = welch(samples, RATE_HZ, nperseg=2 * round(RATE_HZ))
    step = float(frequency[1])
    off = np.abs(frequency - np.round(frequency / MESH_HZ) * MESH_HZ)
    on = (off < _LINE_HZ + 0.5 * step) & (frequency > 0.5 * MESH_HZ)
    lines_in = int(2 * _LINE_HZ / step) + 1
    heights, leads = [], []
    for k in range(1, HARMONICS + 1):
        line = np.abs(frequency - k * MESH_HZ) < _LINE_HZ + 0.5 * step
        around = (np.abs(frequency - k * MESH_HZ) < 0.5 * MESH_HZ) & ~line
        floor = lines_in * float(np.median(density[around]))
        heights.append(10 * float(np.log10(np.sum(density[line]) / floor)))
        leads.append(10 * float(np.log10(np.sum(density[line]) / np.sum(density[around]))))
    return Clarity(
        tuple(heights), tuple(leads), float(np.sum(density[on]) / np.sum(density)), float(np.std(samples))
    )


def case_signal(records: Records, model: str, case: str) -> Array:
    """The healthy record of a case at `RATE_HZ`."""
    run = Run(model, **{"faults": FAULTS["healthy"], "seconds": _SECONDS, **CASES[case]})
    samples = records.signal(run)
    return samples[:: round(run.rate_hz / RATE_HZ)]


def force_per_error(finite: bool, frequencies_hz: Sequence[float]) -> Array:
    """Force on the near-rigid bore of `BEARING` for unit transmission error [N/m], casing at rest.

    The linear part of the internals: with it the mesh pushes with (k + i w c) e on both wheels.
    """
    params = load_casing_gearbox_params(finite=finite).gearbox
    plant = (make_finite_gearbox if finite else make_parallel_shaft)(params, 1)
    system, mesh = plant.system, plant.meshes[0]
    mesh_row = system.interfaces[:, list(system.interface_names).index("mesh")]
    seat = system.interfaces[:, list(system.interface_names).index("b3_y")]
    law = params.rolling_bearings[2]
    damping = params.model.seats[BEARING].damping_ns_per_m
    mass = system.mass if system.mass.ndim == 2 else np.diag(system.mass)
    forces = []
    for w in 2j * np.pi * np.asarray(frequencies_hz):
        dynamic = system.stiffness + w * system.damping + w**2 * mass
        push = (mesh.mean_stiffness_n_per_m + w * mesh.damping_ns_per_m) * mesh_row
        moved = seat @ np.linalg.solve(dynamic, push)
        forces.append(abs((law.nominal_stiffness_n_per_m + w * damping) * moved))
    return np.array(forces)


def tell(records: Records) -> dict[tuple[str, str], Clarity]:
    """Over case and model."""
    return {
        (case, model): clarity_of(case_signal(records, model, case))
        for case in CASES
        for model in IN_CASING
        if model == "cb182" or "finite_shafts.damping_ratio" not in CASES[case].get("parameters", {})
    }


def table(told: dict[tuple[str, str], Clarity]) -> list[str]:
    """One row for each case."""
    lines = [
        "| healthy record | `cb146`: lead (median of ten lines), share of power, rms | `cb182` |",
        "|---|---|---|",
    ]
    for case in dict.fromkeys(case for case, _ in told):
        cells = [_cell(told.get((case, model))) for model in IN_CASING]
        lines.append(f"| {case} | {cells[0]} | {cells[1]} |")
    lines += ["", "| multiple of the mesh | " + " | ".join(str(k) for k in range(1, HARMONICS + 1)) + " |"]
    lines.append("|---|" + "---|" * HARMONICS)
    for model in IN_CASING:
        heights = " | ".join(f"{value:.0f}" for value in told["as shipped", model].heights_db)
        lines.append(f"| `{model}`, dB over the floor | {heights} |")
    lines += [
        "",
        "| force on bearing 3 over transmission error, N/um | " + _joined("{:g} kHz", _PASSED_HZ, 1e-3),
    ]
    lines.append("|---|" + "---|" * len(_PASSED_HZ))
    for model, finite in zip(IN_CASING, (False, True), strict=True):
        lines.append(
            f"| internals of `{model}` | " + _joined("{:.3g}", force_per_error(finite, _PASSED_HZ), 1e-6)
        )
    return lines


def _joined(form: str, values: Sequence[float] | Array, factor: float) -> str:
    return " | ".join(form.format(factor * float(value)) for value in values) + " |"


def _cell(one: Clarity | None) -> str:
    return "" if one is None else f"{one.median_lead_db:.0f} dB, {100 * one.share:.0f} %, {one.rms:.2f} m/s²"


def draw(records: Records, told: dict[tuple[str, str], Clarity]) -> Figure:
    """One turn and the spectrum of both models, as shipped and with white noise in the transmission error."""
    figure = new_figure(
        "the mesh in both models: as shipped, and with white noise in the transmission error", 5.6
    )
    axes = figure.subplots(2, 2, sharey="col")
    cases = ("as shipped", "white noise in the transmission error, (4.17)")
    for row, model in enumerate(IN_CASING):
        for case, colour in zip(cases[::-1], (FAULTY, HEALTHY), strict=True):
            samples = case_signal(records, model, case)
            turn = samples[: round(RATE_HZ / SPEED_HZ)]
            text = f"{case}: {100 * told[case, model].share:.0f} % of the power"
            axes[row, 0].plot(np.arange(turn.size) / RATE_HZ * 1e3, turn, color=colour, linewidth=0.5)
            frequency, density = welch(samples, RATE_HZ, nperseg=round(RATE_HZ / 2))
            axes[row, 1].plot(
                frequency / 1e3, 10 * np.log10(density), color=colour, linewidth=0.5, label=text
            )
        axes[row, 0].set_title(f"{model}: one turn [m/s²]", fontsize=9)
        axes[row, 1].set_title(f"{model}: spectrum [dB re (m/s²)²/Hz]", fontsize=9)
        axes[row, 1].legend(loc="lower left", fontsize=7.5)
        axes[row, 1].set_xlim(0, 24)
        axes[row, 1].axvline(MESH_HZ / 1e3, color=GREY, linewidth=0.5, linestyle=":")
    axes[0, 1].set_ylim(-90, 10)
    axes[1, 0].set_xlabel("time [ms]")
    axes[1, 1].set_xlabel("frequency [kHz]")
    return figure
