"""Localised spall of the inner race: turns with the shaft, in and out of the load zone (4.13)."""

from __future__ import annotations

from gearsim_sim.model.ball_bearing import BallBearing
from gearsim_sim.model.faults.spall import FaultKind, Spall, SpallParams


def place(params: SpallParams, bearing_index: int, bearing: BallBearing) -> Spall:
    """The spall; `position_rad` is its azimuth at shaft angle zero (default 0)."""
    return Spall(
        bearing=bearing_index,
        row=int(params.row) - 1,
        on_inner_race=True,
        position_rad=0.0 if params.position_rad is None else params.position_rad,
        half_width_rad=params.width_m / (2 * bearing.inner_race_radius_m),
        depth_m=params.depth_m,
        race_radius_m=bearing.inner_race_radius_m,
        ball_radius_m=bearing.ball_radius_m,
        severity=1.0,
    )


KIND = FaultKind(
    name="inner_race_spall",
    summary="pit in the inner race, turning with the shaft (thesis 5.3.3)",
    params_model=SpallParams,
    place=place,
)
