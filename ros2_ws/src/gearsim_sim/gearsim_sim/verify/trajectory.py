"""A run of the compiled loop that keeps every degree of freedom at every step."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.faults import Fault
from gearsim_sim.model.plant import Moment, Plant, StateRow
from gearsim_sim.profile.profile import constant_profile
from gearsim_sim.schedule import Schedule
from gearsim_sim.stepper import Stepper

Array = NDArray[np.float64]
_BLOCK_STEPS = 4096


@dataclass(frozen=True)
class Course:
    """What a run does: from static equilibrium it runs in, then comes the stretch that is looked at.

    Attributes
    ----------
    seconds : float
        Length of the stretch; it begins at step 0.
    speed_hz, load_nm : float
        Until then.
    turns : float
        Angle of the reference shaft at step 0.
    end_speed_hz, end_load_nm : float, optional
        What a ramp over the whole stretch leads to.
    growth_s : float
        Faults grow from zero within this time.
    begin_s : float
        When they begin; 0 is step 0, and all that is allowed later.
    lead_s : float
        Time to run in. The loop starts with a history of forces that stand still; a few steps later
        that is forgotten.
    """

    seconds: float
    speed_hz: float
    load_nm: float
    turns: float = 0.5
    end_speed_hz: float | None = None
    end_load_nm: float | None = None
    growth_s: float = 0.0
    begin_s: float = 0.0
    lead_s: float = 0.003

    def schedule(self, plant: Plant, step_s: float) -> Schedule:
        """From the static start on."""
        lead = -round(self.lead_s / step_s)
        turns = self.turns + self.speed_hz * lead * step_s
        return Schedule(plant, constant_profile(plant, step_s, self.speed_hz, self.load_nm), lead, turns)

    def begin_faults(self, schedule: Schedule, faults: Sequence[Fault]) -> None:
        """Let them grow from the step on where they begin."""
        step = round(self.begin_s / schedule.step_s)
        for number, fault in enumerate(faults):
            schedule.grow(step, f"{number} {fault.name}", fault, self.growth_s / schedule.step_s)

    def begin_ramp(self, schedule: Schedule) -> None:
        """Begin the ramp, if there is one, at step 0."""
        if self.end_speed_hz is not None or self.end_load_nm is not None:
            steps = round(self.seconds / schedule.step_s)
            schedule.set_operating_point(0, self.end_speed_hz, self.end_load_nm, steps + 1)


@dataclass(frozen=True, eq=False)
class Trajectory:
    """States at the steps 0 to N, accelerations at 1 to N; displacements without the rigid rotation."""

    plant: Plant
    schedule: Schedule
    step_s: float
    x: Array  # (dofs, N + 1) [m, rad]
    v: Array  # (dofs, N + 1)
    accel: Array  # (sites, N) [m/s^2]
    films: Array  # (bearings, balls) oil films at step 0, in thicknesses under 1 N

    @property
    def count(self) -> int:
        """N."""
        return int(self.accel.shape[1])

    def moment(self, step: float) -> Moment:
        """Angle, speed and faults at a step, which need not be whole."""
        schedule = self.schedule
        return Moment(schedule.turns(step), schedule.segment.speed_hz(step), schedule.contributions(step))

    def acceleration_hz_per_s(self, step: float) -> float:
        """Change of the reference shaft's speed at a step."""
        return self.schedule.segment.acceleration_hz_per_s(step)

    def inputs(self, step: float) -> Array:
        """Known inputs at a step."""
        segment = self.schedule.segment
        return self.plant.known_inputs(segment.load_nm(step), segment.acceleration_hz_per_s(step))


def run(plant: Plant, course: Course, step_rate_hz: float, faults: Sequence[Fault] = ()) -> Trajectory:
    """Integrate a course with the compiled loop.

    Parameters
    ----------
    plant : Plant
    course : Course
    step_rate_hz : float
        Steps of integration per second.
    faults : sequence of Fault
        As `FaultKind.build` gives them.
    """
    schedule = course.schedule(plant, 1 / step_rate_hz)
    stepper = Stepper(_watched(plant), schedule, plant.sites, 1)
    before = _run_in(stepper, schedule, course, faults)
    films = stepper.films.copy()
    states, accel = _advance(stepper, round(course.seconds * step_rate_hz))
    states = np.hstack([before, states])
    size = len(plant.system.dof_names)
    return Trajectory(
        plant=plant,
        schedule=schedule,
        step_s=1 / step_rate_hz,
        x=states[:size],
        v=states[size:],
        accel=accel[stepper.site_rows],
        films=films,
    )


def site_accelerations(
    plant: Plant, course: Course, step_rate_hz: float, faults: Sequence[Fault] = ()
) -> Array:
    """Accelerations alone, (sites, N): for long courses."""
    schedule = course.schedule(plant, 1 / step_rate_hz)
    stepper = Stepper(plant, schedule, plant.sites, _BLOCK_STEPS)
    _run_in(stepper, schedule, course, faults)
    _, accel = _advance(stepper, round(course.seconds * step_rate_hz))
    return accel[stepper.site_rows]


def _run_in(stepper: Stepper, schedule: Schedule, course: Course, faults: Sequence[Fault]) -> Array:
    """Up to step 0, where a ramp begins; faults begin there or before. Returns the signals there, (n, 1)."""
    signals, _ = _advance(stepper, round((course.begin_s + course.lead_s) / schedule.step_s))
    course.begin_faults(schedule, faults)
    if stepper.step < 0:
        signals, _ = _advance(stepper, -stepper.step)
    course.begin_ramp(schedule)
    return signals[:, -1:]


def _watched(plant: Plant) -> Plant:
    """The plant with all displacements, then all rates as its signals."""
    names = plant.system.dof_names
    places = {f"{name}": StateRow({name: 1.0}) for name in names}
    rates = {f"{name}'": StateRow({}, {name: 1.0}) for name in names}
    return dataclasses.replace(plant, signals=places | rates)


def _advance(stepper: Stepper, count: int) -> tuple[Array, Array]:
    """Signals and rows of acceleration of the next `count` steps."""
    accel = np.zeros((stepper.row_count, count))
    signals = []
    for at in range(0, count, _BLOCK_STEPS):
        steps = min(_BLOCK_STEPS, count - at)
        signals.append(stepper.advance(steps, accel, at).signals)
    return np.hstack(signals), accel
