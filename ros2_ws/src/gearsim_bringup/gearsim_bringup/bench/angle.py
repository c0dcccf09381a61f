"""Angular resampling of 10 s at 65536 Hz beside what is commonly written for it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, make_interp_spline

from gearsim_bringup.bench.clock import alternate
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_dsp.angle.resample import full_rate, to_angle
from gearsim_dsp.speed import Phase

LOW_HZ, HIGH_HZ = 20.0, 25.0


def figures(signal: NDArray[np.float64], rate_hz: float) -> Iterator[Figure]:
    """From samples and one tacho pulse per turn, at rising speed, to as many samples at equal angles."""
    seconds = signal.size / rate_hz
    rise = (HIGH_HZ - LOW_HZ) / seconds
    whole = np.arange(0.0, np.floor((LOW_HZ + HIGH_HZ) / 2 * seconds))
    phase = Phase((np.sqrt(LOW_HZ**2 + 2 * rise * whole) - LOW_HZ) / rise * rate_hz, whole)
    per_turn = full_rate(phase)
    own, peer = alternate(
        lambda: to_angle(signal, phase, per_turn).values, lambda: _plain(signal, phase, per_turn), 3
    )
    yield Figure("dsp.resample_s", own, "s", Goal("<=", 0.3, on_ratio=True), ("scipy cubic splines", peer))


def _plain(signal: NDArray[np.float64], phase: Phase, per_turn: int) -> NDArray[np.float64]:
    """Splines through the tacho and through the samples; near half the rate they err by tens of percent."""
    grid = np.arange(int(phase.turns[-1]) * per_turn) / per_turn
    at = CubicSpline(phase.turns, phase.samples)(grid)
    return np.asarray(make_interp_spline(np.arange(signal.size), signal, 3)(at))
