"""Angles from encoders: line edges, sampled encoder waves, torsional vibration, transmission error.

An encoder with N lines is a carrier of N orders, phase-modulated by the shaft's torsion. Its edges are
that phase at whole cycles; a sampled wave is demodulated for it. Between two encoders the dynamic
transmission error of a gear pair is what the driven wheel lags behind the place that the teeth give it,

    e = theta_1 - theta_2 z_2 / z_1     (in the driving shaft's angle; times r_b1 on the line of action)

as in Sweeney and Randall, Proc. Inst. Mech. Eng. C 210 (1996) 223-235, who demodulate both encoders and
subtract.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.interpolate import CubicSpline

from gearsim_dsp.angle.resample import AngleSignal, sample_positions
from gearsim_dsp.speed import Phase, phase_from_pulses
from gearsim_io.errors import InputError
from gearsim_io.record import EdgeTrain

__all__ = [
    "TransmissionError",
    "angular_deviation",
    "encoder_phase",
    "line_errors",
    "phase_from_wave",
    "transmission_error",
    "without_line_errors",
]

_LEAST_WAVE_SAMPLES = 64
_WAVE_BAND = 0.5
_STEADY = 0.3
_FEWEST_SAMPLES_PER_LINE = 3.0
_RATIO_ERROR = 1e-3
_FEWEST_TURNS = 4


@dataclass(frozen=True, slots=True, eq=False)
class TransmissionError:
    """Dynamic transmission error over the driving shaft's angle, without its mean.

    Parameters
    ----------
    signal : AngleSignal
        In `unit`; positive where the driven wheel lags behind.
    unit : {"rad", "m"}
        Radians of the driving shaft, or metres along the line of action.
    mesh_order : int
        Of the mesh, in turns of the driving shaft: its teeth.
    """

    signal: AngleSignal
    unit: str
    mesh_order: int


def encoder_phase(edges: EdgeTrain, sample_count: int) -> Phase:
    """Angle of an encoder's own shaft from its line edges; lost and double edges are mended.

    Parameters
    ----------
    edges : EdgeTrain
    sample_count : int
        Length of the record; the angle covers all of it.

    Returns
    -------
    Phase
        Whole turns lie at edge 0 of the encoder, as far as `first_edge` tells.

    Raises
    ------
    InputError
        When there are fewer than two edges.
    """
    track = phase_from_pulses(edges.samples, float(edges.lines_per_revolution), sample_count)
    if track is None:
        raise InputError(f"encoder of {edges.shaft!r}", "edges", edges.samples.size, "two edges or more")
    first = np.interp(edges.samples[0], track.phase.samples, track.phase.turns)
    offset = edges.first_edge / edges.lines_per_revolution - first
    return Phase(track.phase.samples, track.phase.turns + offset)


def phase_from_wave(
    signal: NDArray[np.float32] | NDArray[np.float64],
    sample_rate_hz: float,
    lines_per_turn: float,
    speed_hz: float,
) -> Phase:
    """Angle of an encoder's shaft from its sampled wave (sine or pulses), by phase demodulation.

    Parameters
    ----------
    signal : ndarray, shape (n,)
        One cycle for each line; offset and harmonics of the carrier do no harm.
    sample_rate_hz : float
    lines_per_turn : float
    speed_hz : float
        Of the shaft, to about a quarter: the band from 0.5 to 1.5 times the carrier is demodulated.

    Returns
    -------
    Phase
        With a knot at each cycle, its zero at the first.

    Raises
    ------
    InputError
        When a line has fewer than three samples: its carrier would lie beyond half the rate.
    """
    x = np.asarray(signal, dtype=np.float64)
    if x.ndim != 1 or x.size < _LEAST_WAVE_SAMPLES or not math.isfinite(float(np.sum(x))):
        expected = f"a vector of {_LEAST_WAVE_SAMPLES} finite samples or more"
        raise InputError("phase_from_wave", "signal", f"shape {x.shape}", expected)
    carrier_hz = lines_per_turn * speed_hz
    if not 0 < carrier_hz <= sample_rate_hz / _FEWEST_SAMPLES_PER_LINE:
        expected = f"above {_FEWEST_SAMPLES_PER_LINE * carrier_hz:.4g} Hz for {carrier_hz:.4g} lines a second"
        raise InputError("phase_from_wave", "sample_rate", sample_rate_hz, expected)
    count = x.size
    padded = sfft.next_fast_len(count + count // 8, real=True)
    lines = sfft.fft(x - x.mean(), padded)
    frequency = np.arange(padded) * (sample_rate_hz / padded)
    away = np.abs(frequency - carrier_hz) / (_WAVE_BAND * carrier_hz)
    # Flat over the inner half, falling smoothly: the carrier's harmonics (from 2 on) are out.
    gain = np.where(away < 0.5, 1.0, np.where(away < 1.0, np.cos(np.pi * (away - 0.5)) ** 2, 0.0))
    analytic = sfft.ifft(lines * gain * (frequency < sample_rate_hz / 2))[:count]
    edge = max(4, round(2 * sample_rate_hz / carrier_hz))  # two cycles, where the wave begins and ends
    inner = np.arange(edge, count - edge)
    cycles = np.unwrap(np.angle(analytic[inner])) / (2 * np.pi)
    size = np.abs(analytic[inner])
    # Of noise one in a hundred amplitudes is below 0.12 of the median.
    steady = size.size > 1 and np.quantile(size, 0.01) > _STEADY * np.median(size)
    if not steady or np.any(np.diff(cycles) <= 0) or cycles[-1] - cycles[0] < 2:
        raise InputError("phase_from_wave", "signal", "no steady carrier", f"a wave of {carrier_hz:.4g} Hz")
    whole = np.arange(math.ceil(cycles[0]), math.floor(cycles[-1]) + 1)
    return Phase(np.interp(whole, cycles, inner), (whole - whole[0]) / lines_per_turn)


def angular_deviation(
    phase: Phase, samples_per_turn: int, *, ratio: float = 1.0, smooth_turns: float = 4.0
) -> AngleSignal:
    """Torsional vibration: how far a shaft is ahead of its own even rotation.

    Parameters
    ----------
    phase : Phase
        Knots closer than a turn (an encoder's).
    samples_per_turn : int
    ratio : float
        Speed of the shaft over that of `phase`.
    smooth_turns : float
        The even rotation is the angle smoothed over so many turns: what is slower is no vibration.

    Returns
    -------
    AngleSignal
        In radians of the shaft, over its angle.
    """
    end = math.floor(float(phase.samples[-1])) + 1
    at, first = sample_positions(phase, end, samples_per_turn, ratio=ratio)
    width = round(smooth_turns * samples_per_turn)
    if at.size < 2 * width:
        got = f"{at.size / samples_per_turn:.3g} turns"
        raise InputError("angular_deviation", "phase", got, f"{2 * smooth_turns:g} turns or more")
    turns = np.arange(at.size) / samples_per_turn
    even = _smoothed(at, width)
    # Where the shaft passes an angle later than evenly it lags behind: by its speed times the delay.
    speed = 1 / np.gradient(even, turns)
    return AngleSignal((even - at) * speed * 2 * np.pi, samples_per_turn, first)


def _smoothed(values: NDArray[np.float64], width: int) -> NDArray[np.float64]:
    """Convolved with a Hann window of `width` samples; straight lines stay straight up to the ends."""
    weights = np.hanning(width + 3)[1:-1]
    weights /= weights.sum()
    half = weights.size // 2
    # Odd continuation about the line through each end.
    head = 2 * values[0] - values[half:0:-1]
    tail = 2 * values[-1] - values[-2 : -half - 2 : -1]
    longer = np.concatenate((head, values, tail))
    length = sfft.next_fast_len(longer.size + weights.size, real=True)
    product = sfft.rfft(longer - longer[0], length) * sfft.rfft(weights, length)
    out = sfft.irfft(product, length)
    return np.asarray(out[2 * half : 2 * half + values.size] + longer[0])


def transmission_error(
    driving: Phase,
    driven: Phase,
    driving_teeth: int,
    driven_teeth: int,
    *,
    samples_per_turn: int,
    base_radius_m: float | None = None,
) -> TransmissionError:
    """Dynamic transmission error of a gear pair from the encoders of its two shafts.

    Parameters
    ----------
    driving, driven : Phase
        Angles of the two shafts, each in its own turns, on one sample clock.
    driving_teeth, driven_teeth : int
    samples_per_turn : int
        Of the driving shaft; with the encoder's number of lines nothing is interpolated on that side.
    base_radius_m : float, optional
        Base radius of the driving gear: the error is then in metres along the line of action.

    Returns
    -------
    TransmissionError

    Raises
    ------
    InputError
        When the two angles do not turn as the teeth say.

    Notes
    -----
    Errors of the encoders' lines and of their couplings are part of it, once in every turn of their own
    shaft; between wheels of unequal teeth they can be averaged out by the turns of the other one.
    """
    if min(driving_teeth, driven_teeth) < 1:
        raise InputError("transmission_error", "teeth", (driving_teeth, driven_teeth), "1 or more each")
    low = max(driving.samples[0], driven.samples[0])
    high = min(driving.samples[-1], driven.samples[-1])
    at, first = sample_positions(driving, math.floor(float(high)) + 1, samples_per_turn)
    keep = (at >= low) & (at <= high)
    first += int(np.argmax(keep)) / samples_per_turn
    at = at[keep]
    if at.size < 2 * samples_per_turn:
        got = f"{at.size / samples_per_turn:.3g} common turns"
        raise InputError("transmission_error", "driving, driven", got, "2 turns or more")
    turns = first + np.arange(at.size) / samples_per_turn
    other = CubicSpline(driven.samples, driven.turns)(at) * (driven_teeth / driving_teeth)
    drift = float((other[-1] - other[0]) / (turns[-1] - turns[0]))
    if abs(drift - 1) > _RATIO_ERROR:
        found = f"{drift * driving_teeth / driven_teeth:.6g} turns of the driven shaft in one of the driving"
        expected = f"{driving_teeth / driven_teeth:.6g} by {driving_teeth} and {driven_teeth} teeth"
        raise InputError("transmission_error", "driven", found, expected)
    error = (turns - other) * 2 * np.pi
    error -= error.mean()
    if base_radius_m is None:
        return TransmissionError(AngleSignal(error, samples_per_turn, first), "rad", driving_teeth)
    if not base_radius_m > 0:
        raise InputError("transmission_error", "base_radius_m", base_radius_m, "above 0 m")
    return TransmissionError(AngleSignal(error * base_radius_m, samples_per_turn, first), "m", driving_teeth)


def line_errors(pulse_samples: NDArray[np.float64], lines_per_turn: int) -> NDArray[np.float64]:
    """How far each line of a disc lies off its place, in turns, from the mean over many turns.

    Parameters
    ----------
    pulse_samples : ndarray of float64
        All pulses in order, none lost or doubled; four turns or more.
    lines_per_turn : int
        Two or more.

    Returns
    -------
    ndarray of float64, shape (lines_per_turn,)
        Of the line of the first pulse and those after it, with the mean 0. A line that comes late has a
        positive error.

    Notes
    -----
    What the shaft itself does once in a turn and its harmonics looks the same and is counted in: take the
    errors off only where that is small, such as for order tracking by a coarse disc.
    """
    size = pulse_samples.size
    if lines_per_turn < 2 or size < _FEWEST_TURNS * lines_per_turn + 1:
        expected = f"{_FEWEST_TURNS} turns of 2 lines or more"
        raise InputError("line_errors", "pulses", f"{size} pulses of {lines_per_turn} lines", expected)
    # Against the same line one turn before and after, which holds no error of the disc.
    every = np.arange(size) / lines_per_turn
    own = pulse_samples[::lines_per_turn]
    even = CubicSpline(own, every[::lines_per_turn])
    inside = pulse_samples <= own[-1]
    late = even(pulse_samples[inside]) - every[inside]
    whole = late.size // lines_per_turn * lines_per_turn
    errors = late[:whole].reshape(-1, lines_per_turn).mean(axis=0)
    return np.asarray(errors - errors.mean())


def without_line_errors(phase_turns: NDArray[np.float64], errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """The true angle at each pulse of a disc whose `line_errors` are known, in turns."""
    return phase_turns + errors[np.arange(phase_turns.size) % errors.size]
