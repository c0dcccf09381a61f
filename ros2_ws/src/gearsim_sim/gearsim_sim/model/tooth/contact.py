"""Force law of teeth that can part: backlash, contact on the back flanks, and load on an edge.

With p the compression beyond touch and g the gap that a lead error leaves across the face, the strips of
the face are springs side by side that touch one after the other:

    F(p) = k p^2 / (2 g)  for 0 < p < g,     k (p - g / 2)  for p >= g,     0 for p <= 0.

The drive flanks touch at p = d, the back flanks at p = -d - B with the backlash B along the line of
action; B = 0 is a mesh without contact loss. The damper acts only in contact, on the part of the face that
touches, and is limited to the elastic force: so the force is continuous at touch and never pulls (as in
Modelica's ElastoBacklash2; a plain damper would pull before separation and jump at touch).
"""

from __future__ import annotations

from dataclasses import dataclass


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

    def elastic(self, compression_m: float) -> float:
        """Elastic force over the mesh stiffness [m]: positive on the drive flanks, negative on the back."""
        if compression_m > 0:
            return self._flank(compression_m)
        return -self._flank(-compression_m - self.backlash_m)

    def energy(self, compression_m: float) -> float:
        """Integral of `elastic` over the compression [m^2]."""
        depth = compression_m if compression_m > 0 else -compression_m - self.backlash_m
        gap = self.lead_gap_m
        if depth <= 0:
            return 0.0
        if depth < gap:
            return depth**3 / (6 * gap)
        return depth**2 / 2 - gap * depth / 2 + gap**2 / 6

    def slope(self, compression_m: float) -> float:
        """Derivative of `elastic`, 0 to 1; at touch that of the side that is pressed."""
        depth = compression_m if compression_m >= 0 else -compression_m - self.backlash_m
        if depth < 0:
            return 0.0
        return 1.0 if depth >= self.lead_gap_m else depth / self.lead_gap_m

    def touching(self, compression_m: float) -> float:
        """Part of the face that is in contact, 0 to 1."""
        depth = compression_m if compression_m > 0 else -compression_m - self.backlash_m
        if depth <= 0:
            return 0.0
        return 1.0 if depth >= self.lead_gap_m else depth / self.lead_gap_m

    def force(
        self, compression_m: float, rate_m_per_s: float, stiffness_n_per_m: float, damping_ns_per_m: float
    ) -> float:
        """Force that presses the drive flanks together [N]; negative on the back flanks."""
        elastic = stiffness_n_per_m * self.elastic(compression_m)
        damper = damping_ns_per_m * self.touching(compression_m) * rate_m_per_s
        limit = abs(elastic)
        return elastic + max(-limit, min(limit, damper))

    def _flank(self, depth_m: float) -> float:
        if depth_m <= 0:
            return 0.0
        if depth_m < self.lead_gap_m:
            return depth_m**2 / (2 * self.lead_gap_m)
        return depth_m - self.lead_gap_m / 2
