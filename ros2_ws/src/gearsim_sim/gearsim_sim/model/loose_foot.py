"""A pedestal whose bolts are loose: pressed down it is as stiff as ever, lifted it is softer.

With y the lift of the pedestal above the place where the joint opens, the base carries

    F = K y - dK clip(y, 0, gap),    dK = K (1 - (1 - r)^severity),

so three straight pieces: full stiffness when pressed (y < 0), the softer one while the foot lifts off,
and full stiffness again where the head of the bolt stops it (Chu and Tang, J. Sound Vib. 241, 2001, 879).
The corners are rounded over +-w by parabolas: force and stiffness are continuous. The force is that of
a potential; the base's damper works in full where the joint touches and is reduced as the stiffness is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Vector


def rounded(x: float, width: float) -> tuple[float, float, float]:
    """max(x, 0) with a corner rounded over +-width: value, slope, integral."""
    if x <= -width:
        return 0.0, 0.0, 0.0
    if x >= width:
        return x, 1.0, 0.5 * x * x + width * width / 6.0
    t = x + width
    return t * t / (4.0 * width), t / (2.0 * width), t**3 / (12.0 * width)


@dataclass(frozen=True, eq=False)
class LooseFoot:
    """The deviation of a loose foot from the linear base, along `direction` (lift positive)."""

    table: ClassVar[str] = "feet"

    direction: Vector
    stiffness_n_per_m: float
    damping_ns_per_m: float
    reduction: float  # r, below 1
    opens_at_m: float
    gap_m: float
    rounding_m: float

    @property
    def directions(self) -> tuple[Vector, ...]:
        """Where it acts."""
        return (self.direction,)

    def numbers(self) -> tuple[float, ...]:
        """Its row in the table, behind the direction."""
        return (
            self.stiffness_n_per_m,
            self.damping_ns_per_m,
            math.log1p(-self.reduction),
            self.opens_at_m,
            self.gap_m,
            self.rounding_m,
        )

    def samples(self) -> NDArray[np.float64] | None:
        """None: no table of samples."""
        return None

    def share(self, severity: float) -> float:
        """1 - (1 - r)^severity: what is missing of the stiffness while the foot lifts."""
        return -math.expm1(severity * math.log1p(-self.reduction))

    def force(self, y: float, rate: float, severity: float) -> float:
        """Force on the pedestal beyond the linear base's -K y - C y' [N]; upward positive."""
        first, slope_in, _ = rounded(y - self.opens_at_m, self.rounding_m)
        last, slope_out, _ = rounded(y - self.opens_at_m - self.gap_m, self.rounding_m)
        spring = self.stiffness_n_per_m * (first - last)
        damper = self.damping_ns_per_m * (slope_in - slope_out) * rate
        return self.share(severity) * (spring + damper)

    def energy(self, y: float, severity: float) -> float:
        """Potential of `force` without its damper [J] (to be added to that of the linear base)."""
        _, _, first = rounded(y - self.opens_at_m, self.rounding_m)
        _, _, last = rounded(y - self.opens_at_m - self.gap_m, self.rounding_m)
        return -self.share(severity) * self.stiffness_n_per_m * (first - last)
