"""Squared envelope spectra of one band, averaged over windows, as objects that can be asked for lines.

The spectrum of |z|^2 / <|z|^2>, z the analytic signal of the band (see `envelope`), over frequency or, where
the angle of a shaft is known, over its orders. Windows overlap by half.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.cyclic.modulation import ModulationSpectrum
from gearsim_dsp.envelope import (
    Envelopes,
    WindowSpectrum,
    envelope_spectrum,
    order_spectrum,
    squared_envelopes,
    suppress_lines,
    window_spectrum,
)
from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = ["squared_envelope_spectrum"]

_LEAST_TOP_LINES = 32
_ROUNDING = 2e-7  # of the greatest sample: what single precision leaves of a constant


def squared_envelope_spectrum(
    samples: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    band_hz: tuple[float, float],
    top: float,
    *,
    window_s: float | None = None,
    phase: Phase | None = None,
    limit_lines: bool = True,
) -> ModulationSpectrum:
    """Averaged squared envelope spectrum of a band.

    Parameters
    ----------
    samples : ndarray, shape (n,)
        Finite values.
    sample_rate_hz : float
    band_hz : tuple of float
        Given, or chosen such as by `band_choice.choose_band` or `envelopes_of_coherence.best_band`.
    top : float
        Highest frequency wanted in Hz or, with `phase`, order; the band must be wider than that in Hz.
    window_s : float, optional
        Length of the windows averaged; default: the whole signal is one window. Long windows tell close lines
        apart, many windows give a smooth floor.
    phase : Phase, optional
        Angle of a shaft over all samples: the axis is then orders of it.
    limit_lines : bool
        Limit discrete lines first (`suppress_lines`), which would beat in the envelope.

    Returns
    -------
    ModulationSpectrum
        A modulation 1 + m cos(.) of the squared envelope has m^2 / 4 at its line.

    Raises
    ------
    InputError
        When a window is too short to tell 32 lines up to `top`, or the band is too narrow or out of range.
    """
    x = samples if samples.dtype in (np.float32, np.float64) else samples.astype(np.float64)
    if x.ndim != 1 or not np.all(np.isfinite(x)):
        raise InputError("squared_envelope_spectrum", "samples", f"shape {x.shape}", "a finite vector")
    length = x.size if window_s is None else min(x.size, round(window_s * sample_rate_hz))
    turns = None if phase is None else np.interp(np.arange(x.size), phase.samples, phase.turns)
    speed = 1.0 if turns is None else float(turns[-1] - turns[0]) / x.size * sample_rate_hz
    width = band_hz[1] - band_hz[0]
    if not 0 < top * speed < width:
        expected = f"a band wider than the {top * speed:g} Hz wanted of the envelope"
        raise InputError("squared_envelope_spectrum", "band_hz", band_hz, expected)
    if length / sample_rate_hz * top * speed < _LEAST_TOP_LINES:
        expected = f"at least {_LEAST_TOP_LINES / (top * speed):.3g} s for lines up to {top * speed:g} Hz"
        raise InputError("squared_envelope_spectrum", "window", f"{length / sample_rate_hz:.3g} s", expected)
    starts = np.arange(0, x.size - length + 1, max(1, length // 2), dtype=np.int64)
    spectra = (window_spectrum(x[start : start + length], sample_rate_hz) for start in starts)
    envelopes = [_envelopes(spectrum, band_hz, limit_lines) for spectrum in spectra]
    _check_level(envelopes, float(np.max(np.abs(x))), band_hz)
    power, step = _over_frequency(envelopes) if turns is None else _over_orders(envelopes, starts, turns, top)
    lines = min(power.size, int(top / step) + 2)
    kept = envelopes[0].values.shape[1] * envelopes[0].stride  # the tapered ends are cut off
    return ModulationSpectrum(
        power[:lines],
        step,
        "Hz" if turns is None else "order",
        effective_averages(starts, round(kept)),
        (float(band_hz[0]), float(band_hz[1])),
        "SES",
    )


def _envelopes(spectrum: WindowSpectrum, band_hz: tuple[float, float], limit_lines: bool) -> Envelopes:
    clean = suppress_lines(spectrum) if limit_lines else spectrum
    return squared_envelopes(clean, np.array([band_hz[0]]), band_hz[1] - band_hz[0])


def _check_level(envelopes: list[Envelopes], peak: float, band_hz: tuple[float, float]) -> None:
    """A band that holds the rounding of the FFT alone has an envelope, but none that means anything."""
    level = min(float(one.values.mean(dtype=np.float64)) for one in envelopes)
    if level <= (_ROUNDING * peak) ** 2:
        found = f"rms {level**0.5:.2g} in {band_hz[0]:g} to {band_hz[1]:g} Hz"
        expected = f"a signal in that band, above {_ROUNDING * peak:.2g}"
        raise InputError("squared_envelope_spectrum", "samples", found, expected)


def _over_frequency(envelopes: list[Envelopes]) -> tuple[NDArray[np.float64], float]:
    spectra = [envelope_spectrum(one) for one in envelopes]
    return np.asarray(np.mean([power[0] for power, _ in spectra], axis=0)), spectra[0][1]


def _over_orders(
    envelopes: list[Envelopes], starts: NDArray[np.int64], turns: NDArray[np.float64], top: float
) -> tuple[NDArray[np.float64], float]:
    last = envelopes[0].first + envelopes[0].stride * (envelopes[0].values.shape[1] - 1)
    reach = np.array([envelopes[0].first, last])
    at = np.arange(turns.size, dtype=np.float64)
    spans = [float(np.diff(np.interp(start + reach, at, turns))[0]) for start in starts]
    step = 1.0 / sfft.next_fast_len(math.ceil(2 * max(spans)), real=True)
    # `order_spectrum` pads each window to one over its step, so all windows share the axis.
    spectra = []
    for start, one in zip(starts, envelopes, strict=True):
        phase = Phase(at[int(start) :] - float(start), turns[int(start) :])
        spectra.append(order_spectrum(one, phase, top + 2 * step, step)[0])
    return np.asarray(np.mean(spectra, axis=0)), step
