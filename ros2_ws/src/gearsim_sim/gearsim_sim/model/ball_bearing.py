"""The names under which ball bearings were known before rollers came; see `rolling_bearing`."""

from __future__ import annotations

from gearsim_sim.model.rolling_bearing import RollingBearing as BallBearing
from gearsim_sim.model.rolling_bearing import make_rolling_bearing as make_ball_bearing

__all__ = ["BallBearing", "make_ball_bearing"]
