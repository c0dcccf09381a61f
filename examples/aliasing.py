"""Three ways to spoil a simulated vibration spectrum, and what they cost.

    python examples/aliasing.py            writes docs/images/aliasing.png

A gearbox simulated with a good solver may still have lines in its spectrum that no gearbox has. Three
causes, each beside the spectrum that is right:

1. Sampling without a filter. The contact of a ball with the edge of a pit bends the force at once, so the
   acceleration has no upper frequency. Even an exact solution, read off at 65536 Hz, folds what lies above.
2. A tolerance above the motion. The displacements of a gearbox are micrometres; an adaptive solver with an
   absolute tolerance of 1e-6 m does not see them and steps at the limit of its stability, where it rings.
3. Tables read off at the nearest point, or joined by straight lines. The transmission error then jumps or
   bends thousands of times per turn, and the jumps excite the structure.

The levels are those of `gearsim_sim.aliasing.alias_level_db`: power of the difference to the right spectrum
over its whole power, within the band of the decimation filter.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from gearsim_sim.aliasing import alias_level_db
from gearsim_sim.bench import VectorisedGearbox, rest_state
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.decimate import decimation_taps
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_parallel_params

Array = NDArray[np.float64]
RATE_HZ = 65536.0
PICTURE = Path(__file__).resolve().parents[1] / "docs" / "images" / "aliasing.png"
# The shaft beside a pit in bearing 3: nothing lies between it and the contact.
SHAFT = {"shaft": {"y_s3": 1.0}}
PIT = FaultSpec("inner_race_spall", "bearing_3", {"width_m": 0.8e-3})
STEPS = 4  # per sample, of the plain solver below
TABLE_POINTS = 900  # per turn, as many as an encoder has lines


@dataclass(frozen=True)
class Case:
    """A wrong signal beside the right one, both of one site at 65536 Hz."""

    title: str
    right: Array
    wrong: dict[str, Array]

    def levels_db(self) -> dict[str, float]:
        """What each wrong signal costs."""
        return {name: float(alias_level_db(signal, self.right)) for name, signal in self.wrong.items()}


def unfiltered(seconds: float = 0.2) -> Case:
    """Cause 1: the exact solution, read off without a filter, beside 4 steps per sample with one."""
    params = load_parallel_params()
    count = round(seconds * RATE_HZ)
    right = Engine(params, 1, RATE_HZ, 256, (PIT,), sites=SHAFT).advance(count).accel[0]
    finest = Engine(params, 1, 8 * RATE_HZ, 32, (PIT,), sites=SHAFT).advance(8 * count).accel[0]
    usual = Engine(params, 1, RATE_HZ, 4, (PIT,), sites=SHAFT).advance(count).accel[0]
    wrong = {"exact, read off at 65536 Hz": finest[::8], "4 steps per sample, filtered": usual}
    return Case("1. Sampling without a filter", right, wrong)


class TabledGearbox(VectorisedGearbox):
    """The same machine, its transmission errors read from tables of TABLE_POINTS per turn."""

    def __init__(self, *, linear: bool | None) -> None:
        """`linear`: straight lines between the points; else the nearest point; None: smooth, as it is."""
        plant = make_plant(load_parallel_params(), 1)
        super().__init__(plant)
        self.plant, self._straight = plant, linear
        self._points = np.arange(TABLE_POINTS) / TABLE_POINTS
        mesh = plant.meshes[0]
        tables = [one.series.value(self._points) for one in mesh.errors]
        self._error_tables = [(one.track, table) for one, table in zip(mesh.errors, tables, strict=True)]
        self._column = self._interfaces[:, mesh.interface]

    def __call__(self, t: float, state: Array) -> Array:
        """The derivative; what the tables change acts through the mean stiffness of the mesh."""
        result = super().__call__(t, state)
        if self._straight is not None:
            phases = self.plant.phases(0.5 + 10.0 * t)
            mesh = self.plant.meshes[0]
            wrong = sum(self._read(table, float(phases[track])) for track, table in self._error_tables)
            error = wrong - mesh.error(phases)
            result[state.size // 2 :] -= self._column * mesh.mean_stiffness_n_per_m * error
        return result

    def _read(self, table: Array, turns: float) -> float:
        place = (turns % 1.0) * TABLE_POINTS
        if not self._straight:
            return float(table[round(place) % TABLE_POINTS])
        low = int(place)
        share = place - low
        return float(table[low % TABLE_POINTS] * (1 - share) + table[(low + 1) % TABLE_POINTS] * share)

    def acceleration(self, t: float, state: Array) -> float:
        """Of the pedestal of bearing 3, in y."""
        return float(self(t, state)[state.size // 2 + self.plant.system.dof("y_p3")])


def runge_kutta(model: TabledGearbox, seconds: float) -> Array:
    """Accelerations by the classical method at STEPS per sample, filtered and decimated."""
    h = 1 / (RATE_HZ * STEPS)
    state, values = rest_state(model.plant), []
    for i in range(round(seconds / h)):
        t = i * h
        k1 = model(t, state)
        values.append(k1[state.size // 2 + model.plant.system.dof("y_p3")])
        k2 = model(t + h / 2, state + h / 2 * k1)
        k3 = model(t + h / 2, state + h / 2 * k2)
        k4 = model(t + h, state + h * k3)
        state = state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return filtered(np.array(values))


def filtered(values: Array) -> Array:
    """The decimation filter of the engine; it needs 27 samples on each side."""
    return np.convolve(values, decimation_taps(STEPS), "valid")[::STEPS]


def blind_solver(seconds: float = 0.06) -> Case:
    """Cause 2: RK45 at rtol 1e-3 and atol 1e-6, its usual values, beside a fixed step of 1/4 sample."""
    model = TabledGearbox(linear=None)
    times = np.arange(round(seconds * RATE_HZ * STEPS)) / (RATE_HZ * STEPS)
    found = solve_ivp(model, (0, times[-1]), rest_state(model.plant), "RK45", times, rtol=1e-3, atol=1e-6)
    wrong = np.array([model.acceleration(t, y) for t, y in zip(times, found.y.T, strict=True)])
    return Case(
        "2. A tolerance above the motion",
        runge_kutta(model, seconds),
        {"RK45, absolute tolerance 1e-6": filtered(wrong)},
    )


def coarse_tables(seconds: float = 0.06) -> Case:
    """Cause 3: the transmission error from tables of 900 points per turn."""
    wrong = {
        "nearest of 900 points": runge_kutta(TabledGearbox(linear=False), seconds),
        "straight lines between them": runge_kutta(TabledGearbox(linear=True), seconds),
    }
    return Case("3. Tables read off coarsely", runge_kutta(TabledGearbox(linear=None), seconds), wrong)


CASES: tuple[Callable[[], Case], ...] = (unfiltered, blind_solver, coarse_tables)


def spectrum_db(signal: Array) -> tuple[Array, Array]:
    """Frequencies [kHz] and amplitudes [dB re 1 m/s^2], Hann window."""
    window = np.hanning(signal.size)
    amplitude = 2 * np.abs(np.fft.rfft(signal * window)) / window.sum()
    return np.fft.rfftfreq(signal.size, 1 / RATE_HZ) / 1e3, 20 * np.log10(amplitude + 1e-15)


def draw(cases: list[Case], path: Path) -> None:
    """The right spectrum of each case, and what is wrong in the others."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(cases), 1, figsize=(9, 3.2 * len(cases)), sharex=True)
    for axis, case in zip(axes, cases, strict=True):
        levels = case.levels_db()
        axis.plot(*spectrum_db(case.right), lw=0.7, color="black", label="right")
        for name, signal in case.wrong.items():
            label = f"wrong in: {name} ({levels[name]:+.0f} dB)"
            axis.plot(*spectrum_db(signal - case.right), lw=0.7, label=label)
        axis.set_title(case.title, loc="left", fontsize=10)
        axis.set_ylabel("dB re 1 m/s²")
        axis.set_ylim(-160, 20)
        axis.legend(loc="upper right", fontsize=8)
        axis.grid(alpha=0.3)
    axes[-1].set_xlabel("frequency [kHz]")
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


def main(path: Path = PICTURE) -> None:
    """Print what each cause costs, and draw it."""
    cases = [make() for make in CASES]
    for case in cases:
        print(case.title)
        for name, level in case.levels_db().items():
            print(f"  {name:32} {level:7.1f} dB")
    draw(cases, path)
    print(path)


if __name__ == "__main__":
    main(*(Path(word) for word in sys.argv[1:2]))
