"""Operating point, angles and faults as functions of the step index: what the compiled loop is given.

Between events everything follows closed formulas of the integer step index, so that the output does not
depend on how it is asked for. Angles are kept as whole turns and a fraction at an anchor step, which is
renewed at fixed steps: the rounding error does not grow with the length of a run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.pieces import DEGREE, plain_polynomial, plain_ramp
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults import Fault
from gearsim_sim.model.loop_data import COLUMNS, NEED_RATES, SEVERITY_COLUMNS, Drive
from gearsim_sim.model.plant import Plant

Array = NDArray[np.float64]
REBASE_STEPS = 1 << 16


@dataclass(frozen=True, eq=False)
class Segment:
    """A stretch in which angle and load are polynomials of u = (step - start_step) / length_steps."""

    start_step: int
    length_steps: float
    turns: Array  # coefficients, ascending, of the reference shaft's turns since start_step
    load: Array  # coefficients, ascending [N m]
    step_s: float
    end_speed_hz: float  # what the segment leads to
    end_load_nm: float
    end_step: int | None  # None: it holds for good

    def _u(self, step: int) -> float:
        return float(step - self.start_step) / self.length_steps

    def turns_at(self, step: int) -> float:
        """Turns since the start."""
        return plain_polynomial(self._u(step), self.turns)[0]

    def speed_hz(self, step: int) -> float:
        """Speed of the reference shaft."""
        return plain_polynomial(self._u(step), self.turns)[1] / (self.length_steps * self.step_s)

    def acceleration_hz_per_s(self, step: int) -> float:
        """Its change."""
        return plain_polynomial(self._u(step), self.turns)[2] / (self.length_steps * self.step_s) ** 2

    def load_nm(self, step: int) -> float:
        """Load torque."""
        return plain_polynomial(self._u(step), self.load)[0]


def steady(step: int, step_s: float, speed_hz: float, load_nm: float) -> Segment:
    """Constant speed and load from a step on."""
    return Segment(
        step, 1.0, _filled([0.0, speed_hz * step_s]), _filled([load_nm]), step_s, speed_hz, load_nm, None
    )


def ramp(now: Segment, step: int, speed_hz: float, load_nm: float, steps: int) -> Segment:
    """From the speed, acceleration and load that `now` has at `step` to others, without a jump of torque.

    The speed follows 10 u^3 - 15 u^4 + 6 u^5, and u - 6 u^3 + 8 u^4 - 3 u^5 where it was changing already.
    """
    seconds = steps * now.step_s
    start, load = now.speed_hz(step), now.load_nm(step)
    change, fading = speed_hz - start, now.acceleration_hz_per_s(step) * seconds
    rise = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0])
    speed = change * rise + fading * np.array([0.0, 1.0, 0.0, -6.0, 8.0, -3.0])
    speed[0] = start
    turns = np.concatenate([[0.0], speed / np.arange(1, 7)]) * seconds
    torque = (load_nm - load) * rise
    torque[0] = load
    end = step + steps
    return Segment(step, float(steps), _filled(turns), _filled(torque), now.step_s, speed_hz, load_nm, end)


def _filled(coefficients: Sequence[float] | Array) -> Array:
    result = np.zeros(DEGREE + 1)
    result[: len(coefficients)] = coefficients
    return result


@dataclass(frozen=True, slots=True)
class Severity:
    """From one severity to another, smoothly, starting at a step."""

    start_value: float
    end_value: float
    start_step: int
    steps: float

    def value(self, step: int) -> float:
        """The severity at a step."""
        rise, _, _ = plain_ramp(float(step - self.start_step), self.steps)
        return self.start_value + (self.end_value - self.start_value) * rise

    def gone(self, step: int) -> bool:
        """Whether it has faded away for good."""
        return self.end_value == 0.0 and step >= self.start_step + self.steps


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """A fault with the course of its severity."""

    fault: Fault
    severity: Severity


class Schedule:
    """Mutable: the present segment of the operating point, the anchor of the angles, the faults."""

    def __init__(
        self, plant: Plant, step_s: float, first_step: int, turns: float, speed_hz: float, load_nm: float
    ) -> None:
        """Start at `first_step` with the reference shaft at `turns` turns."""
        self._rates = plant.rates
        self._faults_on = plant.faults_on
        self.step_s = step_s
        self.segment = steady(first_step, step_s, speed_hz, load_nm)
        self.anchor_step = first_step
        whole = plant.phases(turns)
        self.anchor_turns: NDArray[np.int64] = np.floor(whole).astype(np.int64)
        self.anchor_phases: Array = whole - np.floor(whole)
        self.reference_turns = turns
        self.faults: dict[str, ActiveFault] = {}

    @property
    def change_step(self) -> int | None:
        """Step at which the present segment ends, if it does."""
        return self.segment.end_step

    def turns_since_anchor(self, step: int) -> float:
        """Turns of the reference shaft from the anchor to a step."""
        return self.segment.turns_at(step) - self.segment.turns_at(self.anchor_step)

    def turns(self, step: int) -> float:
        """Turns of the reference shaft; loses digits in long runs, for display and statics only."""
        return self.reference_turns + self.turns_since_anchor(step)

    def rebase(self, step: int) -> None:
        """Renew the anchor; forget faults that are gone."""
        passed = self.turns_since_anchor(step)
        angle = self.anchor_phases + self._rates * passed
        whole = np.floor(angle)
        self.anchor_phases = angle - whole
        self.anchor_turns = self.anchor_turns + whole.astype(np.int64)
        self.reference_turns += passed
        self.anchor_step = step
        if self.segment.end_step is None:
            self.segment = steady(step, self.step_s, self.segment.end_speed_hz, self.segment.end_load_nm)
        self.faults = {name: one for name, one in self.faults.items() if not one.severity.gone(step)}

    def go_on(self, step: int) -> None:
        """Leave a segment that ends at this step."""
        if self.segment.end_step == step:
            self.rebase(step)
            self.segment = steady(step, self.step_s, self.segment.end_speed_hz, self.segment.end_load_nm)

    def set_operating_point(self, step: int, speed_hz: float, load_nm: float, ramp_steps: int) -> None:
        """Begin a ramp at this step, from the present speed, acceleration and load."""
        following = ramp(self.segment, step, speed_hz, load_nm, ramp_steps)
        self.rebase(step)
        self.segment = following

    def grow(self, step: int, name: str, fault: Fault, ramp_steps: float) -> None:
        """Let a fault's severity go from what it is to that of `fault`.

        If a fault of that name but of another geometry is still fading, it goes on fading beside. The
        anchor stays: a fault of severity zero must not change a bit.
        """
        old = self.faults.get(name)
        if old is not None and not old.fault.same_but_severity(fault):
            end = old.severity.start_step + int(old.severity.steps)
            self.faults[f"{name} until {end}"] = self.faults.pop(name)
            old = None
        now = 0.0 if old is None else old.severity.value(step)
        self.faults[name] = ActiveFault(fault, Severity(now, fault.severity, step, ramp_steps))

    def fade(self, step: int, name: str, ramp_steps: float) -> None:
        """Let a fault's severity go to zero."""
        if name in self.faults:
            self.grow(step, name, replace(self.faults[name].fault, severity=0.0), ramp_steps)

    def contributions(self, step: int) -> tuple[tuple[Contribution, float], ...]:
        """What the faults contribute at a step, with severities, as the readable model takes it."""
        return tuple(
            (one, active.severity.value(step))
            for active in self.faults.values()
            for one in active.fault.contributions
        )

    def drive(self) -> Drive:
        """The present segment for the compiled loop."""
        segment = self.segment
        tables, samples = fault_tables(list(self.faults.values()) if self._faults_on else [])
        return Drive(
            turns=segment.turns,
            load=segment.load,
            start_step=segment.start_step,
            length_steps=segment.length_steps,
            steady=int(segment.end_step is None),
            anchor_step=self.anchor_step,
            anchor_phases=self.anchor_phases,
            rates=self._rates,
            need_rates=int(any(np.any(tables[name][:, :2]) for name in NEED_RATES)),
            samples=samples,
            **tables,
        )


def fault_tables(faults: Sequence[ActiveFault]) -> tuple[dict[str, Array], Array]:
    """The tables of rows of `Drive`, and the samples that they refer to."""
    rows: dict[str, list[list[float]]] = {table: [] for table in COLUMNS}
    samples: list[Array] = []
    at = 0
    for active in faults:
        severity = active.severity
        ramped = [severity.start_value, severity.end_value, severity.start_step, severity.steps]
        for one in active.fault.contributions:
            row = [*ramped, *one.numbers()]
            table = one.samples()
            if table is not None:
                row += [at, table.size // 2 - 1]
                samples.append(table)
                at += table.size
            rows[one.table].append(row)
    tables = {
        name: np.array(found, dtype=np.float64).reshape(len(found), SEVERITY_COLUMNS + len(COLUMNS[name]))
        for name, found in rows.items()
    }
    return tables, np.concatenate(samples) if samples else np.zeros(0)
