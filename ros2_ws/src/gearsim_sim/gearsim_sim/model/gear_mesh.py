"""Gear mesh: a spring and damper along the line of action, with errors put in series.

The compression of the teeth is d = r_p theta_p - r_g theta_g - y_p + y_g + e, and the force
F = k(theta) d + c d' acts on the gears as -F times the gradient of d: moments -r_p F and +r_g F, forces
+F on the pinion and -F on the gear along y. That is (4.18) and (4.19) with the errata: y instead of x,
moment = radius times force, action = -reaction. The mesh has no contact loss (thesis 4.2.5) unless a fault
gives it backlash or a lead error; then `tooth.contact.ToothContact` is its law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.model.assembly import Assembly, Vector
from gearsim_sim.model.contributions import ERROR, STIFFNESS, Contribution, MeshMod
from gearsim_sim.model.mesh_terms import BACKLASH, LEAD_GAP, MeshPulse, MeshTerm, pulse_mean
from gearsim_sim.model.periodic import PeriodicSeries
from gearsim_sim.model.tooth.contact import ToothContact
from gearsim_sim.params.parallel import MeshStiffness

INTERFACE = "mesh"
Array = NDArray[np.float64]
Mods = tuple[tuple[Contribution, float], ...]


def mesh_direction(pinion_radius_m: float, gear_radius_m: float) -> Vector:
    """Gradient of the compression with respect to the degrees of freedom."""
    return {"theta_pin": pinion_radius_m, "theta_ge": -gear_radius_m, "y_pin": -1.0, "y_ge": 1.0}


def add_mesh(
    assembly: Assembly, mean_stiffness_n_per_m: float, damping_ns_per_m: float, direction: Vector
) -> None:
    """The mean stiffness and the damper, and the interface for what is left of the force."""
    assembly.spring(direction, mean_stiffness_n_per_m)
    assembly.damper(direction, damping_ns_per_m)
    assembly.interface(INTERFACE, direction)


def stiffness_series(mesh: MeshStiffness, *, variation: bool) -> PeriodicSeries:
    """Mesh stiffness [N/m] over the tooth phase in pitches, 0 in the middle of double contact.

    One pair and two pairs of teeth alternate; the second holds for `contact_ratio` - 1 of a pitch and
    is `pair_stiffness_ratio` times as stiff. The mean is kept. Lanczos factors let the series end
    without overshoot, as tip relief rounds the take-over.
    """
    mean, ratio = mesh.mean_stiffness_n_per_m, mesh.pair_stiffness_ratio
    return two_pair_stiffness(mean, ratio, mesh.contact_ratio, int(mesh.harmonics) if variation else 0)


def two_pair_stiffness(mean_n_per_m: float, ratio: float, contact: float, harmonics: int) -> PeriodicSeries:
    """The same from mean, stiffness of two pairs over one, contact ratio and number of lines."""
    double = contact - 1
    single = mean_n_per_m / (1 + (ratio - 1) * double)
    orders = np.arange(1, harmonics + 1)
    cosine = (ratio - 1) * single * 2 * np.sin(np.pi * orders * double) / (np.pi * orders)
    cosine = cosine * np.sinc(orders / (harmonics + 1))
    return PeriodicSeries(mean=mean_n_per_m, orders=orders, cosine=cosine, sine=np.zeros_like(cosine))


@dataclass(frozen=True, eq=False)
class MeshError:
    """Transmission error [m] over the turn of a track; positive presses the teeth together."""

    track: int
    series: PeriodicSeries


@dataclass(frozen=True, eq=False)
class Mesh:
    """The mesh as a force element.

    The tooth phase is `cycles` times the angle of `track`, plus `phase_offset`, in pitches. `pulse` is a
    rectangular part of the stiffness: start and width in pitches, height [N/m]; the loop takes its exact
    mean over each step, here it jumps.
    """

    name: str
    interface: int
    stiffness: PeriodicSeries  # over tooth phase
    mean_stiffness_n_per_m: float
    damping_ns_per_m: float
    track: int
    cycles: float
    phase_offset: float
    errors: tuple[MeshError, ...]
    pulse: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def stiffness_at(self, phases: Array, mods: Mods = ()) -> float:
        """Stiffness [N/m] at these angles of the tracks, with what faults change."""
        place = phases[self.track] * self.cycles + self.phase_offset
        value = float(self.stiffness.value(place))
        value += self.pulse[2] * pulse_mean(place - self.pulse[0], 0.0, self.pulse[1])
        for mod, severity in mods:
            if isinstance(mod, MeshPulse) and mod.what == STIFFNESS:
                value += severity * mod.mean(phases[mod.track], 0.0)
            if isinstance(mod, MeshMod) and mod.what == STIFFNESS:
                value += severity * float(mod.series.value(phases[mod.track]))
        return value

    def error(self, phases: Array, mods: Mods = ()) -> float:
        """Transmission error [m]; positive presses the teeth together."""
        smooth = sum(factor * float(one.series.value(phases[one.track])) for one, factor in self._all(mods))
        pulses = [(mod, factor) for mod, factor in mods if isinstance(mod, MeshPulse) and mod.what == ERROR]
        return smooth + sum(factor * mod.mean(phases[mod.track], 0.0) for mod, factor in pulses)

    def error_rate(self, phases: Array, speeds_hz: Array, mods: Mods = ()) -> float:
        """d(error)/dt [m/s]; `speeds_hz` are those of the tracks. Pulses have none but at their jumps."""
        return sum(
            factor * float(speeds_hz[one.track] * one.series.slope(phases[one.track]))
            for one, factor in self._all(mods)
        )

    def _all(self, mods: Mods) -> list[tuple[MeshError | MeshMod, float]]:
        """Own errors and those of faults, with factors."""
        added = [(mod, severity) for mod, severity in mods if isinstance(mod, MeshMod) and mod.what == ERROR]
        return [*((one, 1.0) for one in self.errors), *added]

    def contact(self, mods: Mods = ()) -> ToothContact:
        """The law of contact, with what faults add to it."""
        numbers = [0.0, 0.0]
        for mod, severity in mods:
            if isinstance(mod, MeshTerm):
                numbers[mod.what] += severity * mod.value_m
        return ToothContact(backlash_m=numbers[BACKLASH], lead_gap_m=numbers[LEAD_GAP])

    def energy(self, compression_m: float, phases: Array, mods: Mods = ()) -> float:
        """Elastic energy [J], k (d + e)^2 / 2 where nothing parts; `compression_m` is d."""
        total = compression_m + self.error(phases, mods)
        return self.stiffness_at(phases, mods) * self.contact(mods).energy(total)

    def tangent(self, compression_m: float, phases: Array, mods: Mods = ()) -> float:
        """Slope of the elastic force [N/m]."""
        total = compression_m + self.error(phases, mods)
        return self.stiffness_at(phases, mods) * self.contact(mods).slope(total)

    def force(
        self, compression_m: float, rate_m_per_s: float, phases: Array, speeds_hz: Array, mods: Mods = ()
    ) -> float:
        """Force that presses the teeth together [N]: k d + c d' where nothing parts.

        Parameters
        ----------
        compression_m, rate_m_per_s : float
            Compression of the teeth without the transmission error, and its rate.
        phases, speeds_hz : ndarray, shape (tracks,)
            Turns of the tracks and their rates.
        mods : tuple
            Contributions of faults to this mesh, with their severities.
        """
        total = compression_m + self.error(phases, mods)
        rate = rate_m_per_s + self.error_rate(phases, speeds_hz, mods)
        stiffness, law = self.stiffness_at(phases, mods), self.contact(mods)
        if law.bilateral:
            return stiffness * total + self.damping_ns_per_m * rate
        return law.force(total, rate, stiffness, self.damping_ns_per_m)
