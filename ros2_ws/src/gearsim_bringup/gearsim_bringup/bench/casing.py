"""The flexible casing: its reduction, many modes in the loop, and frequency responses as a stream.

It takes minutes, most of them for the reductions and for RK45; reductions are kept below `.gearsim`.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from gearsim_bringup.bench import peers
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_bringup.ui import Voice
from gearsim_sim import bench, casing_bench

_RK45 = "scipy RK45 rtol 1e-6"
# The right-hand side with its thousand modes takes milliseconds, and RK45 must follow the fastest of them.
_RK45_S = {300: 1e-3, 1000: 2e-4}


def measure(voice: Voice) -> Iterator[Figure]:
    """Times are processor times; ROSS 2.3.0 is measured where its environment has been made (`--peers`)."""
    name = bench.casing_params(finite=False).casing.name
    with tempfile.TemporaryDirectory() as folder:
        seconds, memory_mb = casing_bench.reduce_seconds_and_mb(name, 100, Path(folder) / "casing.npz")
    yield Figure("casing.reduce_s", seconds, "s", Goal("<=", 40))
    yield Figure("casing.reduce_mb", memory_mb, "MB", Goal("<=", 1500))
    kept = Path(os.environ.get("GEARSIM_STATE", ".gearsim")) / "casings"
    for modes, goal in ((300, 3.0), (1000, 1.0)):
        params, taken_s = casing_bench.with_modes(modes, kept)
        if taken_s is not None and modes == 1000:
            yield Figure("casing.reduce_1000_s", taken_s, "s", Goal("<=", 240))
        factor = bench.casing_real_time_factor(params, seconds=0.1, repeats=5)
        plain = bench.rk45_real_time_factor(_RK45_S[modes], 1, params=params)
        yield Figure(f"casing.modes{modes}.rtf", factor, "x", Goal(">=", goal), (_RK45, plain))
    yield Figure("casing.responses.rtf", casing_bench.bank_real_time_factor(name), "x", Goal(">=", 8))
    yield from _ross(voice)


def _ross(voice: Voice) -> Iterator[Figure]:
    """How many times faster 146 degrees of freedom are than a gear pair of 156 in ROSS."""
    found = peers.ross_seconds_per_second()
    if found is None:
        voice.say("  (no ROSS 2.3.0: gearsim bench --only casing --peers installs and measures it)")
        return
    factor = bench.casing_real_time_factor(bench.casing_params(finite=False))
    baseline = (f"ROSS 2.3.0, {found['large_dof']:.0f} DOF", 1 / found["large_s"])
    yield Figure("casing.ross.cb146", factor, "x", Goal(">=", 8), baseline)
