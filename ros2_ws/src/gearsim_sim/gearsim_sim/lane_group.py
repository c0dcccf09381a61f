"""LANES machines that are integrated together: the variants of an ensemble come in such groups."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.decimate import HALF_LENGTH_SAMPLES, decimation_taps
from gearsim_sim.integrate.lane_pieces import OUTPUTS, decimate_lanes, phase_taps, spread
from gearsim_sim.integrate.vectors import LANES
from gearsim_sim.lane_pack import aligned, blocks_of, pack_part, pack_system
from gearsim_sim.lane_tables import make_work, pack_drive, pack_elements
from gearsim_sim.model.lane_data import LaneDrive, LaneMemory
from gearsim_sim.model.lane_loop import MOTION_ROWS, make_lane_loop, spread_motion
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.plant_data import bearing_memory
from gearsim_sim.schedule import REBASE_STEPS, Schedule
from gearsim_sim.stepper import Stepper
from gearsim_sim.timeline import Timeline

Array = NDArray[np.float64]
# Per call of the loop: few enough to stay in the cache until they are filtered.
BLOCK_SAMPLES = 256


@dataclass(eq=False)
class Lane:
    """A variant: what the single engine has, but for the loop."""

    plant: Plant
    timeline: Timeline
    schedule: Schedule
    stepper: Stepper

    def arrive(self, step: int) -> bool:
        """Do what is due at this step; whether the drive has changed."""
        schedule, timeline = self.schedule, self.timeline
        due = step in (schedule.change_step, timeline.next_step) or step % REBASE_STEPS == 0
        schedule.go_on(step)
        timeline.apply(schedule, step)
        if step % REBASE_STEPS == 0:
            schedule.rebase(step)
        return due

    def next_stop(self, step: int) -> int:
        """The next step at which something is due."""
        stops = [(step // REBASE_STEPS + 1) * REBASE_STEPS]
        stops += [stop for stop in (self.timeline.next_step, self.schedule.change_step) if stop is not None]
        return min(stops)


class GroupMotion(NamedTuple):
    """State of a group at output samples."""

    turns: NDArray[np.int64]  # (variants, shafts, n) whole ones
    values: Array  # (variants, 2 shafts + signals, n) fractions of turns, speeds, signals

    @classmethod
    def empty(cls, lanes: int, shafts: int, values: int, samples: int) -> GroupMotion:
        """Room for so many samples."""
        return cls(np.empty((lanes, shafts, samples), dtype=np.int64), np.empty((lanes, values, samples)))

    def part(self, start: int, end: int) -> GroupMotion:
        """The columns from start to end."""
        return GroupMotion(self.turns[..., start:end], self.values[..., start:end])


class LaneGroup:
    """Integrates up to LANES variants.

    Parameters
    ----------
    lanes : sequence of Lane
        At most LANES; the last one is repeated to fill up.
    oversampling : int
        Steps per sample.
    rates : bool
        Whether the rates of the interfaces are worked out.
    """

    def __init__(self, lanes: Sequence[Lane], oversampling: int, *, rates: bool) -> None:
        self.lanes = tuple(lanes)
        self._filled = [*lanes, *([lanes[-1]] * (LANES - len(lanes)))]
        self._steps = oversampling
        self._step = lanes[0].stepper.step
        steppers = [lane.stepper for lane in self._filled]
        setups = [one.parts for one in steppers]
        rests = [lane.stepper.rest() for lane in lanes]
        rests += [rests[-1]] * (LANES - len(lanes))
        blocks = [max(blocks_of(own[p]) for own in setups) for p in range(len(setups[0]))]
        parts = [
            [pack_part(setup, rest, blocks[p], rates=rates) for p, setup in enumerate(own)]
            for rest, own in zip(rests, setups, strict=True)
        ]
        self._system, self._state = pack_system(parts, setups[0])
        self._elements = pack_elements([one.data for one in steppers], lanes[0].plant)
        self._inputs = len(lanes[0].plant.system.input_names)
        encoders = lanes[0].plant.encoders.values()
        self._tracks = np.array([track for track, _ in encoders], dtype=np.int64)
        given = np.concatenate([setup.state_rows for setup in setups[0]])
        self._rows = MOTION_ROWS + np.argsort(given)
        self._drive: LaneDrive | None = None
        bearings = steppers[0].data.bearings
        self._memory = LaneMemory.of([bearing_memory(bearings) for _ in range(LANES)])
        self._loop = make_lane_loop(bearings.cosines.shape[1])
        self._taps, self._ranges = phase_taps(decimation_taps(oversampling), oversampling)
        self._width = (BLOCK_SAMPLES + 2 * HALF_LENGTH_SAMPLES + OUTPUTS) * oversampling
        self._accel = aligned(np.zeros((steppers[0].row_count * self._width, LANES)))
        self._filtered = aligned(np.zeros((steppers[0].row_count * BLOCK_SAMPLES, LANES)))
        self._base = 0  # step of column 0 of the accelerations
        self._stop = self._step  # where something is due next
        self._first = True  # nothing has been put out
        self._room = self._empty(0)
        self._known = 0  # columns of it that are filled

    @property
    def step(self) -> int:
        """Step that has been reached."""
        return self._step

    def look_again(self) -> None:
        """To be called when something has been scheduled."""
        self._stop = self._step

    def settle(self) -> None:
        """Run up to the step before the one where the filter of sample 0 begins."""
        last = -HALF_LENGTH_SAMPLES * self._steps - 1
        while self._step < last:
            self._base, self._known = self._step + 1, 0
            self._room = self._empty(BLOCK_SAMPLES + 1)
            self._integrate(min(last, self._step + BLOCK_SAMPLES * self._steps))
        self._base, self._known = last + 1, 0

    def advance(self, accel: Array) -> GroupMotion:
        """Fill accel (variants of the group, site rows, n) with the next n samples; returns their motion."""
        rows, n = accel.shape[1:]
        room = self._empty(n + 2 * HALF_LENGTH_SAMPLES)
        for new, old in zip(room, self._room, strict=True):
            new[..., : self._known] = old[..., : self._known]
        self._room = room
        done = 0
        while done < n:
            count = min(n - done, BLOCK_SAMPLES)
            self._integrate(self._base + (count - 1 + 2 * HALF_LENGTH_SAMPLES) * self._steps)
            width = -(-count // OUTPUTS) * OUTPUTS
            decimate_lanes(self._accel, self._width, self._taps, self._ranges, self._filtered, width)
            spread(self._filtered, width, count, accel, done)
            self._shift(count * self._steps, rows)
            done += count
        # The state is half of the filter's length ahead of the accelerations, and has been so from the start.
        skip = HALF_LENGTH_SAMPLES if self._first else 0
        self._first = False
        self._room = room.part(skip + n, self._known)
        self._known -= skip + n
        return room.part(skip, skip + n)

    def _empty(self, samples: int) -> GroupMotion:
        shafts = self._tracks.size
        return GroupMotion.empty(len(self.lanes), shafts, self._rows.size, samples)

    def _shift(self, columns: int, rows: int) -> None:
        """Move what the filter still needs to the front."""
        used = self._step + 1 - self._base
        buffer = self._accel.reshape(rows, self._width, LANES)
        buffer[:, : used - columns] = buffer[:, columns:used].copy()
        self._base += columns

    def _integrate(self, to_step: int) -> None:
        """Advance to a step, stopping where something changes in any lane."""
        while self._step < to_step:
            if self._step >= self._stop:
                due = [lane.arrive(self._step) for lane in self.lanes]
                if self._drive is None or any(due):
                    self._change_drive()
                self._stop = min(lane.next_stop(self._step) for lane in self.lanes)
            assert self._drive is not None  # the first step is a stop
            self._run(min(to_step, self._stop) - self._step, self._drive)

    def _change_drive(self) -> None:
        drives = [lane.schedule.drive() for lane in self._filled]
        self._drive = pack_drive(drives, self._elements, self._memory, len(self.lanes))
        interfaces = self._state.forces.shape[0] // 3
        self._work = make_work(self._elements, self._drive, self._inputs, interfaces)
        whole = np.array([lane.schedule.anchor_turns[self._tracks] for lane in self.lanes]).T.copy()
        self._angles = (self._drive.anchor_phases[self._tracks], self._drive.rates[self._tracks], whole)

    def _run(self, count: int, drive: LaneDrive) -> None:
        out = np.empty(((count // self._steps + 1) * (MOTION_ROWS + self._rows.size), LANES))
        column = self._step + 1 - self._base
        used = self._loop(
            self._system, self._state, self._elements, drive, self._memory, self._work,
            self._step, count, self._accel, self._width, column, out,
        )  # fmt: skip
        self._step += count
        self._known = spread_motion(out[:used], *self._angles, self._rows, *self._room, self._known)
