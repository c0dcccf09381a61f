"""Sampling: from the rate at which the sensors work to that of the samples, with or without a filter.

Delta-sigma converters sample far above the output rate and decimate with a linear-phase FIR: flat up to
0.45 of the output rate, shut from 0.55 on (figures of the NI 9234: pass band 0.45 fs, stop band 0.55 fs,
100 dB), so that what folds lands above 0.45 only. Here the model hands out `oversampling` times the samples,
all analogue effects act on them, and the filter decimates; its delay is removed, as such converters'
drivers do. Without the filter the samples between are simply dropped, and everything above half the
output rate folds: the signal as well as noise, interference and the mounting's resonance.

At oversampling 1 the model's own filter has done that (80 dB from 0.55 on); there is nothing left to fold.
"""

from __future__ import annotations

import math
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gearsim_io.quantities import Si, Strict

Array = NDArray[np.float64]


class Sampling(Strict):
    """How the converter samples: the sensors work at `oversampling` times the sample rate."""

    oversampling: Annotated[int, Field(ge=1, le=16)] = 1
    """Samples that the sensors work with per sample that goes out; above 1 the analogue effects act at
    that rate."""
    antialias: Literal["delta_sigma", "none"] = "delta_sigma"
    """What stands before the samples are taken: the filter of a delta-sigma converter, or none (then all
    above half the sample rate folds)."""
    pass_band: Annotated[float, Si("", ge=0.1, le=0.5)] = 0.45
    """Up to where the filter is flat, in parts of the sample rate (NI 9234: 0.45)."""
    stop_band: Annotated[float, Si("", ge=0.45, le=0.9)] = 0.55
    """From where on the filter is shut, in parts of the sample rate (NI 9234: 0.55)."""
    rejection_db: Annotated[float, Si("", ge=40, le=140)] = 100.0
    """How far the filter is down beyond the stop band, and its ripple below the pass band, in dB (NI 9234:
    100)."""

    @model_validator(mode="after")
    def _sensible(self) -> Sampling:
        if self.antialias == "none" and self.oversampling == 1:
            raise ValueError("an oversampling of 2 or more, or nothing is there to fold (antialias: none)")
        if self.stop_band < self.pass_band + 0.02:
            raise ValueError("a stop_band above the pass_band by 0.02 at least")
        return self


def filter_taps(sampling: Sampling) -> Array:
    """Taps at the sensors' rate, an odd number of them with the sum one; a single one where none is needed.

    A Kaiser-windowed sinc (Kaiser 1974) with the wanted rejection between pass and stop band.
    """
    k = sampling.oversampling
    if k == 1 or sampling.antialias == "none":
        return np.ones(1)
    width = 2 * math.pi * (sampling.stop_band - sampling.pass_band) / k
    half = math.ceil((sampling.rejection_db - 7.95) / (2.285 * width) / 2)
    beta = _kaiser_beta(sampling.rejection_db)
    cut = (sampling.pass_band + sampling.stop_band) / k
    taps = np.sinc(cut * np.arange(-half, half + 1)) * np.kaiser(2 * half + 1, beta)
    return np.asarray(taps / taps.sum())


def _kaiser_beta(rejection_db: float) -> float:
    if rejection_db > 50:
        return 0.1102 * (rejection_db - 8.7)
    return float(0.5842 * (rejection_db - 21) ** 0.4 + 0.07886 * (rejection_db - 21))


class Decimator:
    """From the sensors' rate to the sample rate, with state.

    Attributes
    ----------
    half : int
        Samples at the sensors' rate that it looks ahead of an output sample.
    """

    def __init__(self, sampling: Sampling, channels: int) -> None:
        self.factor = sampling.oversampling
        self._taps = filter_taps(sampling)
        self.half = self._taps.size // 2
        self._kept = np.zeros((channels, self.half))
        self._begin = -self.half  # index of the first sample kept

    @property
    def end(self) -> int:
        """Index of the next sample at the sensors' rate that it wants."""
        return self._begin + self._kept.shape[1]

    def wanted(self, first_sample: int, count: int) -> int:
        """Index up to which it must be fed for these output samples."""
        return self.factor * (first_sample + count - 1) + self.half + 1

    def take(self, block: Array, first_sample: int, count: int) -> Array:
        """Take the samples from `end` to `wanted` and give the output samples."""
        from gearsim_sim.sensors.loops import decimate_rows

        signal = np.concatenate([self._kept, block], axis=1) if self._kept.shape[1] else block
        out = np.empty((signal.shape[0], count))
        start = self.factor * first_sample - self.half - self._begin
        decimate_rows(signal, start, self.factor, self._taps, out)
        keep = self.factor * (first_sample + count) - self.half - self._begin
        keep = min(keep, signal.shape[1])
        self._begin += keep
        self._kept = signal[:, keep:].copy()
        return out
