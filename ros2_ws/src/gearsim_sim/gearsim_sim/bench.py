"""How fast the 34-DOF model runs, beside scipy's RK45 on the same right-hand side in numpy.

Two right-hand sides are offered to RK45: `PlainGearbox` is the equations as one writes them down in
numpy, bearing by bearing, `VectorisedGearbox` is tuned (all balls at once, one matrix). Both take mesh
stiffness and transmission error from the same tables as the compiled loop.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from gearsim_sim.engine import Engine
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.plant import Moment, Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_parallel_params

Array = NDArray[np.float64]
SAMPLE_RATE_HZ = 65536.0
SPEED_HZ, LOAD_NM, TURNS = 10.0, 50.0, 0.5
RELATIVE_TOLERANCE = 1e-6
# The motion is micrometres; scipy's default of 1e-6 would leave RK45 on its limit of stability.
ABSOLUTE_TOLERANCE = 1e-12


def engine_real_time_factor(
    oversampling: int = 4,
    seconds: float = 0.5,
    repeats: int = 10,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """Simulated seconds per second of processor time, decimation filter included; the best of `repeats`.

    Parameters
    ----------
    oversampling : int
        Steps per output sample.
    seconds : float
        Simulated time of one repeat at 65536 Hz, eight sites.
    repeats : int
        Runs; other programs on the machine only make single ones slower.
    clock : callable
        Processor time in seconds.
    """
    engine = Engine(load_parallel_params(), 1, SAMPLE_RATE_HZ, oversampling)
    samples = round(seconds * SAMPLE_RATE_HZ)
    best = math.inf
    for _ in range(repeats):
        start = clock()
        engine.advance(samples)
        best = min(best, clock() - start)
    return samples / SAMPLE_RATE_HZ / best


def rk45_real_time_factor(
    seconds: float = 0.01,
    repeats: int = 3,
    clock: Callable[[], float] = time.process_time,
    *,
    vectorised: bool = False,
) -> float:
    """The same of `scipy.integrate.solve_ivp` with RK45 at rtol 1e-6, accelerations not even counted.

    Parameters
    ----------
    seconds : float
        Simulated time of one repeat, from static equilibrium.
    repeats : int
        Runs; the best counts.
    clock : callable
        Processor time in seconds.
    vectorised : bool
        The tuned right-hand side in place of the plain one.
    """
    gearbox = make_plant(load_parallel_params(), 1)
    model = VectorisedGearbox(gearbox) if vectorised else PlainGearbox(gearbox)
    start = rest_state(gearbox)
    best = math.inf
    for _ in range(repeats):
        began = clock()
        solve_ivp(
            model, (0.0, seconds), start, method="RK45", rtol=RELATIVE_TOLERANCE, atol=ABSOLUTE_TOLERANCE
        )
        best = min(best, clock() - began)
    return seconds / best


def rest_state(gearbox: Plant) -> Array:
    """Static equilibrium at the start, as (x, x')."""
    moment, u = Moment(TURNS, SPEED_HZ), gearbox.known_inputs(LOAD_NM)
    rest = static_equilibrium(gearbox, complex_modes(gearbox.system), moment, u)
    return np.concatenate([rest, np.zeros_like(rest)])


class PlainGearbox:
    """d(state)/dt of state = (x, x'), x counted from the rigid rotation: bearing by bearing."""

    def __init__(self, gearbox: Plant) -> None:
        system = gearbox.system
        self._mass = np.diag(system.mass)
        self._damping, self._stiffness = system.damping, system.stiffness
        self._interfaces = system.interfaces
        self._constant = system.inputs @ gearbox.known_inputs(LOAD_NM)
        self._bearings = [seat.law for seat in gearbox.bearings]
        self._mesh = _TabledMesh(gearbox)
        self._cages = [gearbox.rates[seat.cage] for seat in gearbox.bearings]
        self._nominal = gearbox.bearings[0].nominal_stiffness_n_per_m

    def __call__(self, t: float, state: Array) -> Array:
        """The derivative."""
        x, v = np.split(state, 2)
        q = self._interfaces.T @ x
        turns = TURNS + SPEED_HZ * t
        g = self._nominal * q
        for i, bearing in enumerate(self._bearings):
            angle = bearing.azimuths_rad + 2 * np.pi * self._cages[i] * turns
            cosine, sine = np.cos(angle), np.sin(angle)
            gap = np.maximum(q[2 * i] * cosine + q[2 * i + 1] * sine - bearing.clearance_m, 0.0)
            force = bearing.load_factor * gap**1.5
            g[2 * i] -= force @ cosine
            g[2 * i + 1] -= force @ sine
        g[8] = self._mesh.deviation(q[8], turns)
        force = self._constant + self._interfaces @ g - self._damping @ v - self._stiffness @ x
        return np.concatenate([v, force / self._mass])


class VectorisedGearbox:
    """The same, tuned as far as numpy goes."""

    def __init__(self, gearbox: Plant) -> None:
        system, bearings = gearbox.system, [seat.law for seat in gearbox.bearings]
        inverse = 1.0 / np.diag(system.mass)[:, None]
        self._linear = -inverse * np.hstack([system.stiffness, system.damping])
        self._interfaces = inverse * system.interfaces
        self._motion = np.ascontiguousarray(system.interfaces.T)
        self._constant = (inverse * system.inputs) @ gearbox.known_inputs(LOAD_NM)
        self._azimuths = np.array([bearing.azimuths_rad for bearing in bearings])
        self._cages = 2 * np.pi * gearbox.rates[[seat.cage for seat in gearbox.bearings], None]
        self._factors = np.array([[bearing.load_factor] for bearing in bearings])
        self._clearances = np.array([[bearing.clearance_m] for bearing in bearings])
        self._nominal = gearbox.bearings[0].nominal_stiffness_n_per_m
        self._mesh = _TabledMesh(gearbox)

    def __call__(self, t: float, state: Array) -> Array:
        """The derivative."""
        size = state.size // 2
        q = self._motion @ state[:size]
        turns = TURNS + SPEED_HZ * t
        angles = self._azimuths + self._cages * turns
        cosines, sines = np.cos(angles), np.sin(angles)
        x, y = q[0:8:2, None], q[1:8:2, None]
        gaps = np.maximum(x * cosines + y * sines - self._clearances, 0.0)
        balls = self._factors * gaps * np.sqrt(gaps)
        g = self._nominal * q
        g[0:8:2] -= np.einsum("ij,ij->i", balls, cosines)
        g[1:8:2] -= np.einsum("ij,ij->i", balls, sines)
        g[8] = self._mesh.deviation(q[8], turns)
        result = np.empty_like(state)
        result[:size] = state[size:]
        result[size:] = self._linear @ state + self._interfaces @ g + self._constant
        return result


class _TabledMesh:
    """Force of the mesh beyond its linear part, from tables."""

    def __init__(self, gearbox: Plant) -> None:
        mesh = gearbox.meshes[0]
        self._mean, self._damping = mesh.mean_stiffness_n_per_m, mesh.damping_ns_per_m
        self._teeth, self._ratio = mesh.cycles, float(gearbox.rates[1])
        series = (mesh.stiffness, *(one.series for one in mesh.errors))
        self._tables = [_split(one.table()) for one in series]

    def deviation(self, q: float, turns: float) -> float:
        """At a compression `q` without transmission error."""
        stiffness, _ = _look_up(self._tables[0], turns * self._teeth)
        e1, slope1 = _look_up(self._tables[1], turns)
        e2, slope2 = _look_up(self._tables[2], turns * self._ratio)
        rate = SPEED_HZ * (slope1 + self._ratio * slope2)
        return (self._mean - stiffness) * q - stiffness * (e1 + e2) - self._damping * rate


def _split(table: Array) -> tuple[list[float], list[float]]:
    return table[0::2].tolist(), table[1::2].tolist()


def _look_up(table: tuple[list[float], list[float]], turns: float) -> tuple[float, float]:
    """Value and slope per turn by cubic Hermite interpolation."""
    values, slopes = table
    points = len(values) - 1
    place = (turns - math.floor(turns)) * points
    i = min(int(place), points - 1)
    t = place - i
    u = 1.0 - t
    rise = values[i + 1] - values[i]
    a, b = slopes[i] - rise, rise - slopes[i + 1]
    value = u * values[i] + t * values[i + 1] + t * u * (a * u + b * t)
    return value, (rise + (1 - 2 * t) * (a * u + b * t) + t * u * (b - a)) * points
