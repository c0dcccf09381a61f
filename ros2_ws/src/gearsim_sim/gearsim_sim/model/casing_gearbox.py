"""The parallel-shaft gearbox in a flexible casing.

With a casing of 124 coordinates it has 146 degrees of freedom with lumped internals, 182 with finite-element
shafts.
"""

from __future__ import annotations

from gearsim_sim.model.finite_gearbox import make_finite_gearbox
from gearsim_sim.model.on_casing import on_casing
from gearsim_sim.model.parallel_shaft import make_parallel_shaft
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.casing_gearbox import CasingGearboxParams


def make_casing_gearbox(params: CasingGearboxParams, seed: int) -> Plant:
    """Assemble the model; `seed` gives the gears their random errors."""
    make = make_finite_gearbox if params.finite else make_parallel_shaft
    plant = make(params.gearbox, seed)
    where = f"{params.where}: casing {params.casing.name}"
    return on_casing(plant, params.casing, where, gravity=params.gearbox.physics.gravity)
