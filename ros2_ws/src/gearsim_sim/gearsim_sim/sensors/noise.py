"""White noise of a measuring chain, drawn by sample number.

Each channel has a Philox generator of its own (Salmon et al. 2011), keyed by the seed and the channel's
name. Sample n uses the n-th 64-bit number of the sequence and no other, turned into a normal deviate by the
inverse of the normal distribution; so neither the chunk size nor another channel can change a bit of it.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Sequence

import numpy as np
from numpy.random import Philox
from numpy.typing import NDArray
from scipy.special import ndtri

from gearsim_sim.sensors.rows import Accelerometer

_SHIFT = np.uint64(11)
_STEP = 2.0**-53


def generator(seed: int, name: str) -> Philox:
    """The counter-based generator of one stream of random numbers, named so that streams never share one."""
    digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
    return Philox(key=np.array([seed, int.from_bytes(digest, "little")], dtype=np.uint64))


def normal(source: Philox, count: int) -> NDArray[np.float64]:
    """The next `count` standard normal deviates, one number of the sequence each (within +-8.2)."""
    deviates = (source.random_raw(count) >> _SHIFT).astype(np.float64)
    deviates += 0.5
    deviates *= _STEP
    ndtri(deviates, out=deviates)
    return deviates


class Noise:
    """The noise of every channel that has one, added in place.

    The density is one-sided and flat up to half the sample rate: the standard deviation is
    density x sqrt(sample rate / 2).
    """

    def __init__(self, rows: Sequence[Accelerometer], sample_rate_hz: float, seed: int) -> None:
        width = math.sqrt(sample_rate_hz / 2)
        self._sources = [
            (channel, row.noise_density * width, generator(seed, f"accelerometer noise/{row.channel}"))
            for channel, row in enumerate(rows)
            if row.noise_density is not None and row.noise_density > 0
        ]

    @property
    def active(self) -> bool:
        """False if no channel is noisy."""
        return bool(self._sources)

    def apply(self, block: NDArray[np.float64], first_sample: int) -> None:  # noqa: ARG002
        """Add the noise of the next samples to `block` (channels, samples)."""
        for channel, sigma, source in self._sources:
            deviates = normal(source, block.shape[1])
            deviates *= sigma
            block[channel] += deviates
