"""The engine: parameters and a seed in, accelerations and shaft angles out, in any portions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.events import Event, FaultSpec
from gearsim_sim.params import ParallelParams


@dataclass(frozen=True, slots=True, eq=False)
class EngineOutput:
    """`n` output samples; sample `first_sample + i` is at time (first_sample + i) / sample_rate_hz.

    Accelerations are filtered (linear phase, delay removed), angles and speeds are the state itself
    at that time: all on one time axis.
    """

    first_sample: int
    site_names: tuple[str, ...]
    accel: NDArray[np.float64]  # (sites, n) [m/s^2]
    shaft_names: tuple[str, ...]
    turns: NDArray[np.int64]  # (shafts, n) whole turns since sample 0
    fraction: NDArray[np.float64]  # (shafts, n) rest of the angle in turns, [0, 1)
    speed_hz: NDArray[np.float64]  # (shafts, n) d(angle)/dt in turns per second
    probes: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)  # name -> (n,)

    @property
    def sample_count(self) -> int:
        """Samples per site."""
        return int(self.accel.shape[1])


class Engine:
    """Integrates the parallel-shaft gearbox; owns all dynamic state.

    Parameters
    ----------
    params : ParallelParams
        From `gearsim_sim.params.load_parallel_params`.
    seed : int
        Of the gears' pitch and surface errors.
    sample_rate_hz : float
        Rate of the output samples.
    oversampling : int
        Integration steps per output sample, 2 to 16.
    faults : sequence of FaultSpec
        Present at full severity from the start.
    speed_hz, load_nm : float, optional
        Operating point at the start (default: that of the parameters).
    sites : mapping, optional
        Name of each site and its linear combination of degrees of freedom
        (`{"b3_y": {"y_p3": 1.0}}`); default: the eight pedestal sites b1_x, b1_y ... b4_y.
    probes : sequence of str
        Further outputs, see `Engine.probe_names`.
    """

    def __init__(
        self,
        params: ParallelParams,
        seed: int,
        sample_rate_hz: float,
        oversampling: int = 4,
        faults: Sequence[FaultSpec] = (),
        *,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        sites: Mapping[str, Mapping[str, float]] | None = None,
        probes: Sequence[str] = (),
    ) -> None: ...

    @property
    def next_sample(self) -> int:
        """Index of the first sample that the next `advance` returns."""
        raise NotImplementedError

    @property
    def earliest_event_sample(self) -> int:
        """Earliest `at_sample` that an event may have now.

        The linear-phase filter looks `lookahead_samples` ahead of what it returns, so the state of
        the samples before this one is history.
        """
        raise NotImplementedError

    @property
    def lookahead_samples(self) -> int:
        """How far the state runs ahead of the returned samples (about 25 at 4x)."""
        raise NotImplementedError

    def advance(self, n: int, events: Sequence[Event] = ()) -> EngineOutput:
        """The next `n` samples; `events` are scheduled first. The split into calls changes no bit."""
        raise NotImplementedError

    def set_operating_point(
        self,
        speed_hz: float | None = None,
        load_nm: float | None = None,
        ramp_s: float = 1.0,
        at_sample: int | None = None,
    ) -> int:
        """Schedule a change; returns the sample at which the ramp starts (None: the earliest possible)."""
        raise NotImplementedError

    def inject(self, fault: FaultSpec, ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule a fault; returns the sample at which it starts to grow."""
        raise NotImplementedError

    def clear(self, fault_id: str = "", ramp_s: float = 0.1, at_sample: int | None = None) -> int:
        """Schedule the end of a fault (all if empty); returns the sample at which it starts to shrink."""
        raise NotImplementedError

    def warm_up(self) -> None:
        """Compile everything (done by the constructor too)."""
        raise NotImplementedError
