"""Owns what forces beside the machine's own elements remember, and packs them for the compiled loop."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.kernel import add_history
from gearsim_sim.model.assembly import Vector
from gearsim_sim.model.known_loop import ANGLE, SPEED
from gearsim_sim.model.loop_data import SEVERITY_COLUMNS
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.rotating_force import TIME_TRACK, RotatingForce, faded
from gearsim_sim.model.side_data import (
    CONTROL_DAMPING,
    CONTROL_HZ,
    POLE_SIZE,
    SIDE_TABLES,
    STATE_SIZE,
    Directions,
    Side,
    SidePart,
    SideRow,
    SideStructure,
    drift_pole,
    drift_response,
    pole,
    pole_numbers,
    work_out,
)
from gearsim_sim.model.side_oscillator import SideOscillator

Array = NDArray[np.float64]
_WIDTHS = {
    "forcings": SEVERITY_COLUMNS + 9,
    "feet": SEVERITY_COLUMNS + 7,
    "oscillators": SEVERITY_COLUMNS + 5,
}
_TORQUE = 1e-9  # of a direction's greatest share: less is no torque on the rigid rotation


class SideState:
    """Packs the rows of a schedule; what a force remembers stays with its key.

    Parameters
    ----------
    plant : Plant
        Without the structure that carries it.
    parts : sequence of SidePart
        Those of the loop, in its order.
    structure : SideStructure
    site_rows : int
        Rows of acceleration.
    step_s : float
    """

    def __init__(
        self,
        plant: Plant,
        parts: Sequence[SidePart],
        structure: SideStructure,
        site_rows: int,
        step_s: float,
    ) -> None:
        self._plant = plant
        self._parts = tuple(parts)
        self._structure = structure
        self._site_rows = site_rows
        self._step_s = step_s
        self._rows: tuple[SideRow, ...] | None = None
        self._places: dict[tuple[tuple[str, float], ...], int] = {}
        self._directions: list[Vector] = []
        self._found: Directions | None = None
        self._drift = np.zeros(8)
        self._drift_pole = drift_pole(step_s)
        self._sizes = [2 * part.propagator.modes if part.propagator is not None else 0 for part in parts]
        # Mode coordinates of all parts and of the structure when rows changed last.
        self._z = np.zeros(sum(self._sizes))
        self._structure_z = np.zeros(len(structure.dofs), dtype=np.complex128)
        self._kept: dict[tuple[int, int], Array] = {}
        # Once something turns the rigid rotation out of its course, it goes on swinging for a while.
        self._swings = False
        self._side = self._pack(())

    @property
    def side(self) -> Side:
        """As packed last."""
        return self._side

    def update(self, rows: tuple[SideRow, ...], states: Sequence[Array], *, fluctuates: bool) -> Side:
        """What the loop needs for these rows; `states` are those of the parts and of the structure now."""
        if fluctuates and not self._swings:
            self._swings, self._rows = True, None
        if rows != self._rows:
            self._z = np.concatenate([state[:n2] for state, n2 in zip(states, self._sizes, strict=False)])
            self._structure_z = self._structure.coordinates(states[-1])
            self._side = self._pack(rows)
            self._start_new(rows)
            self._rows = rows
        return self._side

    def _direction(self, vector: Vector) -> int:
        key = tuple(sorted(vector.items()))
        if key not in self._places:
            self._places[key] = len(self._directions)
            self._directions.append(vector)
            self._found = None
        return self._places[key]

    def _pack(self, rows: tuple[SideRow, ...]) -> Side:
        tables: dict[str, list[list[float]]] = {name: [] for name in SIDE_TABLES}
        keys: dict[str, list[tuple[int, int]]] = {name: [] for name in SIDE_TABLES}
        poles = []
        for row in rows:
            one = row.contribution
            places: list[float] = [self._direction(vector) for vector in one.directions]
            if isinstance(one, SideOscillator):
                places += [-1.0] * (2 - len(places))
                poles.append(pole_numbers(one.omega, one.damping_ratio, self._step_s))
            tables[one.table].append([*row.severity, *places, *one.numbers()])
            keys[one.table].append(row.key)
        found = self._work_out()
        packed = {
            name: np.array(table, dtype=np.float64).reshape(len(table), _WIDTHS[name])
            for name, table in tables.items()
        }
        self._swings = self._swings or self._turned_by(packed["forcings"], found)
        state = self._remembered([*keys["feet"], *keys["oscillators"]])
        return Side(
            active=int(bool(rows) or self._swings),
            swings=int(self._swings),
            **{name: getattr(found, name) for name in Directions.__dataclass_fields__},
            **packed,
            poles=np.array(poles, dtype=np.float64).reshape(len(poles), POLE_SIZE),
            drift_pole=self._drift_pole,
            state=state,
            drift=self._drift,
            base=np.zeros(sum(self._sizes)),
            now=np.zeros((4, len(self._directions))),
        )

    def _work_out(self) -> Directions:
        if self._found is None:
            plant = self._plant
            self._found = work_out(
                plant.system, plant.rigid, self._parts, self._structure, self._directions, self._site_rows
            )
        return self._found

    def _turned_by(self, forcings: Array, found: Directions) -> bool:
        places = forcings[:, SEVERITY_COLUMNS].astype(np.int64)
        return bool(np.any(np.abs(found.rigid[places]) > _TORQUE))

    def _remembered(self, keys: list[tuple[int, int]]) -> Array:
        """States of feet and oscillators by their keys; the old array is given up for the new one."""
        if self._rows is not None:
            for row, values in zip(_with_memory(self._rows), self._side.state, strict=True):
                self._kept[row.key] = values.copy()
        self._kept = {key: values for key, values in self._kept.items() if key in keys}
        state = np.zeros((len(keys), STATE_SIZE))
        for i, key in enumerate(keys):
            state[i] = self._kept.get(key, 0.0)
        return state

    def _start_new(self, rows: tuple[SideRow, ...]) -> None:
        """An oscillator that is new moves as its places do in the mean."""
        for row, state in zip(_with_memory(rows), self._side.state, strict=True):
            one = row.contribution
            if row.key in self._kept or not isinstance(one, SideOscillator):
                continue
            motion = np.array([self._motion(self._direction(vector)) for vector in one.directions])
            place, rate = np.mean(motion, axis=0).tolist()
            drive = one.omega**2 * place + 2 * one.damping_ratio * one.omega * rate
            xi = _oscillating(place, rate, pole(one.omega, one.damping_ratio))
            state[:5] = xi.real, xi.imag, drive, drive, drive

    def _motion(self, direction: int) -> tuple[float, float]:
        """Displacement and rate of a direction now."""
        side, count = self._side, self._structure_z.size
        place, rate = side.rows[direction] @ self._z, side.rate_rows[direction] @ self._z
        row = side.structure_rows[direction, :count]
        place += row @ self._structure_z.imag
        rate += row @ (self._structure.weights.rate * self._structure_z).imag
        return float(place), float(rate)

    def start(
        self,
        rows: tuple[SideRow, ...],
        states: Sequence[Array],
        phases: Array,
        step: int,
        speed_hz: float,
    ) -> None:
        """Begin a run: all forces have been as they are now, torques have acted at this speed for long."""
        side = self.update(rows, states, fluctuates=False)
        now = np.zeros(len(self._directions))
        for row in (row for row in rows if isinstance(row.contribution, RotatingForce)):
            force = row.severity[0] * self._known(row.contribution, phases, step, speed_hz)
            now[self._direction(row.contribution.direction)] += force
        for row, state in zip(_with_memory(rows), side.state, strict=True):
            if isinstance(row.contribution, SideOscillator):
                now += self._hanging(row, state)
        place = 0
        # What hangs on a structure at rest hangs still: it has no force yet that could have acted for long.
        for part, n2, state in zip(self._parts, self._sizes, states, strict=False):
            if part.propagator is not None:
                add_history(part.propagator, state, now @ side.step[:, place : place + n2])
            place += n2
        self._start_drift(rows, phases, step, speed_hz)

    def _hanging(self, row: SideRow, state: Array) -> Array:
        """Forces of an oscillator that has just been hung up, by direction; they enter its memory too."""
        one: SideOscillator = row.contribution
        places = [self._direction(vector) for vector in one.directions]
        motion = np.array([self._motion(place) for place in places])
        forces = one.forces(
            float(np.mean(motion[:, 0])), float(np.mean(motion[:, 1])), motion, row.severity[0]
        )
        result = np.zeros(len(self._directions))
        for i, (place, force) in enumerate(zip(places, forces.tolist(), strict=True)):
            state[5 + 3 * i : 8 + 3 * i] = force
            result[place] += force
        return result

    def _known(self, one: RotatingForce, phases: Array, step: int, speed_hz: float) -> float:
        if one.track == TIME_TRACK:
            return one.force(step * self._step_s, speed_hz)
        return one.force(float(phases[one.track]), speed_hz, rate=abs(float(self._plant.rates[one.track])))

    def _start_drift(self, rows: tuple[SideRow, ...], phases: Array, step: int, speed_hz: float) -> None:
        angle = rate = 0.0
        drives = np.zeros(3)
        for row in rows:
            one = row.contribution
            if not isinstance(one, RotatingForce):
                continue
            gain = float(self._plant.rigid @ self._plant.system.direction(one.direction))
            gain *= row.severity[0] / self._plant.inertia_kg_m2
            frequency = one.order * (
                speed_hz * self._plant.rates[one.track] if one.track != TIME_TRACK else 1.0
            )
            turns = one.order * (phases[one.track] if one.track != TIME_TRACK else step * self._step_s)
            amplitude = gain * complex(one.cosine, -one.sine) * faded(abs(frequency), one.corner_hz)
            omega = 2 * math.pi * frequency
            ahead = np.exp(2j * math.pi * (turns - frequency * self._step_s * np.arange(3)))
            response = drift_response(omega)
            angle += (amplitude * response * ahead[0]).real
            rate += (1j * omega * amplitude * response * ahead[0]).real
            drives += (amplitude * ahead).real
        xi = _oscillating(angle, rate, pole(2 * math.pi * CONTROL_HZ, CONTROL_DAMPING))
        self._drift[:5] = xi.real, xi.imag, *drives
        self._drift[SPEED] = rate / (2 * math.pi)
        self._drift[ANGLE] = (angle + self._step_s * rate) / (2 * math.pi)


def _with_memory(rows: tuple[SideRow, ...]) -> list[SideRow]:
    """Rows that remember something, in the order of `Side.state`."""
    return [row for name in ("feet", "oscillators") for row in rows if row.contribution.table == name]


def _oscillating(place: float, rate: float, own: complex) -> complex:
    """The xi with z = Im(xi) / w_d and z' = Im(lambda xi) / w_d."""
    return complex(rate - own.real * place, own.imag * place)
