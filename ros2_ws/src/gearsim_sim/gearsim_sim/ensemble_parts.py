"""What goes into an ensemble, and what comes out of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.events import FaultSpec

Array = NDArray[np.float64]


class Variant(NamedTuple):
    """One machine of an ensemble; what is None is taken from its parameters."""

    params: Any
    seed: int = 1
    faults: Sequence[FaultSpec] = ()
    speed_hz: float | None = None
    load_nm: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class EnsembleOutput:
    """`n` output samples of all variants, on one time axis; see `EngineOutput`."""

    first_sample: int
    site_names: tuple[str, ...]
    accel: Array  # (variants, sites, n) [m/s^2]
    shaft_names: tuple[str, ...]
    turns: NDArray[np.int64]  # (variants, shafts, n) whole turns of each shaft's encoder
    fraction: Array  # (variants, shafts, n) rest of the angle in turns, [0, 1)
    speed_hz: Array  # (variants, shafts, n)
    signal_names: tuple[str, ...]
    signals: Array  # (variants, signals, n)
