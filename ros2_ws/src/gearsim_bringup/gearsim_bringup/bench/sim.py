"""How fast the physics runs on one core, beside scipy's RK45 on the same right-hand side, and ROSS."""

from __future__ import annotations

from collections.abc import Iterator

from gearsim_bringup.bench import peers
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice
from gearsim_sim import bench

_RK45 = "scipy RK45 rtol 1e-6"


def measure(voice: Voice) -> Iterator[Figure]:
    """Real-time factors at 4x with the filter, the ensemble, start-up and memory.

    The first peer's right-hand side is the model's readable numpy one, bearing by bearing; a second ratio is
    to RK45 on a right-hand side that was vectorised by hand as far as numpy goes. ROSS 2.3.0 is measured
    where its environment has been made (`bench --peers`).
    """
    factor = bench.engine_real_time_factor()
    plain = bench.rk45_real_time_factor()
    tuned = bench.rk45_real_time_factor(vectorised=True)
    yield Figure("sim.lpm34.rtf", factor, "x", Goal(">=", 15), (_RK45, plain))
    yield Figure("sim.lpm34.over_rk45", factor / plain, "x", Goal(">=", 400))
    yield Figure("sim.lpm34.over_tuned_rk45", factor / tuned, "x", Goal(">=", 100))
    double = bench.double_row_params()
    yield Figure(
        "sim.double_row24.rtf",
        bench.engine_real_time_factor(params=double),
        "x",
        Goal(">=", 8),
        (_RK45, bench.rk45_real_time_factor(params=double)),
    )
    planetary = bench.planetary_params()
    yield Figure(
        "sim.planetary18.rtf",
        bench.engine_real_time_factor(params=planetary),
        "x",
        Goal(">=", 25),
        (_RK45, bench.rk45_real_time_factor(params=planetary)),
    )
    yield from _casings()
    equal, own = (bench.ensemble_real_time_factor(own_matrices=own) for own in (False, True))
    yield Figure(
        "sim.ensemble.gearboxes_per_core", equal, "gearboxes", Goal(">=", 30), ("one engine", factor)
    )
    yield Figure(
        "sim.ensemble.own_matrices_per_core", own, "gearboxes", Goal(">=", 30), ("one engine", factor)
    )
    yield Figure("sim.startup_s", bench.startup_seconds(), "s", Goal("<=", 3))
    yield Figure("sim.memory_slope", bench.memory_slope_mb_per_minute(), "MB/min", Goal("<=", 0.5))
    yield from _ross(voice, factor)


def _casings() -> Iterator[Figure]:
    """The gearbox in its flexible casing, one accelerometer on it and eight bearing forces put out."""
    for name, finite in (("cb146", False), ("cb182", True)):
        params = bench.casing_params(finite=finite)
        factor, plain = bench.casing_real_time_factor(params), bench.rk45_real_time_factor(params=params)
        yield Figure(f"sim.{name}.rtf", factor, "x", Goal(">=", 8), (_RK45, plain))
    params = bench.casing_params(finite=False)
    yield Figure("sim.alias_db.cb146_4x", bench.casing_alias_db(params, 4), "dB", Goal("<=", -70))
    yield Figure(
        "sim.alias_db.cb146_8x",
        bench.casing_alias_db(params, 8),
        "dB",
        Goal("<=", -80),
        ("2 steps per sample", bench.casing_alias_db(params, 2)),
    )


def _ross(voice: Voice, factor: float) -> Iterator[Figure]:
    """How many times faster the 34-DOF gearbox is than a gear pair of 36 degrees of freedom in ROSS."""
    found = peers.ross_seconds_per_second()
    if found is None:
        voice.say("  (no ROSS 2.3.0: gearsim bench --only sim --peers installs and measures it)")
        return
    for name, key in (("constant_mesh", "constant_s"), ("varying_mesh", "varying_s")):
        baseline = (f"ROSS 2.3.0, {found['dof']:.0f} DOF", 1 / found[key])
        yield Figure(f"sim.ross.over_{name}", factor * found[key], "x", Goal(">=", 1), baseline)
