"""How the ring of a bearing turns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Ring:
    """How a ring turns in the plane of x and y: `sense` times a track's angle; sense 0 stands still."""

    track: int = 0
    sense: float = 0.0

    def angle_turns(self, phases: NDArray[np.float64]) -> float:
        """Its azimuth in turns, counter-clockwise."""
        return self.sense * float(phases[self.track])

    def rate(self, rates: NDArray[np.float64]) -> float:
        """Its turns per turn of the reference shaft, counter-clockwise."""
        return self.sense * float(rates[self.track])
