"""Localised spall of the outer race: where that stands still, by default in the middle of the load zone."""

from __future__ import annotations

from gearsim_sim.model.faults.bearing_parts import Race
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.faults.spall import SpallParams, place_spall
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.spall import Spall


def place(params: SpallParams, component: str, plant: Plant, seed: int) -> tuple[Spall]:  # noqa: ARG001
    """The spall; `position_rad` is its azimuth at angle zero of the ring (0 along x, pi/2 along y)."""
    return (place_spall(params, component, plant, Race.OUTER),)


KIND = FaultKind(
    name="outer_race_spall",
    summary="pit in the outer race, in the load zone unless position_rad says otherwise (thesis 5.3.2)",
    params_model=SpallParams,
    components=bearing_names,
    place=place,
    look_for="pairs of events, unloading and impact, at the BPFO; its harmonics stand in the envelope "
    "spectrum without sidebands",
)
