"""Self-adaptive noise cancellation (SANC): a predictor that learns as the signal comes in.

The signal, a delay ago, passes an FIR filter whose weights follow the normalised least-mean-square rule,

    y[n] = sum_m w_m x[n - delay - m],   e[n] = x[n] - y[n],   w_m += step e[n] x[n - delay - m] / sum_m x^2

(Ho and Randall, Mech. Syst. Signal Process. 14 (2000) 763-788; Antoni and Randall, Mech. Syst. Signal
Process. 18 (2004) 89-101). Lines are foretold by y, the rest is e. It does what DRS does in one go over a
whole record, but sample by sample and following slow changes of speed and load.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gearsim_dsp.compiled import compiled
from gearsim_dsp.separation.checks import checked_count, checked_signal
from gearsim_io.errors import InputError

__all__ = ["SelfAdaptiveCanceller", "sanc"]


class SelfAdaptiveCanceller:
    """The filter and its memory; `push` samples in portions of any size, which do not change the result.

    Parameters
    ----------
    delay : int
        Samples between a sample and the newest one it is predicted from: longer than the memory of the
        random part.
    length : int
        Number of weights. Lines closer than about 1 / length of the sampling rate are not told apart; a line
        of amplitude A in white noise of variance v passes with the gain g / (1 + g), g = length A^2 / (4 v)
        (Zeidler et al., IEEE Trans. Acoust. Speech Signal Process. 26 (1978) 240-254).
    step : float
        Between 0 and 2: a line that makes up the share s of the power is learnt in about 2 / (step s)
        samples, and step / (2 - step) of the random part's power comes with the deterministic part.
    """

    __slots__ = ("_delay", "_held", "_step", "_weights")

    def __init__(self, delay: int, length: int, step: float = 0.01) -> None:
        where = "SelfAdaptiveCanceller"
        self._delay = checked_count(where, "delay", delay, 1)
        length = checked_count(where, "length", length, 1)
        if not 0.0 < step < 2.0:
            raise InputError(where, "step", step, "above 0 and below 2")
        self._step = float(step)
        self._weights = np.zeros(length)  # oldest sample first
        self._held = np.zeros(self._delay + length - 1)

    @property
    def weights(self) -> NDArray[np.float64]:
        """The weights now, w_0 first, shape (length,)."""
        return self._weights[::-1].copy()

    def push(self, samples: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Separate the next samples and go on learning.

        Parameters
        ----------
        samples : array_like, shape (n,)
            Finite, without mean, following those of the last call; before the first call all was 0.

        Returns
        -------
        deterministic, random : ndarray of float64, shape (n,)
            y and e above, in the signal's unit.
        """
        x = checked_signal("SelfAdaptiveCanceller.push", samples, 0)
        extended = np.concatenate((self._held, x))
        foretold = np.empty(x.size)
        _adapted(extended, self._weights, self._delay, self._step, foretold)
        self._held = extended[x.size :].copy()
        return foretold, x - foretold

    def forget_samples(self) -> None:
        """Take all past samples as 0 but keep the weights: for another pass, or after a gap."""
        self._held[:] = 0.0


def sanc(
    signal: ArrayLike, delay: int, length: int, step: float = 0.01, passes: int = 2
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Separate a whole signal by SANC.

    Parameters
    ----------
    signal : array_like, shape (n,)
        Finite samples, more than delay + length.
    delay, length, step
        See `SelfAdaptiveCanceller`.
    passes : int
        The weights learnt in one pass begin the next, whose result counts.

    Returns
    -------
    deterministic, random : ndarray of float64, shape (n,)
        In the signal's unit; their sum is the signal. The mean goes with the deterministic part.
    """
    canceller = SelfAdaptiveCanceller(delay, length, step)
    passes = checked_count("sanc", "passes", passes, 1)
    x = checked_signal("sanc", signal, delay + length + 1, "more than delay and length")
    mean = float(np.mean(x))
    for _ in range(passes):
        canceller.forget_samples()
        deterministic, random = canceller.push(x - mean)
    return deterministic + mean, random


@compiled
def _adapted(
    x: NDArray[np.float64],
    weights: NDArray[np.float64],
    delay: int,
    step: float,
    foretold: NDArray[np.float64],
) -> None:
    length = weights.size
    for n in range(foretold.size):
        past = x[n : n + length]
        value = 0.0
        power = 0.0
        for m in range(length):
            value += weights[m] * past[m]
            power += past[m] * past[m]
        foretold[n] = value
        if power > 0.0:
            factor = step * (x[n + length + delay - 1] - value) / power
            for m in range(length):
                weights[m] += factor * past[m]
