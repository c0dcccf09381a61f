"""Gear mesh: a spring and damper along the line of action, with errors put in series.

The compression of the teeth is d = r_p theta_p - r_g theta_g - y_p + y_g + e, and the force
F = k(theta) d + c d' acts on the gears as -F times the gradient of d: moments -r_p F and +r_g F, forces
+F on the pinion and -F on the gear along y. That is (4.18) and (4.19) with the errata: y instead of x,
moment = radius times force, action = -reaction. The mesh has no contact loss (thesis 4.2.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearsim_sim.model.assembly import Assembly, Vector
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.params.parallel import MeshStiffness

INTERFACE = "mesh"


def mesh_direction(pinion_radius_m: float, gear_radius_m: float) -> Vector:
    """Gradient of the compression with respect to the degrees of freedom."""
    return {"theta_pin": pinion_radius_m, "theta_ge": -gear_radius_m, "y_pin": -1.0, "y_ge": 1.0}


def add_mesh(assembly: Assembly, mesh: MeshStiffness, direction: Vector) -> None:
    """The mean stiffness and the damper, and the interface for what is left of the force."""
    assembly.spring(direction, mesh.mean_stiffness_n_per_m)
    assembly.damper(direction, mesh.damping_ns_per_m)
    assembly.interface(INTERFACE, direction)


def stiffness_series(mesh: MeshStiffness, *, variation: bool) -> PeriodicSeries:
    """Mesh stiffness [N/m] over the tooth phase in pitches, 0 in the middle of double contact.

    One pair and two pairs of teeth alternate; the second holds for `contact_ratio` - 1 of a pitch and
    is `pair_stiffness_ratio` times as stiff. The mean is kept. Lanczos factors let the series end
    without overshoot, as tip relief rounds the take-over.
    """
    double = mesh.contact_ratio - 1
    mean, ratio = mesh.mean_stiffness_n_per_m, mesh.pair_stiffness_ratio
    single_stiffness = mean / (1 + (ratio - 1) * double)
    orders = np.arange(1, int(mesh.harmonics) + 1) if variation else np.zeros(0, dtype=np.int64)
    step = (ratio - 1) * single_stiffness
    cosine = step * 2 * np.sin(np.pi * orders * double) / (np.pi * orders)
    cosine *= np.sinc(orders / (int(mesh.harmonics) + 1))
    return PeriodicSeries(mean=mean, orders=orders, cosine=cosine, sine=np.zeros_like(cosine))


@dataclass(frozen=True, eq=False)
class Mesh:
    """The mesh as a force element."""

    stiffness: PeriodicSeries  # over tooth phase
    mean_stiffness_n_per_m: float
    damping_ns_per_m: float
    pinion_error: PeriodicSeries  # over the pinion's turn
    gear_error: PeriodicSeries  # over the gear's turn
    pinion_teeth: int

    def error(self, pinion_turns: float, gear_turns: float) -> float:
        """Transmission error [m]; positive presses the teeth together."""
        return float(self.pinion_error.value(pinion_turns) + self.gear_error.value(gear_turns))

    def error_rate(
        self, pinion_turns: float, gear_turns: float, pinion_speed_hz: float, gear_speed_hz: float
    ) -> float:
        """d(error)/dt [m/s]."""
        pinion = pinion_speed_hz * self.pinion_error.slope(pinion_turns)
        return float(pinion + gear_speed_hz * self.gear_error.slope(gear_turns))

    def energy(self, compression_m: float, pinion_turns: float) -> float:
        """Elastic energy k d^2 / 2 [J]."""
        return 0.5 * float(self.stiffness.value(pinion_turns * self.pinion_teeth)) * compression_m**2

    def force(self, compression_m: float, rate_m_per_s: float, pinion_turns: float) -> float:
        """k d + c d' [N], the force that presses the teeth together.

        Parameters
        ----------
        compression_m, rate_m_per_s : float
            Compression of the teeth with the error included, and its rate.
        pinion_turns : float
            Angle of the pinion.
        """
        stiffness = float(self.stiffness.value(pinion_turns * self.pinion_teeth))
        return stiffness * compression_m + self.damping_ns_per_m * rate_m_per_s
