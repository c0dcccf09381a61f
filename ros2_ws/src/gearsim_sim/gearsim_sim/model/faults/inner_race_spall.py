"""Localised spall of the inner race: turns with it, in and out of the load zone (4.13)."""

from __future__ import annotations

from gearsim_sim.model.faults.bearing_parts import Race
from gearsim_sim.model.faults.kind import FaultKind, bearing_names
from gearsim_sim.model.faults.spall import SpallParams, place_spall
from gearsim_sim.model.plant import Plant
from gearsim_sim.model.spall import Spall


def place(params: SpallParams, component: str, plant: Plant, seed: int) -> tuple[Spall]:  # noqa: ARG001
    """The spall; `position_rad` is its azimuth at angle zero of the ring (default 0 on a ring that turns)."""
    return (place_spall(params, component, plant, Race.INNER),)


KIND = FaultKind(
    name="inner_race_spall",
    summary="pit in the inner race, turning with the shaft (thesis 5.3.3)",
    params_model=SpallParams,
    components=bearing_names,
    place=place,
    look_for="groups of events at the BPFI that swell and fade as the pit passes the load zone: BPFI "
    "with sidebands at the shaft's speed",
)
