"""Localised spall of the outer race: stands still, by default in the middle of the load zone."""

from __future__ import annotations

from gearsim_sim.model.ball_bearing import BallBearing
from gearsim_sim.model.faults.spall import FaultKind, Spall, SpallParams


def place(params: SpallParams, bearing_index: int, bearing: BallBearing) -> Spall:
    """The spall at a fixed azimuth (0 along x, pi/2 along y)."""
    position = bearing.load_direction_rad if params.position_rad is None else params.position_rad
    return Spall(
        bearing=bearing_index,
        row=int(params.row) - 1,
        on_inner_race=False,
        position_rad=position,
        half_width_rad=params.width_m / (2 * bearing.outer_race_radius_m),
        depth_m=params.depth_m,
        race_radius_m=bearing.outer_race_radius_m,
        ball_radius_m=bearing.ball_radius_m,
        severity=1.0,
    )


KIND = FaultKind(
    name="outer_race_spall",
    summary="pit in the outer race, in the load zone unless position_rad says otherwise (thesis 5.3.2)",
    params_model=SpallParams,
    place=place,
)
