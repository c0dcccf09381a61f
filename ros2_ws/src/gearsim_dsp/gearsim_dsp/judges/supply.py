"""Orders that cannot be told from the electrical supply.

Orders move with the speed and the supply does not: over a record whose speed changes, a tone of the supply
averages out of the synchronous average. What is left of it in the line of an order is the share

    g = |mean over time of exp(2 pi i (f t - n theta(t)))|

of its amplitude, f the supply's frequency or a multiple of it, theta the shaft's angle in turns, n the order.
At constant speed and f = n times the speed that is all of it: the line may be the shaft's or the supply's.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.judges.measured import Measured

__all__ = ["supply_shares"]

Array = NDArray[np.float64]

_SUPPLIES_HZ = (50.0, 60.0)
_DRIFT = 0.002  # of a grid's frequency
_MOMENTS = 4096
_MOST_TRIALS = 400
_FAR_HZ = 5.0


def supply_shares(measured: Measured, orders: Array) -> Array:
    """Largest share of a supply's tone that the synchronous average over the record leaves in each order.

    Parameters
    ----------
    measured : Measured
        With its angle. A machine without a line frequency may stand beside 50 or 60 Hz.
    orders : ndarray, shape (n,)
        In turns of the reference shaft.

    Returns
    -------
    ndarray, shape (n,)
        From 0 to 1.
    """
    phase = measured.phase
    shares = np.zeros(len(orders))
    if phase is None:
        return shares
    at = np.linspace(phase.samples[0], phase.samples[-1], _MOMENTS)
    seconds = (at - at[0]) / measured.sample_rate_hz
    turns = np.interp(at, phase.samples, phase.turns)
    turns -= turns[0]
    speeds = np.gradient(turns[::64], seconds[::64])
    stated = measured.machine.line_frequency_hz
    for row, order in enumerate(orders):
        low, high = order * float(speeds.min()) - _FAR_HZ, order * float(speeds.max()) + _FAR_HZ
        for supply in (stated,) if stated > 0 else _SUPPLIES_HZ:
            for number in range(max(1, math.ceil(low / supply)), math.floor(high / supply) + 1):
                share = _share(number * supply, order * turns, seconds)
                shares[row] = max(float(shares[row]), share)
    return shares


def _share(line_hz: float, cycles: Array, seconds: Array) -> float:
    """Largest g of the frequencies that a grid's drift allows, in steps of half a resolution."""
    reach = _DRIFT * line_hz
    count = min(_MOST_TRIALS, 1 + 2 * math.ceil(2 * reach * float(seconds[-1])))
    trials = np.linspace(line_hz - reach, line_hz + reach, count)
    # One at a time: a table of trials and moments would not stay in the cache.
    return max(float(np.abs(np.mean(np.exp(2j * np.pi * (f * seconds - cycles))))) for f in trials)
