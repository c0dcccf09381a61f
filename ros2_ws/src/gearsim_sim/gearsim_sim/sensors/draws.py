"""Random numbers drawn by number: stream, seed and counter give the same bits on every run.

Each stream has a Philox generator of its own (Salmon et al. 2011), keyed by the seed and the stream's name.
Its n-th deviate uses the n-th 64-bit number of the sequence and no other; so neither the chunk size nor
another stream can change a bit of it.
"""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.random import Philox
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SHIFT = np.uint64(11)
_STEP = 2.0**-53


def generator(seed: int, name: str) -> Philox:
    """The counter-based generator of one stream of random numbers, named so that streams never share one."""
    digest = hashlib.blake2b(name.encode(), digest_size=8).digest()
    return Philox(key=np.array([seed, int.from_bytes(digest, "little")], dtype=np.uint64))


def uniform(source: Philox, count: int) -> Array:
    """The next `count` numbers, evenly spread over (0, 1), one number of the sequence each."""
    deviates = (source.random_raw(count) >> _SHIFT).astype(np.float64)
    deviates += 0.5
    deviates *= _STEP
    return deviates


def normal(source: Philox, count: int) -> Array:
    """The next `count` standard normal deviates, one number of the sequence each (within +-8.3)."""
    from scipy.special import ndtri  # here, because it takes long to load

    deviates = uniform(source, count)
    ndtri(deviates, out=deviates)
    return deviates
