"""The measuring chain of all accelerometers: from the motion at their sites to the numbers of a batch.

A stage is a class with `active` and `apply(block, first_sample)`, one file each; `STAGES` is the order in
which the signal passes them. A new effect is a file and a line here, with its numbers in `rows`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError
from gearsim_sim.sensors.adc import Converter
from gearsim_sim.sensors.delay import Delay
from gearsim_sim.sensors.noise import Noise
from gearsim_sim.sensors.rolloff import Rolloff
from gearsim_sim.sensors.rows import Accelerometer


class Stage(Protocol):
    """One effect of the chain on all channels; it keeps its own state from block to block."""

    @property
    def active(self) -> bool:
        """False if no channel has the effect, so that it can be left out."""
        ...

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:
        """Change `block` (channels, samples) in place; `first_sample` is the stream index of its start."""
        ...


Builder = Callable[[Sequence[Accelerometer], float, int], Stage]

STAGES: tuple[tuple[str, Builder], ...] = (
    ("rolloff", lambda rows, rate_hz, seed: Rolloff(rows, rate_hz)),  # noqa: ARG005
    ("noise", lambda rows, rate_hz, seed: Noise(rows, rate_hz, seed)),
    ("adc", lambda rows, rate_hz, seed: Converter(rows)),  # noqa: ARG005
)


class AccelerometerChain:
    """All accelerometers of a rig.

    Parameters
    ----------
    rows : sequence of Accelerometer
        The table, one row per channel of the batch.
    sites : sequence of str
        Places where the model gives the acceleration, in the order of its rows.
    sample_rate_hz : float
    seed : int

    Raises
    ------
    InputError
        A row names a site that the model does not have.
    """

    def __init__(
        self, rows: Sequence[Accelerometer], sites: Sequence[str], sample_rate_hz: float, seed: int
    ) -> None:
        self.channels = tuple(row.channel for row in rows)
        for row in rows:
            if row.site not in sites:
                where = f"sensor {row.channel}"
                raise InputError(where, "site", row.site, "one of " + ", ".join(sites))
        self._sites = np.array([list(sites).index(row.site) for row in rows], dtype=np.int64)
        self._delay = Delay(rows, sample_rate_hz)
        stages = [build(rows, sample_rate_hz, seed) for _, build in STAGES]
        self._stages = [stage for stage in stages if stage.active]

    @property
    def past(self) -> int:
        """Samples before a block that `process` needs to see."""
        return self._delay.past

    @property
    def ahead(self) -> int:
        """Samples after a block that `process` needs to see."""
        return self._delay.ahead

    def process(self, window: NDArray[np.float64], first_sample: int, count: int) -> NDArray[np.float32]:
        """Batch data of samples first_sample to first_sample + count, in m/s^2.

        Parameters
        ----------
        window : ndarray of float64, shape (sites, past + count + ahead)
            Acceleration at the sites in m/s^2; element `past` belongs to `first_sample`.
        first_sample, count : int

        Returns
        -------
        ndarray of float32, shape (channels, count)
        """
        block = self._delay.read(window[self._sites], count)
        for stage in self._stages:
            stage.apply(block, first_sample)
        return block.astype(np.float32)
