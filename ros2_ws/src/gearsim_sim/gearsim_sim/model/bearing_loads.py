"""How much each bearing of a machine carries when it stands under its nominal load."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.integrate.modes import complex_modes
from gearsim_sim.model.plant import Moment, Plant
from gearsim_sim.model.statics import static_equilibrium


def bearing_loads(plant: Plant) -> NDArray[np.float64]:
    """Radial force on each bearing at the angle zero, without faults; shape (bearings,) [N]."""
    moment = Moment(0.0, 0.0)
    rest = static_equilibrium(
        plant, complex_modes(plant.system), moment, plant.known_inputs(plant.limits.load_nm)
    )
    motion, phases = plant.system.interfaces.T @ rest, plant.phases(0.0)
    return np.array([np.linalg.norm(seat.force(motion[[seat.x, seat.y]], phases)) for seat in plant.bearings])
