"""How fast the physics runs on one core, beside scipy's RK45 on the same right-hand side."""

from __future__ import annotations

from collections.abc import Iterator

from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice
from gearsim_sim import bench


def measure(_voice: Voice) -> Iterator[Figure]:
    """Real-time factor of the 34-DOF model at 4x with the filter, and its ratios to RK45 at rtol 1e-6.

    The peer's right-hand side is the model's readable numpy one, bearing by bearing; a second ratio is to
    RK45 on a right-hand side that was vectorised by hand as far as numpy goes.
    """
    factor = bench.engine_real_time_factor()
    peer = bench.rk45_real_time_factor()
    tuned = bench.rk45_real_time_factor(vectorised=True)
    yield Figure("sim.lpm34.rtf", factor, "x", Goal(">=", 12), ("scipy RK45 rtol 1e-6", peer))
    yield Figure("sim.lpm34.over_rk45", factor / peer, "x", Goal(">=", 400))
    yield Figure("sim.lpm34.over_tuned_rk45", factor / tuned, "x", Goal(">=", 100))
