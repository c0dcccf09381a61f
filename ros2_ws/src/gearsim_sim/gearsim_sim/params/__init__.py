"""Parameters of the machines that can be simulated."""

from gearsim_sim.params.bearing_rig import BearingRigParams, load_bearing_rig_params
from gearsim_sim.params.parallel import ParallelParams, load_parallel_params
from gearsim_sim.params.planetary import PlanetaryParams, load_planetary_params

__all__ = [
    "BearingRigParams",
    "ParallelParams",
    "PlanetaryParams",
    "load_bearing_rig_params",
    "load_parallel_params",
    "load_planetary_params",
]
