"""One channel over one window of samples: what goes in and what comes out of the analysis.

The monitor that streams windows works like this::

    speed = window_speed(...)                       # speed.py: tacho, encoder, estimate or nameplate
    results = [analyse_window(WindowInput(...)) for each channel]
    pool.add(results)                               # evidence.py: EvidencePool averages over windows
    findings = pool.findings()                      # decide.py: which component, which fault, how sure
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from numpy.typing import NDArray

from gearsim_dsp.quality import QualityIssue
from gearsim_dsp.speed import ShaftSpeed

__all__ = ["Band", "BandSpectrum", "WindowInput", "WindowResult"]


@dataclass(frozen=True, slots=True)
class Band:
    """A frequency band in Hz, 0 < low < high; `why` tells who chose it, such as "kurtogram" or "bank"."""

    low_hz: float
    high_hz: float
    why: str = "given"


@dataclass(frozen=True, slots=True, eq=False)
class WindowInput:
    """One channel over one window without gaps.

    Parameters
    ----------
    samples : ndarray of float32 or float64, shape (n,)
        Any unit, offset allowed.
    sample_rate_hz : float
    channel : str
    first_sample : int
        Stream index of the first sample.
    speed : ShaftSpeed
        Of the reference shaft over this window.
    machine : Machine
        The nameplate.
    bands : tuple of Band
        Bands to demodulate; empty: the bank of bands of `bands.default_bands`.
    """

    samples: NDArray[np.float32] | NDArray[np.float64]
    sample_rate_hz: float
    channel: str
    first_sample: int
    speed: ShaftSpeed
    machine: Machine
    bands: tuple[Band, ...] = ()

    def __post_init__(self) -> None:
        where = f"channel {self.channel!r}"
        if self.samples.ndim != 1 or self.samples.size == 0:
            raise InputError(where, "samples", f"shape {self.samples.shape}", "a vector of samples")
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise InputError(where, "sample_rate", self.sample_rate_hz, "a finite rate above 0 Hz")


@dataclass(frozen=True, slots=True, eq=False)
class BandSpectrum:
    """The squared envelope spectrum of one band over one window, in orders of the reference shaft.

    `power` is float64 of shape (lines,): mean square per line of the squared envelope divided by its own
    mean, so it has no unit; line k is at k * `order_step`. `variance_share` is the part of the whole
    signal's mean square that the band holds.
    """

    band: Band
    order_step: float
    power: NDArray[np.float64]
    variance_share: float


@dataclass(frozen=True, slots=True, eq=False)
class WindowResult:
    """All that is known of one channel after one window.

    `spectra` is empty when the window cannot be judged (then `quality` says why). `kurtosis_by_band` has
    one value per spectrum: excess kurtosis of the band's complex envelope, 0 for Gaussian noise.
    """

    channel: str
    first_sample: int
    sample_count: int
    sample_rate_hz: float
    speed: ShaftSpeed
    quality: tuple[QualityIssue, ...]
    spectra: tuple[BandSpectrum, ...]
    kurtosis_by_band: tuple[float, ...]
