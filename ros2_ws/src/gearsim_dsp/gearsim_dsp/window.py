"""One channel over one window of samples: what goes in and what comes out of the analysis.

A monitor that streams windows works like this::

    speed = window_speed(window.pulses, n, sample_rate_hz, machine)          # speed.py
    results = [analyse_window(WindowInput(...)) for each channel]
    pool.add(results)                                                        # evidence.py
    findings = find_faults(machine, pool).findings                           # judges/bearing.py
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.bands import Band, BandPlan, plan_bands
from gearsim_dsp.envelope import (
    Envelopes,
    WindowSpectrum,
    both_spectra,
    order_spectrum,
    squared_envelopes,
)
from gearsim_dsp.quality import QualityIssue, check_samples
from gearsim_dsp.speed import Phase, ShaftSpeed
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["Band", "BandSpectrum", "LowSpectrum", "WindowInput", "WindowResult", "analyse_window"]


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
        Bands to demodulate beside the bank of `bands.plan_bands`, such as one given or the kurtogram's.
    between : bool
        Demodulate the bands centred on the borders of the bank's, too.
    spectra : callable, optional
        Gives `envelope.both_spectra` of the samples where others need them as well.
    """

    samples: NDArray[np.float32] | NDArray[np.float64]
    sample_rate_hz: float
    channel: str
    first_sample: int
    speed: ShaftSpeed
    machine: Machine
    bands: tuple[Band, ...] = ()
    between: bool = False
    spectra: Callable[[], tuple[WindowSpectrum, WindowSpectrum]] | None = None

    def __post_init__(self) -> None:
        where = f"channel {self.channel!r}"
        if self.samples.ndim != 1 or self.samples.size == 0:
            raise InputError(where, "samples", f"shape {self.samples.shape}", "a vector of samples")
        if not (np.isfinite(self.sample_rate_hz) and self.sample_rate_hz > 0):
            raise InputError(where, "sample_rate", self.sample_rate_hz, "a finite rate above 0 Hz")


@dataclass(frozen=True, slots=True, eq=False)
class BandSpectrum:
    """The squared envelope spectrum of one band over one window, in orders of the reference shaft.

    Parameters
    ----------
    band : Band
    order_step : float
        Line k is at k * `order_step`.
    power : ndarray of float32, shape (lines,)
        Of the squared envelope divided by its own mean, so without unit: a modulation of depth m gives
        m^2 / 4.
    level : float
        Mean square of the band's signal, in the signal's unit squared.
    kurtosis : float
        Excess kurtosis of the band's complex envelope, 0 for Gaussian noise.
    """

    band: Band
    order_step: float
    power: NDArray[np.float32]
    level: float
    kurtosis: float


@dataclass(frozen=True, slots=True, eq=False)
class LowSpectrum:
    """Power spectrum of the signal itself at low frequencies, line k at k * `step_hz` (for shaft and
    supply).
    """

    step_hz: float
    power: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class WindowResult:
    """All that is known of one channel after one window.

    Parameters
    ----------
    axis_speed_hz : float
        Speed that one order of the spectra stands for: the shaft's mean speed where its phase is known, else
        the nameplate's, so that all windows of a stream share an axis.
    turns : float
        Turns of the reference shaft behind each envelope spectrum, by that speed.
    quality : tuple of QualityIssue
        Why `spectra` is empty, if it is.
    spectra : tuple of BandSpectrum
    low : LowSpectrum or None
    """

    channel: str
    first_sample: int
    sample_count: int
    sample_rate_hz: float
    speed: ShaftSpeed
    axis_speed_hz: float
    turns: float
    quality: tuple[QualityIssue, ...]
    spectra: tuple[BandSpectrum, ...]
    low: LowSpectrum | None


def analyse_window(window: WindowInput) -> WindowResult:
    """Check the samples and make the squared envelope spectra of all bands.

    Notes
    ----- A window that cannot be judged (not finite, constant, too short, rate too low) gives no spectra
    and a fatal quality issue; nothing is raised for what a signal may bring.
    """
    issues = list(check_samples(window.samples, window.channel))
    speed = window.speed
    axis_speed = speed.value_hz
    plan: BandPlan | None = None
    if not any(issue.fatal for issue in issues):
        plan, more = plan_bands(window.samples.size, window.sample_rate_hz, axis_speed, window.machine)
        issues += [QualityIssue(issue, window.channel, detail, True) for issue, detail in more]
    spectra: tuple[BandSpectrum, ...] = ()
    low: LowSpectrum | None = None
    turns = float("nan")
    if not any(issue.fatal for issue in issues):
        made = window.spectra() if window.spectra else both_spectra(window.samples, window.sample_rate_hz)
        spectrum, clean = made
        low = _low_spectrum(spectrum)
        if plan is not None:
            spectra, turns = _spectra(clean, window, plan)
    return WindowResult(
        window.channel,
        window.first_sample,
        int(window.samples.size),
        window.sample_rate_hz,
        speed,
        axis_speed,
        turns,
        tuple(issues),
        spectra,
        low,
    )


def _low_spectrum(spectrum: WindowSpectrum) -> LowSpectrum:
    top = min(spectrum.lines.size - 1, round(4000.0 / spectrum.step_hz))
    lines = spectrum.lines[: top + 1]
    # Hann's window as its convolution with the lines, for clean neighbours of strong lines.
    hann = np.zeros(top, dtype=np.complex64)
    hann[1:] = lines[1:top] - np.float32(0.5) * (lines[: top - 1] + lines[2 : top + 1])
    power = (hann.real**2 + hann.imag**2) * np.float32(2.0 / spectrum.samples**2)
    return LowSpectrum(spectrum.step_hz, power)


def _spectra(
    clean: WindowSpectrum, window: WindowInput, plan: BandPlan
) -> tuple[tuple[BandSpectrum, ...], float]:
    phase = window.speed.phase or _steady_phase(window)
    bands = [*plan.bank, *(plan.between if window.between else ())]
    envelopes = [squared_envelopes(clean, np.array([b.low_hz for b in bands]), plan.width_hz)]
    for extra in window.bands:
        fitted = plan.fit(extra)
        bands.append(fitted)
        envelopes.append(squared_envelopes(clean, np.array([fitted.low_hz]), fitted.high_hz - fitted.low_hz))
    result: list[BandSpectrum] = []
    for block in envelopes:
        power = order_spectrum(block, phase, plan.top_order, plan.order_step).astype(np.float32)
        level, kurtosis = _moments(block)
        for row in range(power.shape[0]):
            band = bands[len(result)]
            result.append(
                BandSpectrum(band, plan.order_step, power[row], float(level[row]), float(kurtosis[row]))
            )
    return tuple(result), _turns(envelopes[0], phase)


def _steady_phase(window: WindowInput) -> Phase:
    last = float(max(window.samples.size - 1, 1))
    turns = last / window.sample_rate_hz * window.speed.value_hz
    return Phase(np.array([0.0, last]), np.array([0.0, turns]))


def _turns(envelopes: Envelopes, phase: Phase) -> float:
    ends = envelopes.first + envelopes.stride * np.array([0, envelopes.values.shape[1] - 1])
    low, high = np.interp(ends, phase.samples, phase.turns)
    return float(high - low)


def _moments(envelopes: Envelopes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    level = envelopes.values.mean(axis=1, dtype=np.float64)
    square = np.mean(envelopes.values**2, axis=1, dtype=np.float64)
    return level, square / np.maximum(level**2, np.finfo(np.float64).tiny) - 2.0
