"""Forces beside the machine's own elements, as arrays of the compiled loop.

Known forces (ripple, unbalance), loose feet and side oscillators may act along any direction, and come and
go with faults. Each direction is worked out once in terms of modes, interfaces and sites; then the loop
adds what acts there, after everything else, so that a force of zero changes no bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.carrier_kernel import Oscillators, Weights, oscillator_weights
from gearsim_sim.integrate.coefficients import Propagator, cubic_weights, padded
from gearsim_sim.model.assembly import LinearSystem, Vector

Array = NDArray[np.float64]
# Numbers that a loose foot or an oscillator carries from step to step.
STATE_SIZE = 12
POLE_SIZE = 10
# The rigid rotation follows unbalanced torques as if a slow speed controller held it: below this frequency
# it gives no way, far above it is free.
CONTROL_HZ = 0.25
CONTROL_DAMPING = math.sqrt(0.5)


SIDE_TABLES = ("forcings", "feet", "oscillators")


class SideContribution(Protocol):
    """A contribution that acts along directions of its own."""

    @property
    def table(self) -> str:
        """One of SIDE_TABLES."""
        ...

    @property
    def directions(self) -> tuple[Vector, ...]:
        """Where it acts."""
        ...

    def numbers(self) -> tuple[float, ...]:
        """Its row behind severity and directions."""
        ...


@dataclass(frozen=True, slots=True)
class SideRow:
    """A contribution with the ramp of its severity; `key` stays the same while the severity changes."""

    key: tuple[int, int]
    contribution: Any
    severity: tuple[float, float, float, float]


class Side(NamedTuple):
    """What the loop needs; N = modes of both parts (real and imaginary), I = interfaces of both parts."""

    active: int  # 1 if there is anything at all
    swings: int  # 1 if the rigid rotation may have left its course
    step: Array  # (directions, N) what a newton at the new instant adds to the mode coordinates
    rows: Array  # (directions, N) displacement
    rate_rows: Array  # (directions, N)
    site_known: Array  # (directions, site rows) acceleration per newton that was known before the step
    site_full: Array  # (directions, site rows) the same for one that came within the step
    motions: Array  # (directions, 2 I) displacements and rates of the interfaces per newton
    back: Array  # (directions, I) displacement per newton of an interface
    back_rate: Array  # (directions, I)
    own: Array  # (directions, directions) displacement per newton
    own_rate: Array  # (directions, directions)
    rigid: Array  # (directions,) torque on the rigid rotation per newton
    structure_rows: Array  # (directions, nc) displacement per mode of a carrying structure
    structure_motions: Array  # (directions, ni) motion of the structure at its interfaces per newton
    structure_rates: Array  # (directions, ni) rate per newton at the structure's interfaces
    structure_known: Array  # (2, directions) displacement and rate by known forces within a step
    forcings: Array
    feet: Array
    oscillators: Array
    poles: Array  # (oscillators, POLE_SIZE)
    drift_pole: Array  # (POLE_SIZE,) of the rigid rotation
    state: Array  # (feet + oscillators, STATE_SIZE), written by the loop
    drift: Array  # (8,) of the rigid rotation, written by the loop
    base: Array  # (N,) known modal forces without those from here, written by the loop
    now: Array  # (4, directions) work space: forces, known forces, displacements, rates


@dataclass(frozen=True, eq=False)
class SidePart:
    """One independent part of the machine as the loop has it."""

    names: tuple[str, ...]
    propagator: Propagator | None
    interfaces: int  # as the loop counts them, filled up
    site_index: NDArray[np.int64]  # output row of each of its sites
    sites: Array  # (sites, n) combinations of its degrees of freedom


@dataclass(frozen=True, eq=False)
class Directions:
    """Everything that depends on the directions only; see `Side`."""

    step: Array
    rows: Array
    rate_rows: Array
    site_known: Array
    site_full: Array
    motions: Array
    back: Array
    back_rate: Array
    own: Array
    own_rate: Array
    rigid: Array
    structure_rows: Array
    structure_motions: Array
    structure_rates: Array
    structure_known: Array


@dataclass(frozen=True, eq=False)
class SideStructure:
    """The structure that carries the machine, as the loop has it; empty on the ground."""

    dofs: tuple[str, ...]
    of: Oscillators  # with the sites that are put out
    site_index: NDArray[np.int64]
    weights: Weights

    def coordinates(self, state: Array) -> NDArray[np.complex128]:
        """z of its modes in the loop's state between two steps, (modes,).

        The force before the last two is not kept; going straight on from these it is wrong by its second
        difference, and weighs little.
        """
        count, w = len(self.dofs), self.weights
        size = padded(count)
        if not count:
            return np.zeros(0, dtype=np.complex128)
        ahead = state[:count] + 1j * state[size : size + count]
        now, before = state[2 * size : 2 * size + count], state[3 * size : 3 * size + count]
        past = w.before * before + w.earlier * (2 * before - now)
        return np.asarray(ahead / w.decay + w.now * now + past)


def no_structure() -> SideStructure:
    """That of a machine on the ground."""
    none, rows = np.zeros(0), np.zeros((0, 0))
    of = Oscillators(none, none, rows, rows, none)
    return SideStructure((), of, np.zeros(0, dtype=np.int64), oscillator_weights(none, none, 1.0))


def work_out(
    system: LinearSystem,
    rigid: Array,
    parts: Sequence[SidePart],
    structure: SideStructure,
    directions: Sequence[Vector],
    site_rows: int,
) -> Directions:
    """The arrays of `directions` in a machine with these parts, and the structure that carries it."""
    count, inside = len(directions), len(system.dof_names)
    names = {name: i for i, name in enumerate((*system.dof_names, *structure.dofs))}
    vectors = np.zeros((count, len(names)))
    for row, direction in zip(vectors, directions, strict=True):
        for name, value in direction.items():
            row[names[name]] += value
    sizes = [2 * (part.propagator.modes if part.propagator is not None else 0) for part in parts]
    interfaces = sum(part.interfaces for part in parts)
    modal = {name: np.zeros((count, sum(sizes))) for name in ("step", "rows", "rate_rows")}
    known, full = np.zeros((2, count, site_rows))
    motions, back, back_rate = np.zeros((count, 2 * interfaces)), *np.zeros((2, count, interfaces))
    own, own_rate = np.zeros((2, count, count))
    first, mode = 0, 0
    for part, size in zip(parts, sizes, strict=True):
        if part.propagator is not None:
            mine = vectors[:, [system.dof(name) for name in part.names]]
            found = _part_response(system.part(part.names), part, mine)
            span = slice(mode, mode + size)
            for name, array in modal.items():
                array[:, span] = found[name]
            known[:, part.site_index] += found["site_known"]
            full[:, part.site_index] += found["site_full"]
            here = first + np.arange(found["back"].shape[1])
            motions[:, here], motions[:, interfaces + here] = found["motion"], found["motion_rate"]
            back[:, here], back_rate[:, here] = found["back"], found["back_rate"]
            own += found["own"]
            own_rate += found["own_rate"]
        first, mode = first + part.interfaces, mode + size
    carried = _structure_response(structure, vectors[:, inside:])
    for array in (known, full):
        array[:, structure.site_index] += carried["sites"]
    own += carried["own"]
    own_rate += carried["own_rate"]
    return Directions(
        **modal,
        site_known=known,
        site_full=full,
        motions=motions,
        back=back,
        back_rate=back_rate,
        own=own,
        own_rate=own_rate,
        rigid=vectors[:, :inside] @ rigid,
        **{f"structure_{name}": carried[name] for name in ("rows", "motions", "rates", "known")},
    )


def _structure_response(structure: SideStructure, vectors: Array) -> dict[str, Array]:
    """The same of the structure: what newtons along `vectors` (directions, modes) do, and what moves them."""
    of, rate, first = structure.of, structure.weights.rate, structure.weights.first
    place, speed = vectors * first.imag, vectors * (rate * first).imag
    push = vectors * ((rate**2 * first).imag + 1.0)
    rows = np.zeros((len(vectors), padded(vectors.shape[1])))
    rows[:, : vectors.shape[1]] = vectors
    return {
        "rows": rows,
        "motions": place @ of.shapes.T,
        "rates": speed @ of.shapes.T,
        "known": np.array([place @ of.known, speed @ of.known]),
        "sites": push @ of.sites.T,
        "own": place @ vectors.T,
        "own_rate": speed @ vectors.T,
    }


def _part_response(system: LinearSystem, part: SidePart, vectors: Array) -> dict[str, Array]:
    """What newtons along `vectors` (directions, n) do within a part, and what its interfaces do to them."""
    propagator = part.propagator
    assert propagator is not None
    linear, modes = propagator.linear, propagator.modes
    first_weight = cubic_weights(linear.eigenvalues, propagator.step_s)[0]
    step = first_weight[:, None] * (linear.left @ vectors.T)  # (m, directions)
    rows, rates = vectors @ linear.shapes, vectors @ linear.shapes_rate
    by_interfaces = first_weight[:, None] * (linear.left @ system.interfaces)
    known = part.sites @ linear.compliance @ vectors.T
    within = (part.sites @ linear.acceleration @ step).real
    return {
        "step": _flat(step.T, modes),
        "rows": propagator.output_rows(rows),
        "rate_rows": propagator.output_rows(rates),
        "site_known": known.T,
        "site_full": (known + within).T,
        "motion": (system.interfaces.T @ linear.shapes @ step).real.T,
        "motion_rate": (system.interfaces.T @ linear.shapes_rate @ step).real.T,
        "back": (rows @ by_interfaces).real,
        "back_rate": (rates @ by_interfaces).real,
        "own": (rows @ step).real,
        "own_rate": (rates @ step).real,
    }


def _flat(matrix: NDArray[np.complex128], modes: int) -> Array:
    result = np.zeros((matrix.shape[0], 2 * modes))
    result[:, : matrix.shape[1]] = matrix.real
    result[:, modes : modes + matrix.shape[1]] = matrix.imag
    return result


def pole_numbers(omega: float, damping_ratio: float, step_s: float) -> Array:
    """Decay and weights of xi' = lambda xi + p over a step, with lambda the upper pole; (POLE_SIZE,).

    z'' + 2 zeta w z' + w^2 z = p has z = Im(xi) / w_d and z' = Im(lambda xi) / w_d.
    """
    rate = pole(omega, damping_ratio)
    weights = cubic_weights(np.array([rate]), step_s)[:, 0]
    numbers = [np.exp(rate * step_s), *weights]
    return np.array([part for one in numbers for part in (one.real, one.imag)])


def pole(omega: float, damping_ratio: float) -> complex:
    """The pole with positive imaginary part."""
    return complex(-damping_ratio * omega, omega * math.sqrt(1 - damping_ratio**2))


def drift_pole(step_s: float) -> Array:
    """That of the rigid rotation under a slow speed controller."""
    return pole_numbers(2 * math.pi * CONTROL_HZ, CONTROL_DAMPING, step_s)


def drift_response(omega: float) -> complex:
    """Angle of the rigid rotation per unit of torque / inertia that oscillates at `omega`."""
    own = 2 * math.pi * CONTROL_HZ
    return 1 / complex(own**2 - omega**2, 2 * CONTROL_DAMPING * own * omega)
