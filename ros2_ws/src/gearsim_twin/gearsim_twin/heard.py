"""A simulated record as the measuring chain would have it: with the noise that the records have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gearsim_twin.compare.chains import Nuisance
from gearsim_twin.view import View

__all__ = ["heard"]


def heard(view: View, chain: Nuisance, seed: int) -> View:
    """The view with Gaussian noise of the chain's floors on its channels; gains and bandwidths are left out.

    What is looked for between the lines of a spectrum must not take the sensors' noise for it.

    Parameters
    ----------
    view : View
        Simulated without noise.
    chain : Nuisance
        Its floors are power densities in dB of the unit squared per Hz.
    seed : int
    """
    record = view.record
    rng = np.random.default_rng([seed, 41])
    step_hz = record.sample_rate_hz / record.sample_count
    frequency_hz = step_hz * np.arange(record.sample_count // 2 + 1, dtype=np.float64)
    data = np.array(record.data)
    for row, channel in zip(data, record.channels, strict=True):
        # White noise of variance one has the one-sided density 2 / rate.
        shape = np.sqrt(0.5 * record.sample_rate_hz * chain.of(channel).floor(frequency_hz))
        white = np.fft.rfft(rng.standard_normal(record.sample_count))
        row += np.fft.irfft(white * shape, record.sample_count).astype(data.dtype)
    return View(replace(record, data=data), view.machine, view.speed, view.load_nm, view.issues)
