"""Spectral correlation and coherence over all cyclic frequencies up to a highest one, by three FFTs per bin.

A random signal whose statistics repeat at the cyclic frequency a has correlated spectral lines a apart::

    S(a, f) = E[ X(f) X*(f - a) ],    g(a, f) = S(a, f) / sqrt(S(0, f) S(0, f - a)),   0 <= |g| <= 1

(Gardner, IEEE Trans. Inf. Theory 32 (1986) 197-200; Antoni, Mech. Syst. Signal Process. 21 (2007) 597-630;
fast algorithms: Antoni, Xin and Hamzaoui, Mech. Syst. Signal Process. 92 (2017) 248-277, Borghesani and
Antoni, ibid. 111 (2018) 113-118). The expectation is taken as the mean over the lines of a bin of width
`resolution_hz`. For all a at once that mean is a product in time: the bin, filtered out and shifted to zero,
times the conjugate of the same bin widened downwards by the highest cyclic frequency; its spectrum over a is
S. Nothing is approximated on the way: the result is the sum over lines to rounding, without the scalloping
of a scan in short-time spectra, and Cauchy and Schwarz hold |g| <= 1.

With the angle of a shaft the product is resampled at equal angles before its spectrum is taken: cyclic
frequencies in orders, carriers in Hz (order-frequency correlation: Abboud and Antoni, Mech. Syst. Signal
Process. 87 (2017) 400-415), so a changing speed does not smear.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.cyclic.coherence import CoherenceMap
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = ["TAPER_LOSS", "CyclicSpectrum", "cyclic_spectrum"]

Samples = NDArray[np.float32] | NDArray[np.float64]

TAPER_LOSS = 1.5
"""<w^4> / <w^2>^2 of the sine taper: averages of neighbouring lines count so much less than their number."""

_PADDING = 2
_LEAST_AVERAGES = 8.0
_MOST_VALUES = 1 << 24
_BATCH_VALUES = 1 << 18
_OVERSAMPLING = 4


@dataclass(frozen=True, slots=True, eq=False)
class CyclicSpectrum:
    """Spectral correlation of one signal; rows are carrier frequencies, columns cyclic frequencies.

    Parameters
    ----------
    correlation : ndarray of complex64 or complex128, shape (bins, alphas)
        One-sided density in the signal's unit squared per Hz: column 0 is the power spectral density, whose
        sum times `resolution_hz` is the signal's mean square.
    shifted_power : ndarray of float32 or float64, shape (bins, alphas)
        Power spectral density at f - a; 0 where that is below 0 Hz.
    resolution_hz : float
        Width of a bin; bin k covers [k, k + 1) * resolution_hz.
    alpha_step : float
        Column j is at the cyclic frequency j * `alpha_step`, half the resolution in it.
    alpha_unit : {"Hz", "order"}
    averages : float
        Independent averages behind each value: of stationary noise 1 - |g|^2 is distributed as
        U^(1 / (averages - 1)), U uniform.
    """

    correlation: NDArray[np.complexfloating]
    shifted_power: NDArray[np.floating]
    resolution_hz: float
    alpha_step: float
    alpha_unit: Literal["Hz", "order"]
    averages: float

    @property
    def frequency_hz(self) -> NDArray[np.float64]:
        """Centres of the bins, shape (bins,)."""
        return np.asarray((np.arange(self.correlation.shape[0]) + 0.5) * self.resolution_hz)

    @property
    def alpha(self) -> NDArray[np.float64]:
        """Cyclic frequencies in `alpha_unit`, shape (alphas,)."""
        return np.asarray(np.arange(self.correlation.shape[1]) * self.alpha_step)

    @property
    def power(self) -> NDArray[np.floating]:
        """Power spectral density, shape (bins,)."""
        return self.shifted_power[:, 0]

    def coherence(self) -> NDArray[np.complexfloating]:
        """Cyclic coherence g, shape (bins, alphas): the correlation without the spectrum's colour."""
        return np.asarray(self.correlation * np.sqrt(self._per_power()))

    def squared_coherence(self) -> NDArray[np.floating]:
        """|g|^2 in 0..1, shape (bins, alphas)."""
        c = self.correlation
        return np.asarray(np.minimum((c.real**2 + c.imag**2) * self._per_power(), 1.0))

    def _per_power(self) -> NDArray[np.floating]:
        """1 / (S(0, f) S(0, f - a)), 0 where there is no power."""
        product = self.power[:, np.newaxis] * self.shifted_power
        return np.asarray(np.divide(1.0, product, out=np.zeros_like(product), where=product > 0))

    def coherence_map(self) -> CoherenceMap:
        """The squared coherence with its law under noise, for envelope spectra."""
        reached = self.shifted_power[:, -1] > 0
        first = int(np.argmax(reached)) + 1 if np.any(reached) else reached.size - 1
        return CoherenceMap(
            self.squared_coherence(),
            self.resolution_hz,
            self.alpha_step,
            self.alpha_unit,
            self.averages,
            min(first, reached.size - 1),
        )


def cyclic_spectrum(
    samples: Samples,
    sample_rate_hz: float,
    resolution_hz: float,
    highest_alpha: float,
    phase: Phase | None = None,
    *,
    order_step: float | None = None,
) -> CyclicSpectrum:
    """Spectral correlation up to a highest cyclic frequency.

    Parameters
    ----------
    samples : ndarray of float32 or float64, shape (n,)
        Finite; its mean is taken out. float32 is computed in single precision, at twice the speed.
    sample_rate_hz : float
    resolution_hz : float
        Width of the bins of the carrier frequency: as wide as the resonances sought allow, since every value
        is a mean over `resolution_hz` * duration / 1.5 independent lines.
    highest_alpha : float
        In Hz or, with `phase`, in orders of the shaft.
    phase : Phase, optional
        Angle of the shaft over all samples.
    order_step : float, optional
        With `phase`, the distance of columns wanted, one over a whole number, so that records of different
        speed share the axis; at most half the resolution, which is the default.

    Returns
    -------
    CyclicSpectrum
        The resolution in the cyclic frequency is one over the duration (or over the turns).

    Raises
    ------
    InputError
        When the record is too short for the resolution (it says how long it must be), the cyclic frequency
        too high for the rate, or the result would hold more than 16 million values.
    """
    x = _checked(samples, sample_rate_hz, resolution_hz)
    turns = None if phase is None else _turns(phase, x.size)
    fastest = 1.0 if turns is None else _fastest(turns) * sample_rate_hz
    top = 0.5 * sample_rate_hz - resolution_hz
    if not 0 < highest_alpha * fastest <= top:
        expected = f"above 0 and at most {top / fastest:g} at this rate, resolution and speed"
        raise InputError("cyclic_spectrum", "highest_alpha", highest_alpha, expected)
    plan = _Plan.make(x.size, sample_rate_hz, resolution_hz, highest_alpha * fastest)
    span = x.size / sample_rate_hz if turns is None else float(turns[-1] - turns[0])
    if plan.bins * highest_alpha * _PADDING * span > _MOST_VALUES:
        expected = f"at most {_MOST_VALUES} values: a shorter stretch, wider bins or a lower highest_alpha"
        size = f"{plan.bins} bins x {highest_alpha * _PADDING * span:.0f} cyclic frequencies"
        raise InputError("cyclic_spectrum", "result", size, expected)
    lines = _lines(x, plan.padded)
    scale = x.dtype.type(4.0 / (x.size * sample_rate_hz * plan.width))
    if turns is None:
        step = shift_hz = sample_rate_hz / plan.padded
        correlation = _correlate(lines, plan, int(highest_alpha / step + 1e-9) + 1)
    else:
        step = _order_step(span, order_step)
        shift_hz = step * span / x.size * sample_rate_hz  # at the mean speed
        correlation = _correlate_in_angle(lines, plan, turns, step, int(highest_alpha / step + 1e-9) + 1)
    shifts = np.round(np.arange(correlation.shape[1]) * shift_hz * plan.padded / sample_rate_hz)
    return CyclicSpectrum(
        correlation * scale,
        _shifted_power(lines, plan, shifts.astype(np.intp)) * scale,
        resolution_hz=plan.width * sample_rate_hz / plan.padded,
        alpha_step=step,
        alpha_unit="Hz" if turns is None else "order",
        averages=plan.width / plan.padded * x.size / TAPER_LOSS,
    )


@dataclass(frozen=True, slots=True)
class _Plan:
    """Lengths in samples and in lines of the padded spectrum."""

    samples: int
    padded: int
    width: int
    bins: int
    reach: int

    @classmethod
    def make(cls, samples: int, rate_hz: float, resolution_hz: float, reach_hz: float) -> _Plan:
        padded = sfft.next_fast_len(_PADDING * samples, real=True)
        width = max(1, round(resolution_hz * padded / rate_hz))
        reach = int(np.ceil(reach_hz * padded / rate_hz))
        return cls(samples, padded, width, (padded // 2) // width, reach)

    @property
    def length(self) -> int:
        """Of the circular correlation, so that what wraps around falls beyond `reach`."""
        return int(sfft.next_fast_len(self.reach + self.width))

    def batches(self, length: int) -> list[slice]:
        """Bins taken at a time, so that a few rows stay in the processor's cache."""
        rows = max(1, _BATCH_VALUES // length)
        return [slice(first, min(first + rows, self.bins)) for first in range(0, self.bins, rows)]


def _checked(samples: Samples, rate_hz: float, resolution_hz: float) -> Samples:
    if not (np.isfinite(rate_hz) and rate_hz > 0 and 0 < resolution_hz <= 0.25 * rate_hz):
        expected = "a rate above 0 and a resolution of at most a quarter of it"
        raise InputError(
            "cyclic_spectrum", "sample_rate_hz, resolution_hz", (rate_hz, resolution_hz), expected
        )
    x = samples if samples.dtype in (np.float32, np.float64) else samples.astype(np.float64)
    if x.ndim != 1 or not np.all(np.isfinite(x)):
        raise InputError("cyclic_spectrum", "samples", f"shape {x.shape}", "a vector of finite values")
    if x.size == 0 or np.ptp(x) == 0:
        raise InputError("cyclic_spectrum", "samples", "a constant", "a signal that varies")
    least_s = _LEAST_AVERAGES * TAPER_LOSS / resolution_hz
    if x.size < least_s * rate_hz:
        expected = f"at least {least_s:.3g} s at a resolution of {resolution_hz:g} Hz"
        raise InputError("cyclic_spectrum", "duration", f"{x.size / rate_hz:.3g} s", expected)
    return x


def _turns(phase: Phase, samples: int) -> NDArray[np.float64]:
    if phase.samples[0] > 0.5 or phase.samples[-1] < samples - 1.5:
        covered = f"samples {phase.samples[0]:.1f} to {phase.samples[-1]:.1f}"
        raise InputError("cyclic_spectrum", "phase", covered, f"the angle over all {samples} samples")
    return np.asarray(np.interp(np.arange(samples), phase.samples, phase.turns))


def _fastest(turns: NDArray[np.float64]) -> float:
    """Highest turns per sample over hundredths of the record, which an encoder's jitter does not raise."""
    stretch = max(1, turns.size // 100)
    return 1.02 * float(np.max(np.diff(turns[::stretch]))) / stretch


def _order_step(span: float, wanted: float | None) -> float:
    if wanted is None:
        return 1.0 / sfft.next_fast_len(int(np.ceil(_PADDING * span)))
    lines = round(1.0 / wanted) if wanted > 0 else 0
    if lines < _PADDING * span or abs(lines * wanted - 1) > 1e-9:
        expected = f"one over a whole number, at most {1 / (_PADDING * span):.4g}"
        raise InputError("cyclic_spectrum", "order_step", wanted, expected)
    return wanted


def _lines(x: Samples, padded: int) -> NDArray[np.complexfloating]:
    """Lines of the signal under a sine taper, whose square, Hann's window, shapes the lines over alpha."""
    taper = np.sin(np.pi * (np.arange(x.size) + 0.5) / x.size)
    tapered = (x - np.mean(x, dtype=np.float64)) * taper
    lines: NDArray[np.complexfloating] = sfft.rfft(tapered.astype(x.dtype), n=padded)
    return lines


def _rows(
    lines: NDArray[np.complexfloating], plan: _Plan, chosen: slice, length: int
) -> NDArray[np.complexfloating]:
    """Product in time of each bin and the conjugate of its widened neighbourhood, shape (rows, length)."""
    count, reach, width = chosen.stop - chosen.start, plan.reach, plan.width
    narrow = np.zeros((count, length), dtype=lines.dtype)
    wide = np.zeros((count, length), dtype=lines.dtype)
    for row in range(count):
        first = (chosen.start + row) * width
        narrow[row, reach : reach + width] = lines[first : first + width]
        below = min(first, reach)  # nothing is below 0 Hz
        wide[row, reach - below : reach + width] = lines[first - below : first + width]
    narrow = sfft.ifft(narrow, axis=1, norm="forward", overwrite_x=True)
    narrow *= sfft.ifft(wide, axis=1, norm="forward", overwrite_x=True).conj()
    return narrow


def _correlate(lines: NDArray[np.complexfloating], plan: _Plan, alphas: int) -> NDArray[np.complexfloating]:
    """Sums over the lines of each bin of X(f) X*(f - a)."""
    out = np.empty((plan.bins, alphas), dtype=lines.dtype)
    for chosen in plan.batches(plan.length):
        product = _rows(lines, plan, chosen, plan.length)
        out[chosen] = sfft.fft(product, axis=1, norm="forward", overwrite_x=True)[:, :alphas]
    return out


def _correlate_in_angle(
    lines: NDArray[np.complexfloating], plan: _Plan, turns: NDArray[np.float64], step: float, alphas: int
) -> NDArray[np.complexfloating]:
    """As `_correlate`, with the product resampled at equal angles (cubic, from four times its bandwidth)."""
    length = int(sfft.next_fast_len(_OVERSAMPLING * plan.length))
    stride = plan.padded / length
    span = float(turns[-1] - turns[0])
    per_turn = sfft.next_fast_len(int(np.ceil(plan.samples / stride / span)))
    angles = (np.arange(int(span * per_turn)) + 0.5) / per_turn
    at = np.interp(turns[0] + angles, turns, np.arange(turns.size)) / stride
    left = np.maximum(at.astype(np.intp), 1)
    taps = _cubic(at - left).astype(lines.real.dtype)
    out = np.empty((plan.bins, alphas), dtype=lines.dtype)
    share = plan.samples / plan.padded / angles.size
    # The grid begins half a step late, which turns the phase of every cyclic frequency.
    turn = (share * np.exp(-1j * np.pi * step / per_turn * np.arange(alphas))).astype(lines.dtype)
    for chosen in plan.batches(length):
        product = _rows(lines, plan, chosen, length)
        resampled = sum(tap * product[:, left + k] for k, tap in enumerate(taps, start=-1))
        out[chosen] = sfft.fft(resampled, n=round(per_turn / step), axis=1)[:, :alphas] * turn
    return out


def _cubic(u: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of the points -1, 0, 1, 2 of Lagrange's cubic at u in 0..1, shape (4, points)."""
    return np.stack(
        [
            -u * (u - 1) * (u - 2) / 6,
            (u + 1) * (u - 1) * (u - 2) / 2,
            -(u + 1) * u * (u - 2) / 2,
            (u + 1) * u * (u - 1) / 6,
        ]
    )


def _shifted_power(
    lines: NDArray[np.complexfloating], plan: _Plan, shifts: NDArray[np.intp]
) -> NDArray[np.floating]:
    """Sums of |X(f - a)|^2 over the lines of each bin.

    Each is the end of one bin and the beginning of the next: two sums of squares, where a difference of
    running sums would drown what is weak in what is strong.
    """
    width, rows = plan.width, plan.bins * plan.width
    power = lines.real[:rows].astype(np.float64) ** 2 + lines.imag[:rows].astype(np.float64) ** 2
    bins = power.reshape(plan.bins, width)
    blocks, rest = np.divmod(shifts, width)
    empty = int(blocks.max()) + 1  # bins below 0 Hz
    begin, end = np.zeros((2, plan.bins + empty, width + 1))
    begin[empty:, 1:] = np.cumsum(bins, axis=1)
    end[empty:, :-1] = np.cumsum(bins[:, ::-1], axis=1)[:, ::-1]
    at = np.arange(plan.bins)[:, np.newaxis] + empty - blocks
    return np.asarray(begin[at, width - rest] + end[at - 1, width - rest], dtype=lines.real.dtype)
