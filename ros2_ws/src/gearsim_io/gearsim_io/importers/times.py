"""The sampling rate that a column of times stands for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_io.errors import InputError

_TIME_TOLERANCE = 0.01


def rate_of_times(where: str, name: str, times_s: NDArray[Any]) -> float:
    """Sampling rate of a column of times.

    Raises
    ------
    InputError
        If the times are not evenly spaced.
    """
    times = np.asarray(times_s, dtype=np.float64)
    steps = np.diff(times)
    if steps.size == 0 or not np.all(np.isfinite(steps)):
        raise InputError(where, name, "no run of finite times", "at least two times in s")
    step_s = float((times[-1] - times[0]) / steps.size)
    # Printed with few digits, even times step by one or the other of two neighbouring last digits.
    spread_s = float(np.ptp(steps)) - 1.01 * _last_digit(times)
    if step_s <= 0 or spread_s > 2.0 * _TIME_TOLERANCE * step_s:
        worst = int(np.argmax(np.abs(steps - np.median(steps))))
        got = f"a step of {steps[worst]:.6g} s behind sample {worst}"
        raise InputError(where, name, got, f"even steps, such as {np.median(steps):.6g} s")
    return 1.0 / step_s


def _last_digit(times: NDArray[np.float64]) -> float:
    """Weight of the last decimal digit in which times are given; 0 if they have more than nine."""
    for digits in range(10):
        scaled = times * 10.0**digits
        if np.all(np.abs(scaled - np.round(scaled)) < 1e-4):
            return float(10.0**-digits)
    return 0.0
