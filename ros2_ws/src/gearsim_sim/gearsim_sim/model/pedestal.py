"""A bearing pedestal: mass on springs in x and y, with a resonator in y (thesis Figure 4.1)."""

from __future__ import annotations

import math

from gearsim_sim.model.assembly import Assembly
from gearsim_sim.params.parts import Pedestal


def add_pedestal(
    assembly: Assembly, pedestal: Pedestal, number: int | str, *, resonator: bool = True
) -> None:
    """Add x_p, y_p and the resonator's y_r of pedestal `number`; (4.3) and (4.4) without bearing forces."""
    x, y, high = f"x_p{number}", f"y_p{number}", f"y_r{number}"
    assembly.inertia(x, pedestal.mass_kg)
    assembly.inertia(y, pedestal.mass_kg)
    for dof in (x, y):
        assembly.spring({dof: 1.0}, pedestal.stiffness_n_per_m)
        assembly.damper({dof: 1.0}, pedestal.damping_ns_per_m)
    if not resonator:
        return
    omega = 2 * math.pi * pedestal.resonator_frequency_hz
    mass, ratio = pedestal.resonator_mass_kg, pedestal.resonator_damping_ratio
    assembly.inertia(high, mass)
    assembly.spring({high: 1.0, y: -1.0}, mass * omega**2)
    assembly.damper({high: 1.0, y: -1.0}, 2 * ratio * mass * omega)
