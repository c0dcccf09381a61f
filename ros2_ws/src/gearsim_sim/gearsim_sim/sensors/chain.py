"""The measuring chain of all sensors of one kind: from the motion at their sites to the numbers of a batch.

A stage is a class with `active` and `apply(block, first_sample)`, one file each; `STAGES` is the order in
which the signal passes them. A new effect is a file and a line here, with its numbers in `rows`. The
analogue stages work at the sensors' rate, which may be a multiple of the sample rate (see `sampling`); the
last ones, behind the sampling, at the sample rate.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.sensors.adc import Converter
from gearsim_sim.sensors.delay import Delay
from gearsim_sim.sensors.direction import Directions
from gearsim_sim.sensors.drift import ZeroDrift
from gearsim_sim.sensors.dropouts import LostSignal
from gearsim_sim.sensors.gain import Sensitivity
from gearsim_sim.sensors.highpass import AcCoupling
from gearsim_sim.sensors.interference import Interference
from gearsim_sim.sensors.mounting import MountingResonance
from gearsim_sim.sensors.noise import Noise
from gearsim_sim.sensors.overload import OverloadRecovery
from gearsim_sim.sensors.rolloff import Rolloff
from gearsim_sim.sensors.rows import Row
from gearsim_sim.sensors.sampling import Decimator, Sampling


class Stage(Protocol):
    """One effect of the chain on all channels; it keeps its own state from block to block."""

    @property
    def active(self) -> bool:
        """False if no channel has the effect, so that it can be left out."""
        ...

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Change `block` (channels, samples) in place; `first_sample` is the stream index of its start.

        Samples are counted at the rate at which the stage works.
        """
        ...


Builder = Callable[[Sequence[Row], float, int], Stage]

STAGES: tuple[tuple[str, Builder], ...] = (
    ("mounting", lambda rows, rate_hz, seed: MountingResonance(rows, rate_hz)),  # noqa: ARG005
    ("overload", lambda rows, rate_hz, seed: OverloadRecovery(rows, rate_hz)),  # noqa: ARG005
    ("sensitivity", lambda rows, rate_hz, seed: Sensitivity(rows, rate_hz, seed)),
    ("high_pass", lambda rows, rate_hz, seed: AcCoupling(rows, rate_hz)),  # noqa: ARG005
    ("rolloff", lambda rows, rate_hz, seed: Rolloff(rows, rate_hz)),  # noqa: ARG005
    ("noise", lambda rows, rate_hz, seed: Noise(rows, rate_hz, seed)),
    ("drift", lambda rows, rate_hz, seed: ZeroDrift(rows, rate_hz, seed)),
    ("interference", lambda rows, rate_hz, seed: Interference(rows, rate_hz, seed)),
    ("dropouts", lambda rows, rate_hz, seed: LostSignal(rows, rate_hz, seed)),
)
"""What happens before the signal is sampled."""

DIGITAL_STAGES: tuple[tuple[str, Builder], ...] = (
    ("adc", lambda rows, rate_hz, seed: Converter(rows)),  # noqa: ARG005
)
"""What happens to the samples."""


class MeasuringChain:
    """All sensors of one kind of a rig, such as its accelerometers.

    Parameters
    ----------
    rows : sequence of Row
        The table, one row per channel of the batch.
    sites : sequence of str
        Places where the model tells what moves, in the order of its rows.
    sample_rate_hz : float
    seed : int
    sampling : Sampling, optional
        By default the sensors work at the sample rate.

    Raises
    ------
    InputError
        A row names a site that the model does not have, or a number does not fit the rate.
    """

    def __init__(
        self,
        rows: Sequence[Row],
        sites: Sequence[str],
        sample_rate_hz: float,
        seed: int,
        sampling: Sampling | None = None,
    ) -> None:
        sampling = Sampling() if sampling is None else sampling
        factor = sampling.oversampling
        self.channels = tuple(row.channel for row in rows)
        self._factor = factor
        self._directions = Directions(rows, sites)
        self._delay = Delay(rows, factor * sample_rate_hz)
        stages = [build(rows, factor * sample_rate_hz, seed) for _, build in STAGES]
        self._analogue = [stage for stage in stages if stage.active]
        self._decimator = Decimator(sampling, len(rows)) if factor > 1 else None
        stages = [build(rows, sample_rate_hz, seed) for _, build in DIGITAL_STAGES]
        self._digital = [stage for stage in stages if stage.active]

    @property
    def past(self) -> int:
        """Samples before a block that `process` needs to see."""
        return -(-(self._delay.past + self._factor - 1) // self._factor)

    @property
    def ahead(self) -> int:
        """Samples after a block that `process` needs to see."""
        half = 0 if self._decimator is None else self._decimator.half
        return max(0, -(-(self._delay.ahead + half + 1 - self._factor) // self._factor))

    def process(self, window: NDArray[np.float64], first_sample: int, count: int) -> NDArray[np.float32]:
        """Batch data of samples first_sample to first_sample + count, in the unit of the rows.

        Parameters
        ----------
        window : ndarray of float64, shape (sites, (past + count + ahead) x oversampling)
            What moves at the sites, at the sensors' rate; element `past` x oversampling belongs to
            `first_sample`.
        first_sample, count : int
            Blocks must follow each other without a gap from sample 0 on.

        Returns
        -------
        ndarray of float32, shape (channels, count)
        """
        seen = self._directions.read(window)
        if self._decimator is None:
            block = self._delay.read(seen, count)
            for stage in self._analogue:
                stage.apply(block, first_sample)
        else:
            block = self._sampled(self._decimator, seen, first_sample, count)
        for stage in self._digital:
            stage.apply(block, first_sample)
        return block.astype(np.float32)

    def _sampled(
        self, decimator: Decimator, seen: NDArray[np.float64], first_sample: int, count: int
    ) -> NDArray[np.float64]:
        """The analogue stages at the sensors' rate, as far as the filter looks, and the samples out of it."""
        begin, end = decimator.end, decimator.wanted(first_sample, count)
        skip = begin - self._delay.past - self._factor * (first_sample - self.past)
        block = self._delay.read(seen[:, skip:], end - begin)
        for stage in self._analogue:
            stage.apply(block, begin)
        return decimator.take(block, first_sample, count)
