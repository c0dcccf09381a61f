"""How much of a simulated signal is folded back from above the sampling rate, measured against a finer run.

A contact that opens or closes bends the force at once, so that the acceleration has energy far above any
sampling rate. What an integrator with too few steps per sample, or a sampler without a filter, makes of it
lies inside the band of interest and no later filter takes it out. The truth is the same machine integrated
with so many steps per sample that nothing of it matters, put through the same filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.integrate.decimate import PASS_BAND

Array = NDArray[np.float64]
TRUTH_OVERSAMPLING = 256


def alias_level_db(signal: Array, truth: Array, pass_band: float = PASS_BAND) -> Array:
    """Power of the difference of two signals' spectra within the band over that of the truth [dB].

    The difference holds all that is not truth: folded power, and the errors of the integration as well, so
    that this is an upper bound of the aliasing. Both signals are on one time axis, sample by sample.

    Parameters
    ----------
    signal, truth : ndarray, shape (..., n)
        At the same sampling rate; from an exact start on.
    pass_band : float
        Upper end of the band over the sampling rate; the default is that of the decimation filter, above
        which it lets some power fold.

    Returns
    -------
    ndarray, shape (...)
        10 log10 of the ratio of powers, Hann window over the whole length.
    """
    window = np.hanning(truth.shape[-1])
    inside = np.fft.rfftfreq(truth.shape[-1]) <= pass_band
    spectra = [np.fft.rfft(window * part)[..., inside] for part in (signal - truth, truth)]
    wrong, total = (np.sum(np.abs(part) ** 2, axis=-1) for part in spectra)
    return np.asarray(10 * np.log10(wrong / total))


def accelerations(
    params: Any,
    oversampling: int,
    *,
    seconds: float = 0.2,
    faults: Sequence[FaultSpec] = (),
    seed: int = 1,
    sample_rate_hz: float = 65536.0,
    speed_hz: float | None = None,
    load_nm: float | None = None,
) -> Array:
    """The accelerations of a machine's sites for `alias_level_db`, shape (sites, n).

    Everything but `oversampling` must be the same for the signal and for its truth, for which
    TRUTH_OVERSAMPLING is meant.
    """
    engine = Engine(params, seed, sample_rate_hz, oversampling, faults, speed_hz=speed_hz, load_nm=load_nm)
    return engine.advance(round(seconds * sample_rate_hz)).accel
