"""Operating point, angles and faults as functions of the step index: what the compiled loop is given.

Between events everything follows closed formulas of the integer step index, so that the output does not
depend on how it is asked for. Angles are kept as whole turns and a fraction at an anchor step, which is
renewed at fixed steps: the rounding error does not grow with the length of a run.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.pieces import plain_fading_slope, plain_ramp
from gearsim_sim.model.faults.spall import Spall
from gearsim_sim.model.lpm34 import BEARING_SHAFT, SENSE, Gearbox
from gearsim_sim.model.lpm34_loop import SPALL_COLUMNS, Drive

REBASE_STEPS = 1 << 16


@dataclass(frozen=True, slots=True)
class Ramp:
    """From one value to another, starting at a step, with a slope that fades."""

    start_value: float
    end_value: float
    start_slope: float = 0.0  # per step

    def value(self, since: float, steps: float) -> float:
        """The value `since` steps after the start of a ramp of `steps`."""
        rise, _, _ = plain_ramp(since, steps)
        fading, _, _ = plain_fading_slope(since, steps)
        return self.start_value + (self.end_value - self.start_value) * rise + self.start_slope * fading

    def slope(self, since: float, steps: float) -> float:
        """Its change per step."""
        _, rise, _ = plain_ramp(since, steps)
        _, fading, _ = plain_fading_slope(since, steps)
        return (self.end_value - self.start_value) * rise + self.start_slope * fading

    def integral(self, since: float, steps: float) -> float:
        """Its sum over the steps, as an integral."""
        _, _, rise = plain_ramp(since, steps)
        _, _, fading = plain_fading_slope(since, steps)
        change = (self.end_value - self.start_value) * rise + self.start_slope * fading
        return self.start_value * since + change


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """A spall with the ramp of its severity."""

    spall: Spall
    severity: Ramp
    start_step: int
    ramp_steps: float

    def severity_at(self, step: int) -> float:
        """Severity at a step."""
        return self.severity.value(float(step - self.start_step), self.ramp_steps)

    def gone(self, step: int) -> bool:
        """Whether it has faded away for good."""
        return self.severity.end_value == 0.0 and step >= self.start_step + self.ramp_steps


class Schedule:
    """Mutable: the present segment of the operating point, the anchor of the angles, the faults."""

    def __init__(
        self, gearbox: Gearbox, step_s: float, first_step: int, turns: float, speed_hz: float, load_nm: float
    ) -> None:
        """Start at `first_step` with the rigid rotation at `turns` turns of the input shaft."""
        ratios = [1.0, gearbox.speed_ratio]
        for i, bearing in enumerate(gearbox.bearings):
            shaft = BEARING_SHAFT[i]
            ratios.append(SENSE[shaft] * bearing.cage_ratio * ratios[shaft])
        self.rates: NDArray[np.float64] = np.array(ratios)
        self._faults_on = gearbox.params.physics.faults
        self.step_s = step_s
        self.speed = Ramp(speed_hz, speed_hz)
        self.load = Ramp(load_nm, load_nm)
        self.start_step = first_step
        self.ramp_steps = 0.0
        self.anchor_step = first_step
        whole = self.rates * turns
        self.anchor_turns: NDArray[np.int64] = np.floor(whole).astype(np.int64)
        self.anchor_phases: NDArray[np.float64] = whole - np.floor(whole)
        self.faults: dict[str, ActiveFault] = {}

    def speed_hz(self, step: int) -> float:
        """Commanded speed of the input shaft."""
        return self.speed.value(float(step - self.start_step), self.ramp_steps)

    def load_nm(self, step: int) -> float:
        """Commanded load torque."""
        return self.load.value(float(step - self.start_step), self.ramp_steps)

    def turns_since_anchor(self, step: int) -> float:
        """Turns of the input shaft from the anchor to a step."""
        now = self.speed.integral(float(step - self.start_step), self.ramp_steps)
        then = self.speed.integral(float(self.anchor_step - self.start_step), self.ramp_steps)
        return self.step_s * (now - then)

    def rebase(self, step: int) -> None:
        """Renew the anchor; forget a ramp that is over and faults that are gone."""
        angle = self.anchor_phases + self.rates * self.turns_since_anchor(step)
        whole = np.floor(angle)
        self.anchor_phases = angle - whole
        self.anchor_turns = self.anchor_turns + whole.astype(np.int64)
        if step >= self.start_step + self.ramp_steps:
            speed, load = self.speed.end_value, self.load.end_value
            self.speed, self.load = Ramp(speed, speed), Ramp(load, load)
            self.start_step, self.ramp_steps = step, 0.0
        self.anchor_step = step
        self.faults = {name: fault for name, fault in self.faults.items() if not fault.gone(step)}

    def set_operating_point(self, step: int, speed_hz: float, load_nm: float, ramp_steps: float) -> None:
        """Begin a ramp at this step, from the present speed, acceleration and load."""
        since = float(step - self.start_step)
        speed = Ramp(
            self.speed.value(since, self.ramp_steps), speed_hz, self.speed.slope(since, self.ramp_steps)
        )
        load = Ramp(self.load.value(since, self.ramp_steps), load_nm)
        self.rebase(step)
        self.speed, self.load, self.start_step, self.ramp_steps = speed, load, step, ramp_steps

    def grow(self, step: int, name: str, spall: Spall, ramp_steps: float) -> None:
        """Let a fault's severity go from what it is to that of `spall`.

        If a fault of that name but of another geometry is still fading, it goes on fading beside. The
        anchor stays: a fault of severity zero must not change a bit.
        """
        old = self.faults.get(name)
        if old is not None and replace(old.spall, severity=spall.severity) != spall:
            self.faults[f"{name} until {old.start_step + int(old.ramp_steps)}"] = self.faults.pop(name)
            old = None
        now = 0.0 if old is None else old.severity_at(step)
        self.faults[name] = ActiveFault(spall, Ramp(now, spall.severity), step, ramp_steps)

    def fade(self, step: int, name: str, ramp_steps: float) -> None:
        """Let a fault's severity go to zero."""
        if name in self.faults:
            self.grow(step, name, replace(self.faults[name].spall, severity=0.0), ramp_steps)

    def drive(self) -> Drive:
        """The present segment for the compiled loop."""
        rows = [self._spall_row(fault) for fault in self.faults.values() if self._faults_on]
        return Drive(
            speed=np.array([self.speed.start_value, self.speed.end_value, self.speed.start_slope]),
            load=np.array([self.load.start_value, self.load.end_value]),
            start_step=self.start_step,
            ramp_steps=self.ramp_steps,
            anchor_step=self.anchor_step,
            anchor_phases=self.anchor_phases,
            rates=self.rates,
            spalls=np.array(rows, dtype=np.float64).reshape(len(rows), len(SPALL_COLUMNS)),
        )

    @staticmethod
    def _spall_row(fault: ActiveFault) -> list[float]:
        spall = fault.spall
        sense = SENSE[BEARING_SHAFT[spall.bearing]] if spall.on_inner_race else 0.0
        return [
            spall.bearing,
            spall.row,
            sense,
            spall.position_rad / (2 * math.pi),
            spall.half_width_rad,
            spall.depth_m,
            spall.race_radius_m,
            spall.ball_radius_m,
            fault.severity.start_value,
            fault.severity.end_value,
            fault.start_step,
            fault.ramp_steps,
        ]
