"""What was asked of a run and from which sample on it holds."""

from __future__ import annotations

import math
from bisect import insort
from collections.abc import Callable, Iterable
from dataclasses import replace

from gearsim_sim.events import Clear, Event, Inject, SetOperatingPoint
from gearsim_sim.scenario import Scenario
from gearsim_sim.timeline import MIN_RAMP_S
from gearsim_sim.truth import FaultTruth, GroundTruth, fault_parameters, version


class History:
    """The events of a run by sample, and what they make true at any sample.

    Parameters
    ----------
    scenario : Scenario
        Its operating point and faults hold from sample 0; its events must be added one by one.
    course : callable, optional
        Speed [Hz] and load [N m] at a sample, where they change without events; what holds is then told
        anew every second.
    """

    def __init__(
        self, scenario: Scenario, course: Callable[[int], tuple[float, float]] | None = None
    ) -> None:
        self._scenario = scenario
        self._course = course
        self._events: list[Event] = []

    @property
    def events(self) -> tuple[Event, ...]:
        """All events, by sample."""
        return tuple(self._events)

    def add(self, event: Event, sample: int) -> None:
        """An event that takes effect at `sample`."""
        insort(self._events, replace(event, at_sample=sample), key=_sample)

    def changes(self, after: int, upto: int) -> list[int]:
        """Samples at which something changes, after < sample <= upto, ascending, each once."""
        found = set()
        for event in self._events:
            start = _sample(event)
            found.add(start + self._samples(event.ramp_s) if isinstance(event, Clear) else start)
        if self._course is not None:
            rate = self._scenario.sample_rate_hz
            found |= {round(k * rate) for k in range(math.floor(after / rate), math.ceil(upto / rate) + 1)}
        return sorted(sample for sample in found if after < sample <= upto)

    def truth(self, sample: int, t0_ns: int) -> GroundTruth:
        """What holds at `sample`; `t0_ns` is the time of sample 0."""
        scenario = self._scenario
        speed_hz, load_nm = scenario.speed_hz, scenario.load_nm
        running = {fault.name: _fault(Inject(fault, 0.0, 0)) for fault in scenario.faults}
        ends: dict[str, int] = {}
        for event in (event for event in self._events if _sample(event) <= sample):
            if isinstance(event, SetOperatingPoint):
                speed_hz = speed_hz if event.speed_hz is None else event.speed_hz
                load_nm = load_nm if event.load_nm is None else event.load_nm
                continue
            start = _sample(event)
            _drop_ended(running, ends, start)
            if isinstance(event, Inject):
                ends.pop(event.fault.name, None)
                since = running.get(event.fault.name)
                fault = _fault(event)
                running[event.fault.name] = (
                    fault if since is None else replace(fault, since_sample=since.since_sample)
                )
            else:
                for name in [event.fault_id] if event.fault_id else list(running):
                    ends.setdefault(name, start + self._samples(event.ramp_s))
        _drop_ended(running, ends, sample)
        changes = self.changes(0, sample)
        holds_from = changes[-1] if changes else 0
        if self._course is not None:
            speed_hz, load_nm = self._course(holds_from)
        return GroundTruth(
            t0_ns=t0_ns + round(holds_from * 1e9 / scenario.sample_rate_hz),
            sample=holds_from,
            scenario=scenario.name,
            seed=scenario.seed,
            speed_hz=speed_hz,
            load_nm=load_nm,
            faults=tuple(running.values()),
            version=version(),
            frame_id=scenario.machine.name,
            events=self.events,
        )

    def _samples(self, ramp_s: float) -> int:
        return max(1, round(max(ramp_s, MIN_RAMP_S) * self._scenario.sample_rate_hz))


def _sample(event: Event) -> int:
    return event.at_sample or 0


def _fault(event: Inject) -> FaultTruth:
    fault = event.fault
    return FaultTruth(fault.name, fault.kind, fault.component, fault_parameters(fault), _sample(event))


def _drop_ended(running: dict[str, FaultTruth], ends: dict[str, int], sample: int) -> None:
    for name in [name for name, end in ends.items() if end <= sample]:
        running.pop(name, None)
        del ends[name]


def fault_names(faults: Iterable[FaultTruth]) -> str:
    """Names for a line of text, or "none"."""
    return ", ".join(fault.fault_id for fault in faults) or "none"
