"""Synchronous averaging of 10 s at 65536 Hz beside what is commonly written for it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gearsim_bringup.bench.clock import alternate
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.tsa import shaft_average

SPEED_HZ, SWING = 10.0, 0.02


def figures(signal: NDArray[np.float64], rate_hz: float) -> Iterator[Figure]:
    """TSA with a tacho of one pulse per turn, from samples to the average."""
    seconds = np.arange(signal.size) / rate_hz
    turns = SPEED_HZ * (seconds + SWING / (2 * np.pi) * np.sin(2 * np.pi * seconds))
    pulses = np.interp(np.arange(int(turns[-1]) + 1), turns, np.arange(signal.size))
    phase = Phase(
        np.append(pulses, signal.size - 1.0), np.append(np.arange(pulses.size, dtype=float), turns[-1])
    )
    per_turn = int(rate_hz / SPEED_HZ)
    own, peer = alternate(
        lambda: shaft_average(signal, phase, samples_per_turn=per_turn).values,
        lambda: _plain_tsa(signal, phase, per_turn),
        3,
    )
    yield Figure("dsp.tsa_s", own, "s", Goal("<=", 1, on_ratio=True), ("scipy cubic splines", peer))


def _plain_tsa(signal: NDArray[np.float64], phase: Phase, per_turn: int) -> NDArray[np.float64]:
    """A spline through the tacho and one through the samples, which lets what lies above them fold."""
    grid = np.arange(int(phase.turns[-1]) * per_turn) / per_turn
    at = CubicSpline(phase.turns, phase.samples)(grid)
    return np.asarray(CubicSpline(np.arange(signal.size), signal)(at).reshape(-1, per_turn).mean(axis=0))
