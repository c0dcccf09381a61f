"""Force law of teeth that can part: backlash, contact on the back flanks, and load on an edge.

With p the compression beyond touch and g the gap that a lead error leaves across the face, the strips of
the face are springs side by side that touch one after the other:

    F(p) = k p^2 / (2 g)  for 0 < p < g,     k (p - g / 2)  for p >= g,     0 for p <= 0.

The drive flanks touch at p = d, the back flanks at p = -d - B with the backlash B along the line of
action; B = 0 is a mesh without contact loss. The damper acts only in contact, on the part of the face that
touches, and where teeth part it is limited to the elastic force: so the force is continuous at touch and
never pulls (as in Modelica's ElastoBacklash2; a plain damper would pull before separation and jump at
touch).

Teeth with a little play behave altogether unlike those with none, in which the same flanks push and pull.
So that a growing backlash has an effect that grows from nothing, the force below `FREE_PLAY_M` is a mixture
of both laws in proportion to the backlash; above it, the law of teeth that part is alone.
"""

from __future__ import annotations

from dataclasses import dataclass

# Backlash from which on teeth part altogether. No tooth system is cut with less (DIN 3967 has 60 um and more
# at this size), and oil of a few um holds the flanks before that.
FREE_PLAY_M = 20e-6


@dataclass(frozen=True)
class ToothContact:
    """The force law.

    Parameters
    ----------
    backlash_m : float
        Play along the line of action between drive and back flanks.
    lead_gap_m : float
        Gap at one end of the face when the other end touches.
    """

    backlash_m: float = 0.0
    lead_gap_m: float = 0.0

    @property
    def bilateral(self) -> bool:
        """Whether nothing ever parts: a mesh without these faults, whose spring and damper also pull."""
        return self.backlash_m == 0 and self.lead_gap_m == 0

    @property
    def parting(self) -> float:
        """Share of the law of teeth that part, 0 to 1; the rest is that of teeth without play."""
        return min(1.0, self.backlash_m / FREE_PLAY_M)

    def elastic(self, compression_m: float) -> float:
        """Elastic force over the mesh stiffness [m]: positive on the drive flanks, negative on the back."""
        sense = 1.0 if compression_m > 0 else -1.0
        held, free = (self._flank(depth) for depth in self._depths(compression_m))
        return sense * ((1 - self.parting) * held + self.parting * free)

    def energy(self, compression_m: float) -> float:
        """Integral of `elastic` over the compression [m^2]."""
        held, free = (self._flank_energy(depth) for depth in self._depths(compression_m))
        return (1 - self.parting) * held + self.parting * free

    def slope(self, compression_m: float) -> float:
        """Derivative of `elastic`, 0 to 1; at touch that of the side that is pressed."""
        held, free = (self._touching(depth) for depth in self._depths(compression_m))
        return (1 - self.parting) * held + self.parting * free

    def force(
        self, compression_m: float, rate_m_per_s: float, stiffness_n_per_m: float, damping_ns_per_m: float
    ) -> float:
        """Force that presses the drive flanks together [N]; negative on the back flanks."""
        held, free = self._depths(compression_m)
        damper = damping_ns_per_m * rate_m_per_s
        limit = stiffness_n_per_m * self._flank(free)
        limited = max(-limit, min(limit, self._touching(free) * damper))
        elastic = stiffness_n_per_m * self.elastic(compression_m)
        return elastic + (1 - self.parting) * self._touching(held) * damper + self.parting * limited

    def _depths(self, compression_m: float) -> tuple[float, float]:
        """Compression beyond touch of the flanks that face each other, without play and with it."""
        if compression_m > 0:
            return compression_m, compression_m
        return -compression_m, -compression_m - self.backlash_m

    def _flank(self, depth_m: float) -> float:
        if depth_m <= 0:
            return 0.0
        if depth_m < self.lead_gap_m:
            return depth_m**2 / (2 * self.lead_gap_m)
        return depth_m - self.lead_gap_m / 2

    def _flank_energy(self, depth_m: float) -> float:
        gap = self.lead_gap_m
        if depth_m <= 0:
            return 0.0
        if depth_m < gap:
            return depth_m**3 / (6 * gap)
        return depth_m**2 / 2 - gap * depth_m / 2 + gap**2 / 6

    def _touching(self, depth_m: float) -> float:
        """Part of the face that is in contact, 0 to 1."""
        if depth_m < 0:
            return 0.0
        return 1.0 if depth_m >= self.lead_gap_m else depth_m / self.lead_gap_m
