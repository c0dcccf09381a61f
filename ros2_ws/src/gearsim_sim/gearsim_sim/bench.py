"""How fast machines run, beside scipy's RK45 on the same right-hand side in numpy.

Two right-hand sides are offered to RK45: `PlainMachine` is the equations as one writes them down in numpy,
element by element, `VectorisedGearbox` is the 34-DOF gearbox tuned (all balls at once, one matrix). Both
take mesh stiffness and transmission error from the same tables as the compiled loop.
"""

from __future__ import annotations

import math
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from gearsim_sim.aliasing import alias_level_db
from gearsim_sim.engine import Engine
from gearsim_sim.ensemble import Ensemble, Variant
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.gear_mesh import Mesh
from gearsim_sim.model.plant import Moment, Plant
from gearsim_sim.model.plants import make_plant
from gearsim_sim.model.statics import static_equilibrium
from gearsim_sim.params import load_parallel_params, load_planetary_params
from gearsim_sim.params.casing_gearbox import CasingGearboxParams, load_casing_gearbox_params
from gearsim_sim.params.parallel import ParallelParams

Array = NDArray[np.float64]
SAMPLE_RATE_HZ = 65536.0
SPEED_HZ, LOAD_NM, TURNS = 10.0, 50.0, 0.5
RELATIVE_TOLERANCE = 1e-6
# The motion is micrometres; scipy's default of 1e-6 would leave RK45 on its limit of stability.
ABSOLUTE_TOLERANCE = 1e-12
_ALIAS_TRUTH = 64  # steps per sample; what these fold is 20 dB below what 8 do
_START = (
    "from gearsim_sim.engine import Engine; from gearsim_sim.params import load_parallel_params; "
    "Engine(load_parallel_params(), 1, 65536.0).advance(4096)"
)


def double_row_params() -> ParallelParams:
    """The 34-DOF gearbox on bearings of 24 balls in each of two rows, small ones, so that they fit."""
    params = load_parallel_params()
    bearings = tuple(
        replace(one, rolling_elements=24, element_diameter_m=0.6 * one.element_diameter_m)
        for one in params.bearings
    )
    return params.model_copy(update={"bearings": bearings})


def planetary_params() -> Any:
    """The planetary stage."""
    return load_planetary_params()


def casing_params(*, finite: bool) -> CasingGearboxParams:
    """The gearbox in its flexible casing: 146 degrees of freedom, or 182 with shafts of finite elements."""
    return load_casing_gearbox_params(finite=finite)


def casing_real_time_factor(
    params: CasingGearboxParams,
    seconds: float = 0.25,
    repeats: int = 20,
    clock: Callable[[], float] = time.process_time,
) -> float:
    """As `engine_real_time_factor`, with one accelerometer on a wall and the eight forces on the casing."""
    engine = Engine(params, 1, SAMPLE_RATE_HZ, looked_at=[params.casing.sites[-1].name], forces=True)
    return best_factor(engine.advance, seconds, repeats, clock)


def casing_alias_db(params: CasingGearboxParams, oversampling: int, seconds: float = 0.1) -> float:
    """Aliasing [dB] at the worst of three places, with a spall of 0.8 mm on the outer race of bearing_3.

    Against the same machine at 64 steps per sample, see `aliasing`.
    """
    spall = (FaultSpec("outer_race_spall", "bearing_3", {"width_m": 8e-4}),)
    looked_at = ("b3_y", *(site.name for site in params.casing.sites[-2:]))
    signal, truth = (
        Engine(params, 1, SAMPLE_RATE_HZ, steps, spall, looked_at=looked_at)
        .advance(round(seconds * SAMPLE_RATE_HZ))
        .accel
        for steps in (oversampling, _ALIAS_TRUTH)
    )
    return float(alias_level_db(signal, truth).max())


def best_factor(
    run: Callable[[int], object], seconds: float, repeats: int, clock: Callable[[], float]
) -> float:
    """Seconds of samples that `run(samples)` makes per second of `clock`, the best of `repeats` runs."""
    samples = round(seconds * SAMPLE_RATE_HZ)
    best = math.inf
    for _ in range(repeats):
        start = clock()
        run(samples)
        best = min(best, clock() - start)
    return samples / SAMPLE_RATE_HZ / best


def engine_real_time_factor(
    oversampling: int = 4,
    seconds: float = 0.5,
    repeats: int = 10,
    clock: Callable[[], float] = time.process_time,
    *,
    params: Any = None,
) -> float:
    """Simulated seconds per second of processor time, decimation filter included; the best of `repeats`.

    Parameters
    ----------
    oversampling : int
        Steps per output sample.
    seconds : float
        Simulated time of one repeat at 65536 Hz, all sites.
    repeats : int
        Runs; other programs on the machine only make single ones slower.
    clock : callable
        Processor time in seconds.
    params : parameters of a machine
        Default: the 34-DOF gearbox.
    """
    engine = Engine(load_parallel_params() if params is None else params, 1, SAMPLE_RATE_HZ, oversampling)
    return best_factor(engine.advance, seconds, repeats, clock)


def ensemble_real_time_factor(
    variants: int = 32,
    seconds: float = 0.25,
    repeats: int = 8,
    clock: Callable[[], float] = time.process_time,
    *,
    own_matrices: bool,
) -> float:
    """The same of an ensemble in one thread, as the number of gearboxes that run in real time.

    Variants differ in the seed of their gears' errors, speed and load, and every second one has a spall;
    with `own_matrices` in damping and mass too, so that each has modes of its own.
    """
    spall = (FaultSpec("outer_race_spall", "bearing_3", {}, 1.0, "spall"),)
    made = []
    for k in range(variants):
        changes = {"mesh.damping": f"{600 + 10 * k} N*s/m", "pedestal.mass": f"{8 + 0.05 * k} kg"}
        params = load_parallel_params(overrides=changes if own_matrices else None)
        made.append(Variant(params, k, spall if k % 2 else (), 9.0 + 0.05 * k, 40.0 + 0.5 * k))
    ensemble = Ensemble(made, SAMPLE_RATE_HZ)
    samples = round(seconds * SAMPLE_RATE_HZ)
    best = math.inf
    for _ in range(repeats):
        start = clock()
        ensemble.advance(samples)
        best = min(best, clock() - start)
    return variants * samples / SAMPLE_RATE_HZ / best


def startup_seconds(repeats: int = 3) -> float:
    """Processor time from the start of a fresh process to the first 4096 samples, compiled code on disk."""
    best = math.inf
    for _ in range(repeats + 1):  # the first one may have to compile
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-c", _START], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        best = min(best, used)
    return best


def memory_slope_mb_per_minute(seconds: float = 30.0) -> float:
    """Growth of resident memory with simulated time, as the slope through the middle of two halves."""
    engine = Engine(load_parallel_params(), 1, SAMPLE_RATE_HZ)
    portions = 2 * max(2, round(seconds / 0.25))
    sizes = np.empty(portions)
    for i in range(portions):
        engine.advance(round(SAMPLE_RATE_HZ / 8))
        sizes[i] = _resident_mb()
    # The first quarter is left to the allocator.
    late = np.array_split(sizes[portions // 4 :], 2)
    apart_min = 0.375 * portions / 8 / 60
    return float(np.median(late[1]) - np.median(late[0])) / apart_min


def _resident_mb() -> float:
    with open("/proc/self/statm") as numbers:
        return int(numbers.read().split()[1]) * resource.getpagesize() / 1e6


def rk45_real_time_factor(
    seconds: float = 0.01,
    repeats: int = 3,
    clock: Callable[[], float] = time.process_time,
    *,
    vectorised: bool = False,
    params: Any = None,
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
        The tuned right-hand side in place of the plain one; it is that of the parallel-shaft gearbox.
    params : parameters of a machine
        Default: the 34-DOF gearbox.
    """
    plant = make_plant(load_parallel_params() if params is None else params, 1)
    model = VectorisedGearbox(plant) if vectorised else PlainMachine(plant)
    start = rest_state(plant)
    best = math.inf
    for _ in range(repeats):
        began = clock()
        solve_ivp(
            model, (0.0, seconds), start, method="RK45", rtol=RELATIVE_TOLERANCE, atol=ABSOLUTE_TOLERANCE
        )
        best = min(best, clock() - began)
    return seconds / best


def rest_state(plant: Plant) -> Array:
    """Static equilibrium at the start, as (x, x')."""
    moment, u = Moment(TURNS, SPEED_HZ), plant.known_inputs(LOAD_NM)
    rest = static_equilibrium(plant, complex_modes(plant.system), moment, u)
    return np.concatenate([rest, np.zeros_like(rest)])


class PlainMachine:
    """d(state)/dt of state = (x, x'), x counted from the rigid rotation: element by element, no faults."""

    def __init__(self, plant: Plant) -> None:
        system = plant.system
        self._plant = plant
        self._mass = np.diag(system.mass)
        self._damping, self._stiffness = system.damping, system.stiffness
        self._interfaces = system.interfaces
        self._constant = system.inputs @ plant.known_inputs(LOAD_NM)
        self._meshes = [(mesh.interface, _TabledMesh(plant, mesh)) for mesh in plant.meshes]

    def __call__(self, t: float, state: Array) -> Array:
        """The derivative."""
        x, v = np.split(state, 2)
        q = self._interfaces.T @ x
        turns = TURNS + SPEED_HZ * t
        phases = self._plant.phases(turns)
        g = np.zeros_like(q)
        for seat in self._plant.bearings:
            pair = [seat.x, seat.y]
            force = seat.law.force(q[pair], seat.cage_angle_rad(phases))
            g[pair] = seat.nominal_stiffness_n_per_m * q[pair] - force
        for interface, mesh in self._meshes:
            g[interface] = mesh.deviation(q[interface], phases)
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
        self._mesh, self._plant = _TabledMesh(gearbox, gearbox.meshes[0]), gearbox

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
        g[8] = self._mesh.deviation(q[8], self._plant.phases(turns))
        result = np.empty_like(state)
        result[:size] = state[size:]
        result[size:] = self._linear @ state + self._interfaces @ g + self._constant
        return result


class _TabledMesh:
    """Force of a mesh beyond its linear part, from tables."""

    def __init__(self, plant: Plant, mesh: Mesh) -> None:
        self._mesh = mesh
        self._stiffness = _split(mesh.stiffness.table())
        self._errors = [
            (one.track, float(plant.rates[one.track]), _split(one.series.table())) for one in mesh.errors
        ]

    def deviation(self, q: float, phases: Array) -> float:
        """At a compression `q` without transmission error."""
        mesh = self._mesh
        pitches = phases[mesh.track] * mesh.cycles + mesh.phase_offset
        stiffness, _ = _look_up(self._stiffness, pitches)
        start, width, height = mesh.pulse
        if height and (pitches - start) % 1.0 < width:
            stiffness += height
        error = rate = 0.0
        for track, turning, table in self._errors:
            value, slope = _look_up(table, float(phases[track]))
            error += value
            rate += SPEED_HZ * turning * slope
        linear = (mesh.mean_stiffness_n_per_m - stiffness) * q
        return linear - stiffness * error - mesh.damping_ns_per_m * rate


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
