"""From parameters to a plant: one line for each kind of machine."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gearsim_sim.model.bearing_rig import make_bearing_rig
from gearsim_sim.model.casing_gearbox import make_casing_gearbox
from gearsim_sim.model.parallel_shaft import make_parallel_shaft
from gearsim_sim.model.planet_plant import make_planetary
from gearsim_sim.model.planetary_casing import make_planetary_casing
from gearsim_sim.model.plant import Plant
from gearsim_sim.params.bearing_rig import BearingRigParams
from gearsim_sim.params.casing_gearbox import CasingGearboxParams
from gearsim_sim.params.parallel import ParallelParams
from gearsim_sim.params.planetary import PlanetaryParams
from gearsim_sim.params.planetary_casing import PlanetaryCasingParams

MAKERS: dict[type, Callable[[Any, int], Plant]] = {
    BearingRigParams: make_bearing_rig,
    CasingGearboxParams: make_casing_gearbox,
    ParallelParams: make_parallel_shaft,
    PlanetaryParams: make_planetary,
    PlanetaryCasingParams: make_planetary_casing,
}


def make_plant(params: Any, seed: int) -> Plant:
    """The machine with these parameters; `seed` gives the gears their random errors."""
    return MAKERS[type(params)](params, seed)
