"""What a model gives in place of a measured record, in the very form that measured records have.

A simulated record is read over the same kind of angle as the measured one: over its own tachos or encoders
where the measured angle is from such, else over the angle that the judge takes the measured record's shaft
to have. A model that runs at another speed than assumed then shows its lines where the measured record of
such a machine would.
"""

from __future__ import annotations

import copy
import json
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from gearsim_dsp.speed import Phase, ShaftSpeed, window_speed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from gearsim_io.record import PulseTrain, Record
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.case import Case
from gearsim_twin.load import stated_load_nm
from gearsim_twin.stated_speed import stated_speed_hz
from gearsim_twin.view import View
from gearsim_twin.workers import WorkerLostError, Workers, check_stop

__all__ = ["Simulator"]

T = TypeVar("T")
Content = Mapping[str, Any]

# Names the content in errors; a relative path in it starts at the present folder.
_SOURCE = Path("model")
_MOST_BYTES = 400_000_000


class Simulator:
    """Runs models under the conditions of a case's records.

    Parameters
    ----------
    case : Case
    workers : int
        Processes; 1 simulates in this one.
    measured : sequence of View, optional
        `case.views()`, where that is known already.

    Notes
    -----
    Use it in a `with` block, or `close` it: no process is left then, nor after an interruption. Views are
    kept, up to 400 MB of samples; the same content, length and seed is simulated once.
    """

    def __init__(self, case: Case, workers: int = 1, measured: Sequence[View] | None = None) -> None:
        if workers < 1:
            raise InputError("simulator", "workers", workers, "1 or more")
        self.case = case
        self.measured = case.views() if measured is None else tuple(measured)
        self._workers = workers
        self._pool: Workers | None = None
        self._kept: OrderedDict[str, View] = OrderedDict()

    def __enter__(self) -> Simulator:
        """Nothing runs before it is needed."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End all processes."""
        self.close()

    def close(self) -> None:
        """End all processes; what runs is given up."""
        if self._pool is not None:
            self._pool.close()
            self._pool = None

    def views(
        self, content_of: Mapping[int, Content], seconds: float | None = None, seed: int = 1
    ) -> list[View]:
        """What models give in place of records.

        Parameters
        ----------
        content_of : mapping of int to mapping
            Number of a record in `case.records`, and the content of the scenario that takes its place.
        seconds : float, optional
            Length; by default that of the record.
        seed : int
            Of all random numbers.

        Returns
        -------
        list of View
            In the order of the mapping.

        Raises
        ------
        InputError
            If the simulator refuses a content, naming its key.
        """
        tasks = [self._task(number, content, seconds, seed) for number, content in content_of.items()]
        found = {task.key: self._kept[task.key] for task in tasks if task.key in self._kept}
        missing = {task.key: task for task in tasks if task.key not in found}
        found.update(zip(missing, self._made(list(missing.values()), _itself), strict=True))
        for key, view in found.items():
            self._keep(key, view)
        return [found[task.key] for task in tasks]

    def derived(
        self,
        jobs: Sequence[tuple[int, Content]],
        then: Callable[[View], T],
        seconds: float | None = None,
        seed: int = 1,
    ) -> list[T]:
        """What `then` makes of the views, one for each (number of a record, content).

        With several workers it is called where the simulation ran, and must be picklable: a function of a
        module, or `functools.partial` of one. Parameters and errors as for `views`.
        """
        return self._made([self._task(number, content, seconds, seed) for number, content in jobs], then)

    def tried(
        self,
        jobs: Sequence[tuple[int, Content]],
        then: Callable[[View], T],
        seconds: float | None = None,
        seed: int = 1,
    ) -> list[T | None]:
        """As `derived`, with None in place of what the simulator refuses."""
        tasks = [self._task(number, content, seconds, seed) for number, content in jobs]
        return self._made(tasks, then, refused=True)

    def seeded(
        self,
        jobs: Sequence[tuple[int, Content, int]],
        then: Callable[[View], T],
        seconds: float | None = None,
    ) -> list[T]:
        """As `derived`, each job with a seed of its own."""
        tasks = [self._task(number, content, seconds, seed) for number, content, seed in jobs]
        return self._made(tasks, then)

    def prepare(self) -> None:
        """Let the processes load their libraries, while this one does something else."""
        if self._workers > 1 and self._pool is None:
            self._pool = Workers(self._workers)
            self._pool.wake()

    def _task(self, number: int, content: Content, seconds: float | None, seed: int) -> _Task:
        view = self.measured[number]
        length = view.record.seconds if seconds is None else seconds
        own = {**copy.deepcopy(dict(content)), "seed": seed}
        shafts = self.case.modelled.tacho_shafts
        shaft = view.machine.reference_shaft if view.machine.reference_shaft in shafts else shafts[0]
        stated_hz = stated_speed_hz(own, view.record.seconds)
        return _Task(own, length, view.machine, view.speed, shaft, stated_hz)

    def _made(self, tasks: Sequence[_Task], then: Callable[[View], T], refused: bool = False) -> list[Any]:
        """What is made of the views; with `refused` None where the simulator takes no such content."""
        if self._workers > 1 and len(tasks) > 1:
            try:
                self._pool = self._pool or Workers(self._workers)
                return self._pool.map(_tried if refused else _done, [(task, then) for task in tasks])
            except WorkerLostError:
                # A process was killed from outside; what it can do this one can, one after the other.
                self.close()
                self._workers = 1
            except BaseException:
                self.close()
                raise
        return [self._here(task, then, refused) for task in tasks]

    def _here(self, task: _Task, then: Callable[[View], T], refused: bool) -> T | None:
        try:
            return then(self._view(task))
        except InputError:
            if refused:
                return None
            raise

    def _view(self, task: _Task) -> View:
        view = self._kept[task.key] if task.key in self._kept else task.view()
        self._keep(task.key, view)
        return view

    def _keep(self, key: str, view: View) -> None:
        """Keep a view, and drop those that were not asked for the longest."""
        self._kept[key] = view
        self._kept.move_to_end(key)
        while len(self._kept) > 1 and sum(v.nbytes for v in self._kept.values()) > _MOST_BYTES:
            self._kept.popitem(last=False)


@dataclass(frozen=True, slots=True, eq=False)
class _Task:
    """A simulation, and what is taken as the speed of the measured record that it stands for.

    `stated_hz` is the model's own mean speed over the whole of that record, where its content tells one.
    """

    content: dict[str, Any]
    seconds: float
    machine: Machine
    measured: ShaftSpeed
    angle_shaft: str
    stated_hz: float | None

    @property
    def key(self) -> str:
        """What makes two simulations the same."""
        axis = (self.measured.value_hz, self.measured.source, self.measured.phase is not None)
        return json.dumps([self.content, self.seconds, axis, self.machine.name], sort_keys=True, default=str)

    def view(self) -> View:
        """The simulated record over the measured one's kind of angle."""
        own = self.measured.source in ("tacho", "encoder") and _has_angle_signals(self.content)
        content = self.content if own else _with_tacho(self.content, self.angle_shaft)
        scenario = parse_scenario(content, _SOURCE)
        record = replace(to_record(scenario, self.seconds, between=check_stop), machine=self.machine.name)
        speed = self._own_speed(record) if own else self._assumed_speed(record)
        if not own:
            record = replace(record, tachos=())
        load_nm = stated_load_nm(record, self.machine)
        return View(record, self.machine, speed, scenario.load_nm if load_nm is None else load_nm)

    def _own_speed(self, record: Record) -> ShaftSpeed:
        source = self.measured.source
        trains = record.tachos or tuple(
            PulseTrain(one.shaft, float(one.lines_per_revolution), one.samples) for one in record.encoders
        )
        return window_speed(trains, record.sample_count, record.sample_rate_hz, self.machine, source)

    def _assumed_speed(self, record: Record) -> ShaftSpeed:
        """The true angle, as far off as that of the measured record is if this model is right."""
        if self.measured.phase is None:
            return self.measured
        true = window_speed(record.tachos, record.sample_count, record.sample_rate_hz, self.machine)
        if true.phase is None:
            return self.measured
        # Means over the whole record: a part of a run-up or of a swing has another mean on both sides alike.
        scale = self.measured.value_hz / (self.stated_hz or true.value_hz)
        phase = Phase(true.phase.samples, true.phase.turns * scale)
        return replace(self.measured, phase=phase)


def _has_angle_signals(content: Content) -> bool:
    sensors = content.get("sensors", {})
    return any(sensors.get(kind, {}).get("shafts") for kind in ("tachos", "encoders"))


def _with_tacho(content: Content, shaft: str) -> dict[str, Any]:
    """With one clean pulse per turn of a shaft: angles found in vibration are as smooth."""
    changed = copy.deepcopy(dict(content))
    changed.setdefault("sensors", {})["tachos"] = {"shafts": [shaft], "pulses": 1}
    return changed


def _done(work: tuple[_Task, Callable[[View], T]]) -> T:
    """In a worker: simulate, and make of it what is wanted."""
    check_stop()
    task, then = work
    return then(task.view())


def _tried(work: tuple[_Task, Callable[[View], T]]) -> T | None:
    """The same, and None for what the simulator refuses."""
    try:
        return _done(work)
    except InputError:
        return None


def _itself(view: View) -> View:
    return view
