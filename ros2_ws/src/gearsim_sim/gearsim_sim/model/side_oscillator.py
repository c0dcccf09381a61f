"""A mass on springs beside the machine: an added resonance, or a path from one place to another.

The mass m of the place z hangs on n = 1 or 2 places x_i of the machine by equal springs and dampers, that
are tuned to w and zeta:

    z'' + 2 zeta w z' + w^2 z = (1/n) sum (w^2 x_i + 2 zeta w x_i'),
    force on place i = severity m / n (w^2 (z - x_i) + 2 zeta w (z' - x_i')).

The motion of the mass does not know its severity; only what it gives back is scaled. So severity s is
exactly a path of s times the mass, stiffness and damping, and 0 is the machine without it. With n = 1 it
is a resonance at w; with n = 2 a path of stiffness m w^2 / 4 between both places, below w.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Vector


@dataclass(frozen=True, eq=False)
class SideOscillator:
    """Mass, tuning and the one or two directions that it hangs on."""

    table: ClassVar[str] = "oscillators"

    directions: tuple[Vector, ...]
    mass_kg: float
    frequency_hz: float
    damping_ratio: float  # below 1

    @property
    def omega(self) -> float:
        """w [rad/s]."""
        return 2 * math.pi * self.frequency_hz

    def numbers(self) -> tuple[float, ...]:
        """Its row in the table, behind the directions."""
        return (self.mass_kg, self.omega, self.damping_ratio)

    def samples(self) -> NDArray[np.float64] | None:
        """None: no table of samples."""
        return None

    def acceleration(self, z: float, z_rate: float, places: NDArray[np.float64]) -> float:
        """z'' for the places (n, 2): displacement and rate of each."""
        w, damping = self.omega, 2 * self.damping_ratio * self.omega
        driven = np.mean(w * w * places[:, 0] + damping * places[:, 1])
        return float(driven) - damping * z_rate - w * w * z

    def forces(
        self, z: float, z_rate: float, places: NDArray[np.float64], severity: float
    ) -> NDArray[np.float64]:
        """Force on each place [N]; shape (n,)."""
        w, damping = self.omega, 2 * self.damping_ratio * self.omega
        pull = w * w * (z - places[:, 0]) + damping * (z_rate - places[:, 1])
        return np.asarray(severity * self.mass_kg / len(self.directions) * pull)
