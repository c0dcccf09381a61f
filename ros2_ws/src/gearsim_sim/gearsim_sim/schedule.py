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

from gearsim_sim.integrate.pieces import plain_ramp
from gearsim_sim.model.contributions import Contribution
from gearsim_sim.model.faults import Fault
from gearsim_sim.model.loop_data import COLUMNS, NEED_RATES, SEVERITY_COLUMNS, Drive
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.side_data import SIDE_TABLES, SideRow
from gearsim_sim.profile.profile import Profile

Array = NDArray[np.float64]
REBASE_STEPS = 1 << 16


@dataclass(frozen=True, slots=True)
class Severity:
    """From one severity to another, smoothly, starting at a step."""

    start_value: float
    end_value: float
    start_step: int
    steps: float

    def value(self, step: float) -> float:
        """The severity at a step."""
        rise, _, _ = plain_ramp(float(step - self.start_step), self.steps)
        return self.start_value + (self.end_value - self.start_value) * rise

    @property
    def acts(self) -> bool:
        """Whether it is not zero throughout."""
        return self.start_value != 0.0 or self.end_value != 0.0

    def row(self) -> tuple[float, float, float, float]:
        """The first columns of a row of a table."""
        return (self.start_value, self.end_value, float(self.start_step), self.steps)

    def gone(self, step: int) -> bool:
        """Whether it has faded away for good."""
        return self.end_value == 0.0 and step >= self.start_step + self.steps


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """A fault with the course of its severity."""

    fault: Fault
    severity: Severity
    serial: int = 0  # stays with it while its severity changes, and when it is renamed


class Schedule:
    """Mutable: the profile and its present segment, the anchor of the angles, the faults."""

    def __init__(
        self,
        plant: Plant,
        profile: Profile,
        first_step: int,
        turns: float,
        forces: Sequence[Contribution] = (),
    ) -> None:
        """Start at `first_step` with the reference shaft at `turns` turns.

        `forces` act from the start on, beside those of faults.
        """
        self._rates = plant.rates
        self._faults_on = plant.faults_on
        self._forces = tuple(forces)
        self.step_s = profile.step_s
        self.profiles = [(first_step, profile)]  # each from its step on
        self.segment = profile.segment(first_step)
        self.anchor_step = first_step
        whole = plant.phases(turns)
        self.anchor_turns: NDArray[np.int64] = np.floor(whole).astype(np.int64)
        self.anchor_phases: Array = whole - np.floor(whole)
        self.reference_turns = turns
        self.faults: dict[str, ActiveFault] = {}
        self._serial = 0

    @property
    def profile(self) -> Profile:
        """The present one."""
        return self.profiles[-1][1]

    @property
    def change_step(self) -> int:
        """Step at which the present segment ends."""
        return self.segment.end_step

    def operating_point(self, step: int) -> tuple[float, float]:
        """Speed [Hz] and load [N m] at a step of the past or the present."""
        profile = next((one for start, one in reversed(self.profiles) if start <= step), self.profiles[0][1])
        return profile.speed_at(step), profile.load_at(step)

    def turns_since_anchor(self, step: float) -> float:
        """Turns of the reference shaft from the anchor to a step."""
        return self.segment.turns_at(step) - self.segment.turns_at(self.anchor_step)

    def turns(self, step: float) -> float:
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
        if step >= self.segment.end_step:
            self.segment = self.profile.segment(step)
        self.faults = {name: one for name, one in self.faults.items() if not one.severity.gone(step)}

    def go_on(self, step: int) -> None:
        """Leave a segment that ends at this step."""
        if self.segment.end_step == step:
            self.rebase(step)

    def set_operating_point(
        self, step: int, speed_hz: float | None, load_nm: float | None, ramp_steps: int
    ) -> None:
        """Begin a ramp at this step from what is found there; None lets speed or load go on as it does."""
        following = self.profile.changed(step, speed_hz, load_nm, float(ramp_steps))
        self.rebase(step)
        self.profiles.append((step, following))
        self.segment = following.segment(step)

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
        serial = self.new_serial() if old is None else old.serial
        self.faults[name] = ActiveFault(fault, Severity(now, fault.severity, step, ramp_steps), serial)

    def new_serial(self) -> int:
        """A number that no other fault of this run has."""
        self._serial += 1
        return self._serial

    def fade(self, step: int, name: str, ramp_steps: float) -> None:
        """Let a fault's severity go to zero."""
        if name in self.faults:
            self.grow(step, name, replace(self.faults[name].fault, severity=0.0), ramp_steps)

    def contributions(self, step: float) -> tuple[tuple[Contribution, float], ...]:
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
            fluctuation=segment.fluctuation,
            start_step=segment.start_step,
            length_steps=segment.length_steps,
            steady=int(segment.steady),
            anchor_step=self.anchor_step,
            anchor_phases=self.anchor_phases,
            rates=self._rates,
            need_rates=int(any(np.any(tables[name][:, :2]) for name in NEED_RATES)),
            samples=samples,
            **tables,
        )

    def side_rows(self) -> tuple[SideRow, ...]:
        """Forces beside the machine's own elements: those of the run, and those of faults."""
        rows = [SideRow((0, i), one, (1.0, 1.0, 0.0, 0.0)) for i, one in enumerate(self._forces)]
        for active in self.faults.values() if self._faults_on else ():
            ramp = active.severity.row()
            for i, one in enumerate(active.fault.contributions):
                if one.table in SIDE_TABLES and active.severity.acts:
                    rows.append(SideRow((active.serial, i), one, ramp))
        return tuple(rows)


def fault_tables(faults: Sequence[ActiveFault]) -> tuple[dict[str, Array], Array]:
    """The tables of rows of `Drive`, and the samples that they refer to."""
    rows: dict[str, list[list[float]]] = {table: [] for table in COLUMNS}
    samples: list[Array] = []
    at = 0
    for active in faults:
        if not active.severity.acts:
            continue
        for one in active.fault.contributions:
            if one.table in SIDE_TABLES:
                continue
            row = [*active.severity.row(), *one.numbers()]
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
