"""A running model whose accelerometers may also look through frequency responses of the casing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.engine import Engine, EngineOutput
from gearsim_sim.events import Event, FaultSpec
from gearsim_sim.frf.bank import ResonatorBank
from gearsim_sim.frf.responses import CasingResponses
from gearsim_sim.frf.sites import through_responses

Array = NDArray[np.float64]


class ResponseModel:
    """An engine in a casing, with sites `frf:NAME` beside its own.

    The bank begins where the run does, at rest under the forces' mean while the run settles, and has settled
    with it at sample 0. The engine runs ahead by what the bank comes later, so all outputs share one axis of
    time.

    Parameters
    ----------
    engine : Engine
        With `forces` and `settling`, and at its first sample.
    responses : CasingResponses
    sites : sequence of str
        Places of the responses that are looked at.

    Raises
    ------
    InputError
        If the responses lack a site, or a seat on which the machine stands.
    """

    def __init__(self, engine: Engine, responses: CasingResponses, sites: Sequence[str]) -> None:
        self._engine = engine
        sites = tuple(dict.fromkeys(sites))  # two channels may look at one place
        self._names = tuple(through_responses(name) for name in sites)
        settling = engine.advance(-engine.next_sample)
        self._forces = tuple(settling.forces)
        self._bank = ResonatorBank(responses.of_sites(sites).of_inputs(self._forces), engine.sample_rate_hz)
        pushes = self._pushes(settling)
        self._bank.start(pushes.mean(axis=1))
        self._bank.push(pushes)
        self._ahead = engine.advance(self._bank.delay)
        self._bank.push(self._pushes(self._ahead))
        self._next = 0

    @property
    def error(self) -> float:
        """Largest deviation from the responses within the band, over their largest value there."""
        return self._bank.error

    @property
    def next_sample(self) -> int:
        """Index of the first sample that the next `advance` returns."""
        return self._next

    @property
    def earliest_event_sample(self) -> int:
        """Earliest sample at which an event may start now."""
        return self._engine.earliest_event_sample

    @property
    def steady(self) -> bool:
        """Whether speed and load change by events only."""
        return self._engine.steady

    def operating_point_at(self, sample: int) -> tuple[float, float]:
        """Speed [Hz] and load [N m] at a sample that has been handed out."""
        return self._engine.operating_point_at(sample)

    def warm_up(self, *, events: bool = False) -> None:
        """Compile what is needed, with `events` what only events bring, too."""
        self._engine.warm_up(events=events)

    def advance(self, n: int, events: Sequence[Event] = ()) -> EngineOutput:
        """The next `n` samples; as of the engine, and as independent of how they are portioned."""
        newest = self._engine.advance(n, events)
        through = self._bank.push(self._pushes(newest))
        both = _joined(self._ahead, newest)
        self._ahead = _stretch(both, n, None)
        self._next += n
        own = _stretch(both, 0, n)
        accel = np.vstack([own.accel, through])
        return replace(own, site_names=(*own.site_names, *self._names), accel=accel)

    def set_operating_point(
        self,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        ramp_s: float = 1.0,
        at_sample: int | None = None,
    ) -> int:
        """Schedule another operating point; returns its sample."""
        return self._engine.set_operating_point(speed_hz, load_nm, ramp_s, at_sample)

    def inject(self, fault: FaultSpec, ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule a fault; returns its sample."""
        return self._engine.inject(fault, ramp_s, at_sample)

    def clear(self, fault_id: str = "", ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule the end of a fault; returns its sample."""
        return self._engine.clear(fault_id, ramp_s, at_sample)

    def _pushes(self, output: EngineOutput) -> Array:
        return np.array([output.forces[name] for name in self._forces])


def _joined(first: EngineOutput, second: EngineOutput) -> EngineOutput:
    def along(a: Array, b: Array) -> Array:
        return np.concatenate([a, b], axis=-1)

    def each(a: Mapping[str, Array], b: Mapping[str, Array]) -> dict[str, Array]:
        return {name: along(a[name], b[name]) for name in a}

    return replace(
        first,
        accel=along(first.accel, second.accel),
        turns=np.concatenate([first.turns, second.turns], axis=1),
        fraction=along(first.fraction, second.fraction),
        speed_hz=along(first.speed_hz, second.speed_hz),
        signals=each(first.signals, second.signals),
        probes=each(first.probes, second.probes),
        forces=each(first.forces, second.forces),
    )


def _stretch(output: EngineOutput, begin: int, end: int | None) -> EngineOutput:
    """Samples `begin` to `end` of an output."""

    def each(arrays: Mapping[str, Array]) -> dict[str, Array]:
        return {name: array[begin:end] for name, array in arrays.items()}

    return replace(
        output,
        first_sample=output.first_sample + begin,
        accel=output.accel[:, begin:end],
        turns=output.turns[:, begin:end],
        fraction=output.fraction[:, begin:end],
        speed_hz=output.speed_hz[:, begin:end],
        signals=each(output.signals),
        probes=each(output.probes),
        forces=each(output.forces),
    )
