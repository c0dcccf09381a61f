"""Separation of 10 s at 65536 Hz: DRS and pre-whitening beside openconmo, linear prediction beside scipy."""

from __future__ import annotations

import contextlib
import io
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_toeplitz
from scipy.signal import lfilter

from gearsim_bringup.bench.clock import alternate, cpu_seconds
from gearsim_bringup.bench.figure import Figure, Goal
from gearsim_dsp.separation.cepstrum import prewhitened
from gearsim_dsp.separation.linear_prediction import ar_residual, kurtosis_by_length
from gearsim_dsp.separation.random_separation import drs

BLOCK, DELAY = 16384, 500  # Smith and Randall, Mech. Syst. Signal Process. 64-65 (2015) 100-131
AR_LENGTH = 100
LONGEST = 336  # a quarter of the distance of impacts at 48.8 Hz


def figures(signal: NDArray[np.float64]) -> Iterator[Figure]:
    """DRS, CPW, the AR residual, and the search for its length."""
    try:
        from openconmo import benchmark_methods as theirs
    except ImportError:  # a test oracle, absent where only the program is installed
        own = cpu_seconds(lambda: drs(signal, DELAY, BLOCK), 3)
        yield Figure("dsp.drs_s", own, "s", Goal("<=", 0.2, on_ratio=True))
        own = cpu_seconds(lambda: prewhitened(signal), 3)
        yield Figure("dsp.cpw_s", own, "s", Goal("<=", 1, on_ratio=True))
    else:
        with contextlib.redirect_stderr(io.StringIO()):  # its progress bar
            own, peer = alternate(
                lambda: drs(signal, DELAY, BLOCK), lambda: theirs.DRS(signal, BLOCK, DELAY), 1
            )
        yield Figure("dsp.drs_s", own, "s", Goal("<=", 0.2, on_ratio=True), ("openconmo 0.0.6", peer))
        own, peer = alternate(
            lambda: prewhitened(signal), lambda: theirs.cepstrum_prewhitening(signal, 1.0), 3
        )
        yield Figure("dsp.cpw_s", own, "s", Goal("<=", 1, on_ratio=True), ("openconmo 0.0.6", peer))
    own, peer = alternate(lambda: ar_residual(signal, AR_LENGTH), lambda: _plain_ar(signal, AR_LENGTH), 3)
    yield Figure("dsp.ar_s", own, "s", Goal("<=", 1, on_ratio=True), ("scipy Toeplitz + lfilter", peer))
    whole = cpu_seconds(lambda: kurtosis_by_length(signal, LONGEST), 3)
    one_at_a_time = own * LONGEST
    yield Figure(
        "dsp.ar_length_s",
        whole,
        "s",
        Goal("<=", 0.05, on_ratio=True),
        (f"one residual for each of {LONGEST} lengths", one_at_a_time),
    )


def _plain_ar(signal: NDArray[np.float64], length: int) -> NDArray[np.float64]:
    lines = np.fft.rfft(signal, 2 * signal.size)
    r = np.fft.irfft(np.abs(lines) ** 2)[: length + 1]
    return np.asarray(lfilter(np.concatenate(([1.0], -solve_toeplitz(r[:-1], r[1:]))), [1.0], signal))
