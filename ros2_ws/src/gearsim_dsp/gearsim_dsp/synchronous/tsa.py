"""Time-synchronous averages (TSA): what repeats with each turn of a shaft, or of a planet carrier.

The signal is sampled at equal angles of the shaft (`angle.resample.to_angle`) and its periods are averaged::

    a(phi) = 1/M sum_m x(phi + m P)

(McFadden, Mech. Syst. Signal Process. 1 (1987) 83-95). Lines at multiples of 1/P orders pass; of the power of
everything else 1/M is left on the average. Where there is no tacho the phase comes from `angle.tacholess`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.interpolate import CubicSpline

from gearsim_dsp.angle.resample import AngleSignal, full_rate, to_angle
from gearsim_dsp.speed import Phase
from gearsim_io.errors import InputError

__all__ = ["Average", "merged", "shaft_average", "synchronous_average", "synchronous_part"]

# The average is laid on a grid eight times as fine before a cubic spline goes through it: sixteen samples for
# the shortest wave it can hold, where the spline errs by (2 pi / 16)^4 / 720 = 3e-5 of the wave.
_FINER = 8


@dataclass(frozen=True, slots=True, eq=False)
class Average:
    """One period of what repeats.

    Parameters
    ----------
    values : ndarray of float64, shape (samples_per_turn * turns_per_period,)
        Read-only. Sample 0 is at a turn that is a whole multiple of `turns_per_period`.
    std : ndarray of float64, same shape
        Standard deviation of the single periods about the average, at each angle; the average itself is
        uncertain by std / sqrt(count).
    count : int
        Periods averaged, 2 or more.
    turns_per_period : int
    """

    values: NDArray[np.float64]
    std: NDArray[np.float64]
    count: int
    turns_per_period: int = 1

    def __post_init__(self) -> None:
        if self.values.ndim != 1 or self.values.size < 4 or self.std.shape != self.values.shape:
            got = f"shapes {self.values.shape} and {self.std.shape}"
            raise InputError("Average", "values, std", got, "two vectors of one length, 4 or more")
        if self.count < 2:
            raise InputError("Average", "count", self.count, "2 or more")
        if self.turns_per_period < 1 or self.values.size % self.turns_per_period:
            expected = f"a divisor of the length {self.values.size}"
            raise InputError("Average", "turns_per_period", self.turns_per_period, expected)
        self.values.flags.writeable = False
        self.std.flags.writeable = False

    @property
    def samples_per_turn(self) -> int:
        """Samples in one turn of the shaft."""
        return self.values.size // self.turns_per_period

    @property
    def turns(self) -> NDArray[np.float64]:
        """Turn of every sample, from 0."""
        return np.arange(self.values.size) / self.samples_per_turn

    @property
    def noise_rms(self) -> float:
        """Root mean square of what is random in `values`: that of the single periods over sqrt(count)."""
        return float(np.sqrt(np.mean(self.std**2) / self.count))

    def line(self, order: float) -> int:
        """Index of the spectral line at `order` (multiples of the averaged shaft's speed).

        Raises
        ------
        InputError
            When the order is not periodic in the average, or above its highest line.
        """
        index = order * self.turns_per_period
        if abs(index - round(index)) > 1e-6 * max(1.0, abs(index)):
            expected = f"a multiple of 1/{self.turns_per_period}, periodic in the average"
            raise InputError("Average", "order", order, expected)
        if not 0 <= round(index) < self.values.size / 2:
            expected = f"from 0 to below {self.samples_per_turn / 2:g}, half the samples per turn"
            raise InputError("Average", "order", order, expected)
        return round(index)

    def spectrum(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Orders and peak amplitudes of the lines, float64 of shape (samples // 2 + 1,) each."""
        lines = np.abs(sfft.rfft(self.values)) * (2.0 / self.values.size)
        lines[0] *= 0.5
        if self.values.size % 2 == 0:
            lines[-1] *= 0.5
        return np.arange(lines.size) / self.turns_per_period, lines


def synchronous_average(signal: AngleSignal, turns_per_period: int = 1) -> Average:
    """Average the whole periods of a signal.

    Parameters
    ----------
    signal : AngleSignal
        Sampled at equal angles of the shaft whose turns are averaged (`ratio` of `to_angle`).
    turns_per_period : int
        Turns after which the signal repeats: 1 for a gear, more for gears that meet again later.

    Returns
    -------
    Average

    Raises
    ------
    InputError
        When the signal holds fewer than two periods.
    """
    if turns_per_period < 1:
        raise InputError("synchronous_average", "turns_per_period", turns_per_period, "1 or more")
    length = signal.samples_per_turn * turns_per_period
    count = signal.values.size // length
    if count < 2:
        got = f"{signal.turn_count:.2f} turns"
        raise InputError("synchronous_average", "signal", got, f"{2 * turns_per_period} turns or more")
    periods = signal.values[: count * length].reshape(count, length)
    mean = periods.mean(axis=0)
    std = np.sqrt(np.sum((periods - mean) ** 2, axis=0) / (count - 1))
    start = round(signal.first_turn * signal.samples_per_turn) % length
    return Average(np.roll(mean, start), np.roll(std, start), count, turns_per_period)


def shaft_average(
    signal: NDArray[np.float32] | NDArray[np.float64],
    phase: Phase,
    *,
    ratio: float = 1.0,
    samples_per_turn: int | None = None,
    turns_per_period: int = 1,
) -> Average:
    """TSA of a signal sampled at equal times, for one shaft or planet carrier.

    Parameters
    ----------
    signal : ndarray, shape (n,)
    phase : Phase
        Angle of the reference shaft.
    ratio : float
        Speed of the averaged shaft over the reference shaft's (`Machine.shaft(name).ratio`), above 0.
    samples_per_turn : int, optional
        As many as lose nothing where the shaft is slowest, by default (rounded up for a fast FFT).
    turns_per_period : int
    """
    if samples_per_turn is None:
        samples_per_turn = int(sfft.next_fast_len(full_rate(phase, ratio=ratio), real=True))
    return synchronous_average(to_angle(signal, phase, samples_per_turn, ratio=ratio), turns_per_period)


def merged(first: Average, second: Average) -> Average:
    """The average of the periods of both, as if they had been averaged at once: averages of a stream grow so.

    Chan, Golub and LeVeque, The American Statistician 37 (1983) 242-247.
    """
    if first.values.size != second.values.size or first.turns_per_period != second.turns_per_period:
        got = f"{second.values.size} samples in {second.turns_per_period} turns"
        expected = f"{first.values.size} samples in {first.turns_per_period} turns"
        raise InputError("merged", "second", got, expected)
    count = first.count + second.count
    step = second.values - first.values
    values = first.values + step * (second.count / count)
    squares = (first.count - 1) * first.std**2 + (second.count - 1) * second.std**2
    squares += step**2 * (first.count * second.count / count)
    return Average(values, np.sqrt(squares / (count - 1)), count, first.turns_per_period)


def synchronous_part(
    average: Average, phase: Phase, sample_count: int, *, ratio: float = 1.0
) -> NDArray[np.float64]:
    """The average repeated along a record, to be subtracted from it: removes what one shaft brings.

    Parameters
    ----------
    average : Average
    phase : Phase
        Angle of the reference shaft over the record, from sample 0 to `sample_count` - 1.
    sample_count : int
    ratio : float
        Speed of the averaged shaft over the reference shaft's.

    Returns
    -------
    ndarray of float64, shape (sample_count,)
    """
    samples = np.arange(sample_count)
    if phase.samples[0] > 0 or phase.samples[-1] < sample_count - 1:
        got = f"samples {phase.samples[0]:g} to {phase.samples[-1]:g}"
        raise InputError("synchronous_part", "phase", got, f"0 to {sample_count - 1}")
    spline = CubicSpline(phase.samples, phase.turns) if phase.samples.size >= 4 else None
    turns = spline(samples) if spline is not None else np.interp(samples, phase.samples, phase.turns)
    fine = _FINER * average.values.size
    lines = sfft.rfft(average.values)
    if average.values.size % 2 == 0:
        lines[-1] *= 0.5  # Nyquist's line is shared by both signs, of which the finer grid tells one
    values = sfft.irfft(lines, fine) * _FINER
    place = np.mod(ratio * turns / average.turns_per_period, 1.0)
    wave = CubicSpline(np.arange(fine + 1) / fine, np.append(values, values[0]), bc_type="periodic")
    return np.asarray(wave(place))
