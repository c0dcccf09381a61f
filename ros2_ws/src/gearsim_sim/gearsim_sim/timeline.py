"""Events waiting for their step, checked when they are asked for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from gearsim_io.errors import InputError
from gearsim_sim.events import Clear, Event, FaultSpec, Inject, SetOperatingPoint
from gearsim_sim.model.faults import Fault, fault_kind
from gearsim_sim.model.plant import Plant
from gearsim_sim.schedule import Schedule

# No ramp is shorter: a jump of geometry or torque would be a click that no rig can make.
MIN_RAMP_S = 0.01
MAX_RAMP_S = 86400.0
_PEAK_SLOPE = 1.875  # greatest slope of the ramp's polynomial over its mean slope


@dataclass(frozen=True, slots=True)
class _FaultChange:
    """A line in the log of faults: a fault that begins, or the end of `name` ("" for all)."""

    step: int
    name: str
    fault: Fault | None


class Timeline:
    """Accepts events for given samples and applies them to a schedule when their step has come.

    Parameters
    ----------
    plant : Plant
        For limits and geometry.
    seed : int
        Of the run.
    sample_rate_hz : float
        Rate of the samples.
    steps_per_sample : int
        Integration steps per sample.
    """

    def __init__(self, plant: Plant, seed: int, sample_rate_hz: float, steps_per_sample: int) -> None:
        self._plant = plant
        self._seed = seed
        self._rate_hz = sample_rate_hz
        self._steps = steps_per_sample
        self._queue: list[tuple[int, Callable[[Schedule, int], None]]] = []
        self._log: list[_FaultChange] = []

    @property
    def next_step(self) -> int | None:
        """Step of the next event, if any."""
        return self._queue[0][0] if self._queue else None

    def apply(self, schedule: Schedule, step: int) -> None:
        """Apply the events of this step."""
        while self._queue and self._queue[0][0] == step:
            self._queue.pop(0)[1](schedule, step)

    def initial_fault(self, spec: FaultSpec, first_step: int) -> Fault:
        """A fault that is there from the start; each needs a name of its own."""
        if any(change.name == spec.name for change in self._log):
            expected = "a fault_id of its own, since another fault has that name"
            raise InputError(f"fault {spec.name}", "fault_id", spec.name, expected)
        fault = self._build(spec)
        self._note(_FaultChange(first_step, spec.name, fault))
        return fault

    def add(self, event: Event, earliest: int) -> int:
        """Check and queue an event; returns its sample, the `earliest` one if none was given."""
        sample = earliest if event.at_sample is None else event.at_sample
        if sample < earliest:
            raise InputError("event", "at_sample", sample, f"{earliest} or later; what was before is history")
        if not (math.isfinite(event.ramp_s) and 0 <= event.ramp_s <= MAX_RAMP_S):
            raise InputError("event", "ramp_s", event.ramp_s, f"0 to {MAX_RAMP_S:g} s")
        step = sample * self._steps
        match event:
            case SetOperatingPoint():
                action = self._operating_point(event)
            case Inject():
                action = self._inject(event, step)
            case Clear():
                action = self._clear(event, step)
        place = sum(1 for other, _ in self._queue if other <= step)
        self._queue.insert(place, (step, action))
        return sample

    def _ramp_steps(self, ramp_s: float) -> int:
        samples = max(1, round(max(ramp_s, MIN_RAMP_S) * self._rate_hz))
        return samples * self._steps

    def _operating_point(self, event: SetOperatingPoint) -> Callable[[Schedule, int], None]:
        speed = None if event.speed_hz is None else self.checked_speed(event.speed_hz)
        load = None if event.load_nm is None else self.checked_load(event.load_nm)

        def action(schedule: Schedule, step: int) -> None:
            shortest = (
                0.0 if speed is None else self._shortest_ramp_s(speed - schedule.segment.speed_hz(step))
            )
            schedule.set_operating_point(step, speed, load, self._ramp_steps(max(event.ramp_s, shortest)))

        return action

    def _shortest_ramp_s(self, speed_change_hz: float) -> float:
        """What the drive's torque needs for a change of speed."""
        torque = self._plant.limits.acceleration_torque_nm
        return _PEAK_SLOPE * 2 * math.pi * abs(speed_change_hz) * self._plant.inertia_kg_m2 / torque

    def checked_speed(self, speed_hz: float) -> float:
        """A speed within the limits of the drive."""
        limit = self._plant.limits.speed_limit_hz
        if not 0 <= speed_hz <= limit:
            raise InputError("operating point", "speed_hz", speed_hz, f"0 to {limit:g} Hz")
        return float(speed_hz)

    def checked_load(self, load_nm: float) -> float:
        """A load within the limits of the drive."""
        limit = self._plant.limits.load_limit_nm
        if not 0 <= load_nm <= limit:
            raise InputError("operating point", "load_nm", load_nm, f"0 to {limit:g} N m")
        return float(load_nm)

    def _build(self, spec: FaultSpec) -> Fault:
        return fault_kind(spec.kind).build(spec, self._plant, self._seed)

    def _inject(self, event: Inject, step: int) -> Callable[[Schedule, int], None]:
        name = event.fault.name
        fault = self._build(event.fault)
        running = self._faults_at(step).get(name)
        if running is not None and not running.same_but_severity(fault):
            expected = "another name, or the same parameters with another severity, or to clear it before"
            raise InputError(f"fault {name}", "fault_id", name, expected)
        self._note(_FaultChange(step, name, fault))
        ramp_steps = self._ramp_steps(event.ramp_s)
        return lambda schedule, now: schedule.grow(now, name, fault, ramp_steps)

    def _clear(self, event: Clear, step: int) -> Callable[[Schedule, int], None]:
        running = self._faults_at(step)
        if event.fault_id and event.fault_id not in running:
            known = ", ".join(running) or "there is none"
            raise InputError("clear", "fault_id", event.fault_id, f"a running fault ({known})")
        self._note(_FaultChange(step, event.fault_id, None))
        ramp_steps = self._ramp_steps(event.ramp_s)

        def action(schedule: Schedule, now: int) -> None:
            for name in [event.fault_id] if event.fault_id else list(schedule.faults):
                schedule.fade(now, name, ramp_steps)

        return action

    def _note(self, change: _FaultChange) -> None:
        self._log.append(change)
        self._log.sort(key=lambda entry: entry.step)  # stable: equal steps keep the order of asking

    def _faults_at(self, step: int) -> dict[str, Fault]:
        """Faults that will run at this step by what has been asked for so far."""
        running: dict[str, Fault] = {}
        for change in self._log:
            if change.step > step:
                break
            if change.fault is not None:
                running[change.name] = change.fault
            elif change.name:
                running.pop(change.name, None)
            else:
                running.clear()
        return running
