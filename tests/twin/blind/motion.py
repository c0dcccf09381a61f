"""A machine in motion: from static load on, at a course of speed and load, with the elements of effects."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import cont2discrete, lfilter

from blind.prescribed import mesh_functions, missing, rotating_force, tooth_functions, zones
from blind.runge_kutta import Constants, Prescribed, integrate
from gearsim_sim.model.bearing_faults import BearingTerm, Term
from gearsim_sim.model.loose_foot import LooseFoot
from gearsim_sim.model.mesh_terms import MeshTerm
from gearsim_sim.model.plant import LOAD, MOTOR, Plant, RotatingSite
from gearsim_sim.model.rotating_force import RotatingForce

Array = NDArray[np.float64]
_CHUNK = 8192  # steps
_RISE_S, _SETTLE_S = 0.15, 0.35
# A drive's controller holds the mean speed against what its torque does not balance.
_HOLD_HZ, _HOLD_DAMPING = 0.25, 0.7


@dataclass(frozen=True, eq=False)
class Course:
    """Speed of the reference shaft and load over time, at half steps from -0.5 s (running in) on.

    Attributes
    ----------
    step_s : float
    turns, speed_hz, load_nm : ndarray, shape (2 N + 1,)
    """

    step_s: float
    turns: Array
    speed_hz: Array
    load_nm: Array


@dataclass(frozen=True, eq=False)
class Extras:
    """What effects add.

    Attributes
    ----------
    contributions : tuple
        Of faults, as `FaultKind.build` gives them, at full severity.
    lags : mapping of int to callable
        Turns that the cage of a bearing has fallen behind, from the kinematic turns that it has made.
    forces : tuple of (direction, callable)
        Forces [N] along a direction (n,), from seconds and turns of the reference shaft.
    """

    contributions: tuple[Any, ...] = ()
    lags: Mapping[int, Callable[[Array], Array]] = field(default_factory=dict)
    forces: tuple[tuple[Array, Callable[[Array, Array], Array]], ...] = ()


def lead_steps(step_s: float) -> int:
    """Steps before the first sample."""
    return round((_RISE_S + _SETTLE_S) / step_s)


def constants(plant: Plant, added: tuple[Any, ...]) -> Constants:
    """The machine as the integrator takes it; nothing pushes the rigid rotation, which is prescribed."""
    system, n = plant.system, len(plant.system.dof_names)
    mass = np.diag(system.mass)
    rigid = plant.rigid
    keep = np.eye(n) - np.outer(rigid, rigid * mass) / plant.inertia_kg_m2
    inverse = keep / mass[None, :]
    most = max((seat.law.ball_count for seat in plant.bearings), default=0)
    azimuths = np.zeros((len(plant.bearings), 2 * most))
    for b, seat in enumerate(plant.bearings):
        azimuths[b, 0 : 2 * seat.law.ball_count : 2] = np.cos(seat.law.azimuths_rad)
        azimuths[b, 1 : 2 * seat.law.ball_count : 2] = np.sin(seat.law.azimuths_rad)
    bearings = [
        [seat.law.load_factor, seat.law.exponent, seat.law.clearance_m, seat.nominal_stiffness_n_per_m]
        for seat in plant.bearings
    ]
    meshes = np.array([[one.mean_stiffness_n_per_m, one.damping_ns_per_m, 0, 0] for one in plant.meshes])
    meshes = meshes.reshape(-1, 4)
    for one in added:
        if isinstance(one, MeshTerm):
            meshes[one.mesh, 2 + one.what] += one.value_m
    motion = np.zeros((2 * system.interfaces.shape[1], 2 * n))
    motion[: len(motion) // 2, :n] = motion[len(motion) // 2 :, n:] = system.interfaces.T
    rows = [row for site in plant.sites.values() for row in _rows(site)]
    return Constants(
        linear=np.ascontiguousarray(-inverse @ np.hstack([system.stiffness, system.damping])),
        motion=motion,
        enter=np.ascontiguousarray(inverse @ system.interfaces),
        sites=np.array([system.direction(row) for row in rows]),
        bearing_places=np.array(
            [[s.x, s.y, s.law.ball_count] for s in plant.bearings], dtype=np.int64
        ).reshape(-1, 3),
        bearing_numbers=np.array(bearings, dtype=np.float64).reshape(-1, 4),
        azimuths=azimuths,
        mesh_places=np.array([one.interface for one in plant.meshes], dtype=np.int64),
        mesh_numbers=meshes,
        feet=_feet(plant, inverse, added),
    )


def _rows(site: Any) -> tuple[Any, ...]:
    return (site.x, site.y) if isinstance(site, RotatingSite) else (site,)


def _feet(plant: Plant, inverse: Array, added: tuple[Any, ...]) -> Array:
    rows = []
    for one in added:
        if isinstance(one, LooseFoot):
            direction = plant.system.direction(one.direction)
            numbers = [one.stiffness_n_per_m, one.damping_ns_per_m, one.reduction]
            numbers += [one.opens_at_m, one.gap_m, one.rounding_m]
            rows.append(np.concatenate([inverse @ direction, direction, numbers]))
    return np.array(rows).reshape(-1, 2 * len(inverse) + 6)


def run(plant: Plant, course: Course, extras: Extras, sites: tuple[str, ...]) -> Array:
    """Accelerations of sites at every step from time 0 on, (sites, steps) [m/s^2]."""
    added = extras.contributions
    machine = constants(plant, added)
    teeth, surfaces = tooth_functions(plant, added), zones(plant, added)
    widened = np.zeros(len(plant.bearings))
    for one in added:
        if isinstance(one, BearingTerm):
            if one.what is not Term.CLEARANCE:
                raise NotImplementedError(str(one.what))
            widened[one.bearing] += one.values[0]
    inverse = machine_inverse(plant)
    steps = (course.turns.size - 1) // 2
    out = np.zeros((machine.sites.shape[0], steps))
    y = np.zeros(machine.linear.shape[1])
    offset = lead_steps(course.step_s)
    turns = course.turns + _swing(plant, course, extras)
    for first in range(0, steps, _CHUNK):
        count = min(_CHUNK, steps - first)
        part = slice(2 * first, 2 * (first + count) + 1)
        seconds = (np.arange(part.start, part.stop) / 2 - offset) * course.step_s
        phases = _phases(plant, turns[part], extras)
        hz = np.outer(plant.rates, course.speed_hz[part])
        known = _known(plant, course, extras, part, seconds, turns[part], phases, hz) @ inverse.T
        cages = np.array([seat.cage for seat in plant.bearings], dtype=np.int64)
        given = Prescribed(
            cages=np.ascontiguousarray(2 * np.pi * phases[cages].T),
            missing=missing(plant, surfaces, phases, widened)
            if surfaces or widened.any()
            else np.zeros((0, 0, 0)),
            meshes=mesh_functions(teeth, len(plant.meshes), phases, hz),
            known=np.ascontiguousarray(known),
        )
        block = np.zeros((out.shape[0], count))
        integrate(y, machine, given, course.step_s, block)
        out[:, first : first + count] = block
    if not np.all(np.isfinite(out)):
        raise FloatingPointError("the generator's machine became unstable")
    return _seen(plant, out[:, offset:], turns[2 * offset : -1 : 2], sites)


def machine_inverse(plant: Plant) -> Array:
    """M^-1 without what would turn the whole machine, (n, n)."""
    mass, rigid = np.diag(plant.system.mass), plant.rigid
    keep = np.eye(mass.size) - np.outer(rigid, rigid * mass) / plant.inertia_kg_m2
    return np.asarray(keep / mass[None, :])


def _phases(plant: Plant, turns: Array, extras: Extras) -> Array:
    """Turns of all tracks, (tracks, times); a cage that lags takes its balls' spin along."""
    offsets = np.array([track.offset_turns for track in plant.tracks])
    phases = offsets[:, None] + np.outer(plant.rates, turns)
    for bearing, lag in extras.lags.items():
        seat = plant.bearings[bearing]
        sense = 1.0 if plant.rates[seat.cage] >= 0 else -1.0
        behind = lag(sense * phases[seat.cage])
        ratio = plant.rates[seat.spin] / plant.rates[seat.cage]
        phases[seat.cage] -= sense * behind
        phases[seat.spin] -= sense * ratio * behind
    return np.asarray(phases)


def _known(
    plant: Plant,
    course: Course,
    extras: Extras,
    part: slice,
    seconds: Array,
    turns: Array,
    phases: Array,
    hz: Array,
) -> Array:
    """Known forces on the degrees of freedom, (times, n); they come on within the first moments."""
    load = course.load_nm[part]
    motor, driven = plant.torque_ratios
    inputs = np.zeros((load.size, len(plant.system.input_names)))
    inputs[:, MOTOR] = -driven * np.mean(course.load_nm) / motor
    inputs[:, LOAD] = load
    inputs[:, 2] = plant.gravity_m_per_s2
    total = inputs @ plant.system.inputs.T
    for one in extras.contributions:
        if isinstance(one, RotatingForce):
            force = rotating_force(one, seconds, phases, hz)
            total += np.outer(force, plant.system.direction(one.direction))
    for direction, force_at in extras.forces:
        total += np.outer(force_at(seconds, turns), direction)
    since = seconds + _RISE_S + _SETTLE_S
    rise = 0.5 - 0.5 * np.cos(np.pi * np.clip(since / _RISE_S, 0.0, 1.0))
    return np.asarray(total * rise[:, None])


def _swing(plant: Plant, course: Course, extras: Extras) -> Array:
    """Turns by which the machine leaves its course under torques that the motor does not balance."""
    lead = lead_steps(course.step_s)
    seconds = (np.arange(course.turns.size) / 2 - lead) * course.step_s
    torque = plant.torque_ratios[1] * (course.load_nm - np.mean(course.load_nm))
    phases, hz = None, None
    for one in extras.contributions:
        if isinstance(one, RotatingForce):
            share = float(plant.rigid @ plant.system.direction(one.direction))
            if abs(share) > 1e-9:
                if phases is None or hz is None:
                    phases = _phases(plant, course.turns, extras)
                    hz = np.outer(plant.rates, course.speed_hz)
                torque = torque + share * rotating_force(one, seconds, phases, hz)
    if not np.any(torque):
        return np.zeros(course.turns.size)
    w = 2 * math.pi * _HOLD_HZ
    system = ([1.0 / plant.inertia_kg_m2], [1.0, 2 * _HOLD_DAMPING * w, w * w])
    b, a, _ = cont2discrete(system, 0.5 * course.step_s, method="foh")
    return np.asarray(lfilter(b.ravel(), a, torque) / (2 * np.pi))


def _seen(plant: Plant, rows: Array, turns: Array, names: tuple[str, ...]) -> Array:
    """The sites' own rows; those that turn with something see it turn."""
    found, at = {}, 0
    for name, site in plant.sites.items():
        if isinstance(site, RotatingSite):
            track = plant.tracks[site.track]
            phase = site.sense * (track.offset_turns + track.rate * turns) + site.offset_turns
            angle = 2 * np.pi * phase
            found[name] = np.cos(angle) * rows[at] + np.sin(angle) * rows[at + 1]
            at += 2
        else:
            found[name] = rows[at]
            at += 1
    return np.array([found[name] for name in names])
