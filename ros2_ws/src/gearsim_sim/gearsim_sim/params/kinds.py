"""The kinds of machines that can be simulated, by the `kind` of their `model` section."""

from __future__ import annotations

from pydantic import BaseModel

from gearsim_sim.params.bearing_rig import BearingRigModel
from gearsim_sim.params.parallel import ParallelModel
from gearsim_sim.params.planetary import PlanetaryModel

MODEL_KINDS: dict[str, type[BaseModel]] = {
    "parallel_shaft": ParallelModel,
    "planetary": PlanetaryModel,
    "bearing_rig": BearingRigModel,
}
