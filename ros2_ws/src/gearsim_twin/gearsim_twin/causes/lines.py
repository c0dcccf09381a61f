"""Narrow lines of a record that stand at fixed frequencies: how sure, how high, where exactly.

Lines of the machine move with its speed, those of electricity do not. A line is as improbable as its power
over the local floor says: of noise that ratio is exponential (one periodogram), so minus the logarithm of its
probability is the ratio itself.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft
from scipy.signal import resample_poly

from gearsim_dsp.noise_floor import local_floor
from gearsim_dsp.spectra import good_length

if TYPE_CHECKING:
    from gearsim_twin.view import View

Array = NDArray[np.float64]

_BLOCK_LINES = 256
_FIRST_LINE = 4  # the mean's leakage
_LEAST_ERROR = {"tacho": 2e-5, "encoder": 2e-5}  # of a mean speed counted over some seconds
_ESTIMATE_ERROR = 1e-3
_REACH_LINES = 1.0  # nearer than that two lines of one record are one
_TRIALS = 61
_PROJECTIONS = 3
_MOST_ORDERS = 600
_ABOUT, _SAME_LINE = 2, 1e-3
BESIDE, SKIRT = 25, 4  # lines: what lies beside one tells its noise
_NEIGHBOURS = 6.0  # lines: orders so near are fitted beside a sine


@dataclass(frozen=True, slots=True, eq=False)
class LineSpectrum:
    """One Hann-windowed spectrum of a whole record.

    Attributes
    ----------
    step_hz : float
        Distance of two lines.
    evidence : ndarray, shape (lines,)
        Power over the local floor: minus the logarithm of the probability that noise gives as much.
    amplitude : ndarray, shape (lines,)
        Of a sine at that line, in the unit of the signal.
    count : int
        Samples that were taken.
    """

    step_hz: float
    evidence: Array
    amplitude: Array
    count: int

    def at(self, frequency_hz: Array) -> Array:
        """Greatest evidence within one line of each frequency; 0 beyond the spectrum."""
        line = np.round(np.asarray(frequency_hz) / self.step_hz).astype(np.intp)
        inside = (line >= _FIRST_LINE) & (line < self.evidence.size - 1)
        safe = np.where(inside, line, 1)
        top = np.maximum(self.evidence[safe], np.maximum(self.evidence[safe - 1], self.evidence[safe + 1]))
        return np.asarray(np.where(inside, top, 0.0))

    def sine(self, samples: NDArray[np.floating], frequency_hz: float) -> tuple[Array, Array]:
        """Amplitudes of cosine and sine in the samples of this spectrum, and the inverse of their covariance.

        Noise of the power P in a line has the variance P / 2 in both.
        """
        x = np.asarray(samples[: self.count], dtype=np.float64)
        window = np.hanning(x.size + 1)[:-1]
        turning = np.exp(-2j * np.pi * frequency_hz / (self.step_hz * x.size) * np.arange(x.size))
        value = 2.0 * complex(np.sum(window * (x - x.mean()) * turning)) / float(window.sum())
        line = round(frequency_hz / self.step_hz)
        variance = 0.5 * float(self.amplitude[line]) ** 2 / max(float(self.evidence[line]), 1e-12)
        return np.array([value.real, -value.imag]), np.eye(2) / max(variance, 1e-300)

    def height(self, frequency_hz: float) -> float:
        """Amplitude of a sine between two lines: the Hann window's main lobe undone."""
        place = frequency_hz / self.step_hz
        line = round(place)
        off = place - line
        return float(self.amplitude[line] * (1.0 - off * off) / np.sinc(off))

    def peaks(self, least: float, low_hz: float = 0.0) -> tuple[Array, Array]:
        """Frequencies (interpolated) and evidence of local maxima with that evidence, greatest first."""
        e = self.evidence
        at = np.flatnonzero((e[1:-1] > e[:-2]) & (e[1:-1] >= e[2:]) & (e[1:-1] >= least)) + 1
        at = at[at * self.step_hz >= max(low_hz, _FIRST_LINE * self.step_hz)]
        left, mid, right = (np.log(np.maximum(e[at + k], 1e-12)) for k in (-1, 0, 1))
        curve = np.maximum(2 * mid - left - right, 1e-12)
        place = (at + np.clip(0.5 * (right - left) / curve, -0.5, 0.5)) * self.step_hz
        order = np.argsort(-e[at], kind="stable")
        return place[order], e[at][order]


def line_spectrum(samples: NDArray[np.floating], sample_rate_hz: float) -> LineSpectrum | None:
    """The spectrum of a record; None where it is too short (520 samples), constant or not finite."""
    count = good_length(int(samples.size))
    if count < 2 * (_BLOCK_LINES + _FIRST_LINE) or not np.all(np.isfinite(samples)):
        return None
    x = np.asarray(samples[:count], dtype=np.float64)
    x = x - x.mean()
    if not np.any(x):
        return None
    window = np.hanning(count + 1)[:-1]
    spectrum = np.abs(sfft.rfft(x * window))
    power = spectrum**2
    floor = local_floor(power, _BLOCK_LINES, 1.0, _FIRST_LINE)
    # Rounding of float32 samples is a floor of its own: what is below it is no line.
    floor = np.maximum(floor, 1e-14 * power.max())
    return LineSpectrum(sample_rate_hz / count, power / floor, 2.0 * spectrum / window.sum(), count)


@dataclass(frozen=True, slots=True)
class MachineLines:
    """Where lines of shafts and meshes lie: multiples of these fundamentals, within `error` (relative).

    `counted`: the angle of the shafts is known from marks on them.
    """

    fundamentals_hz: tuple[float, ...]
    error: float
    counted: bool = False

    def explain(self, frequency_hz: float, step_hz: float, doubtful: bool = True) -> bool:
        """Whether a line may be the machine's; `doubtful` is said where its lines lie too dense to tell."""
        for fundamental in self.fundamentals_hz:
            number = round(frequency_hz / fundamental)
            reach = self.error * frequency_hz + _REACH_LINES * step_hz
            if reach > 0.25 * fundamental:
                if doubtful and abs(frequency_hz - number * fundamental) < 0.25 * fundamental:
                    return True
            elif number >= 1 and abs(frequency_hz - number * fundamental) < reach:
                return True
        return False


def machine_lines(view: View) -> MachineLines:
    """The lines of the machine as it ran in a view."""
    ratios = sorted({abs(shaft.ratio) for shaft in view.machine.shafts if shaft.ratio})
    # A shaft at a whole multiple of a slower one adds nothing.
    kept: list[float] = []
    for ratio in ratios:
        if not any(abs(ratio / one - round(ratio / one)) < 1e-9 for one in kept):
            kept.append(ratio)
    speed, nominal = view.speed, view.machine.nominal_speed_hz
    speeds = [speed.value_hz] if np.isfinite(speed.value_hz) and speed.value_hz > 0 else []
    if speed.source in ("estimated", "nameplate") and np.isfinite(nominal) and nominal > 0:
        speeds.append(nominal)  # another shaft of the drive may run at just that
    if not speeds:
        return MachineLines((), 0.0)
    error = max(speed.relative_error, _LEAST_ERROR.get(speed.source, _ESTIMATE_ERROR))
    fundamentals = tuple(ratio * one for one in speeds for ratio in kept)
    return MachineLines(fundamentals, error, view.phase is not None and speed.source in _LEAST_ERROR)


@dataclass(frozen=True, slots=True, eq=False)
class SlowPart:
    """The part of a channel below some frequency, with the angle of the machine beside it.

    Attributes
    ----------
    signal : ndarray, shape (n,)
        Without its mean.
    sample_rate_hz : float
    turns : ndarray, shape (n,), or None
        Angle of the reference shaft.
    ratios : tuple of float
        Of the shafts to the reference shaft.
    """

    signal: Array
    sample_rate_hz: float
    turns: Array | None
    ratios: tuple[float, ...]

    def without_orders(self, top_hz: float) -> Array:
        """The signal without the shafts' whole orders up to a frequency; as it is where the angle lacks.

        Orders are projected out, weighted by a Hann window, and what neighbours left in each other by
        further projections: their leakage would cover weak lines beside them.
        """
        x = self.signal
        if self.turns is None:
            return x
        mean_hz = self._mean_hz()
        window = np.hanning(x.size + 1)[:-1]
        window /= window.sum()
        for ratio in self.ratios:
            count = min(int(top_hz / (ratio * mean_hz)) + 1, _MOST_ORDERS)
            spin = np.exp(2j * np.pi * ratio * self.turns)
            for _ in range(_PROJECTIONS):
                x = x - _projected(x, spin, count, window)
        return x

    def amplitude(self, frequency_hz: float) -> float:
        """Amplitude of a sine of that frequency, told apart from the shafts' orders beside it."""
        weight, orders, rest = self._beside(frequency_hz)
        solved, _ = _sine(self._turning(frequency_hz), weight, orders, rest)
        return float(np.hypot(*solved))

    def amplitude_std(self, frequency_hz: float, without_orders: Array) -> float:
        """Standard deviation of `amplitude`, by what lies beside the line and by the orders near it."""
        noise = self.line_noise(frequency_hz, without_orders)
        found, information = self.sine(frequency_hz, noise)
        along = found / max(float(np.hypot(*found)), 1e-300)
        return math.sqrt(float(along @ np.linalg.pinv(information) @ along))

    def sine(self, frequency_hz: float, noise: float) -> tuple[Array, Array]:
        """Amplitudes of cosine and sine beside the shafts' orders, and the inverse of their covariance.

        Parameters
        ----------
        frequency_hz : float
        noise : float
            Variance that the noise about that line would have, were it white: of `line_noise`. What orders
            and sine leave counts in its place where it is more: orders that swell are no noise, but hide a
            line as noise does.
        """
        weight, orders, left = self._beside(frequency_hz)
        plain = self._turning(frequency_hz)
        pair = weight[:, None] * plain
        pair = pair - orders @ (orders.T @ pair)
        solved, _ = _sine(plain, weight, orders, left)
        left = weight * (left - pair @ solved)
        near = float(np.mean([self._power(left, frequency_hz, k) for k in range(-_ABOUT, _ABOUT + 1)]))
        variance = max(noise, near / float(np.sum(weight**4)))
        spread = variance * (pair.T @ (weight[:, None] ** 2 * pair))
        normal = pair.T @ pair
        return solved, np.asarray(normal @ np.linalg.pinv(spread) @ normal)

    def line_noise(self, frequency_hz: float, without_orders: Array) -> float:
        """Variance of white noise as strong as what lies beside a line of `without_orders`."""
        window = np.hanning(self.signal.size + 2)[1:-1]
        sides = [*range(-BESIDE, -SKIRT), *range(SKIRT + 1, BESIDE + 1)]
        power = [self._power(window * without_orders, frequency_hz, k) for k in sides]
        return float(np.median(power)) / math.log(2.0) / float(np.sum(window**2))

    def _power(self, windowed: Array, frequency_hz: float, line: int) -> float:
        """Of a windowed signal, so many lines beside a frequency."""
        step = self.sample_rate_hz / self.signal.size
        return float(np.sum((windowed @ self._turning(frequency_hz + line * step)) ** 2))

    def share_beyond_orders(self, frequency_hz: float) -> float:
        """Share of one sine in all that the shafts' orders leave within some lines of it."""
        weight, orders, rest = self._beside(frequency_hz)
        _, explained = _sine(self._turning(frequency_hz), weight, orders, rest)
        step = self.sample_rate_hz / self.signal.size
        lines = [self._turning(frequency_hz + k * step) * weight[:, None] for k in range(-_ABOUT, _ABOUT + 1)]
        columns = np.concatenate(lines, axis=1)
        base, size, _ = np.linalg.svd(columns - orders @ (orders.T @ columns), full_matrices=False)
        base = base[:, size > _SAME_LINE * size[0]]
        return explained / max(float(np.sum((base.T @ rest) ** 2)), 1e-300)

    def refine(self, fundamental_hz: float, evidence: Mapping[int, float]) -> tuple[float, float]:
        """The fundamental of a few harmonic lines and its standard deviation, in Hz.

        Parameters
        ----------
        fundamental_hz : float
            Within 0.6 lines of the true one.
        evidence : mapping
            Of the lines, by order: power over the floor.

        Notes
        -----
        Least squares of sines beside the shafts' orders, each line's residual over its own floor. The
        standard deviation is the Cramer-Rao bound of a sine (Rife and Boorstyn, IEEE Trans. Inf. Theory 20
        (1974) 591-598) with the Hann window's loss: half a line over the root of sum k^2 z_k.
        """
        step = self.sample_rate_hz / self.signal.size
        trial = fundamental_hz + step * np.linspace(-0.6, 0.6, _TRIALS)
        total = np.zeros(trial.size)
        for order, worth in evidence.items():
            weight, orders, rest = self._beside(order * fundamental_hz)
            explained = np.array([_sine(self._turning(order * f), weight, orders, rest)[1] for f in trial])
            total += worth * explained / max(float(explained.max()), 1e-300)
        top = int(np.argmax(total))
        shift = 0.0
        if 0 < top < trial.size - 1:
            left, mid, right = total[top - 1 : top + 2]
            shift = float(np.clip(0.5 * (right - left) / max(2 * mid - left - right, 1e-300), -0.5, 0.5))
        worth = sum(order**2 * line for order, line in evidence.items())
        return float(trial[top] + shift * (trial[1] - trial[0])), 0.5 * step / max(worth, 1e-12) ** 0.5

    def _turning(self, frequency_hz: float) -> Array:
        phase = 2 * np.pi * frequency_hz / self.sample_rate_hz * np.arange(self.signal.size)
        return np.stack([np.cos(phase), np.sin(phase)], axis=1)

    def _beside(self, frequency_hz: float) -> tuple[Array, Array, Array]:
        """Weights, an orthonormal base of the orders within some lines, and the signal without these."""
        x = self.signal
        weight = np.sqrt(np.hanning(x.size + 2)[1:-1])
        columns = []
        if self.turns is not None:
            reach = _NEIGHBOURS * self.sample_rate_hz / x.size
            for ratio in self.ratios:
                fundamental = ratio * self._mean_hz()
                number = round(frequency_hz / fundamental)
                if number >= 1 and abs(number * fundamental - frequency_hz) < reach:
                    phase = 2 * np.pi * ratio * number * self.turns
                    columns += [weight * np.cos(phase), weight * np.sin(phase)]
        base = np.zeros((x.size, 0))
        if columns:
            left, size, _ = np.linalg.svd(np.stack(columns, axis=1), full_matrices=False)
            base = left[:, size > 1e-6 * size[0]]
        weighted = weight * x
        return weight, base, weighted - base @ (base.T @ weighted)

    def _mean_hz(self) -> float:
        assert self.turns is not None
        return float((self.turns[-1] - self.turns[0]) / (self.turns.size - 1) * self.sample_rate_hz)


def slow_part(view: View, channel: str, top_hz: float) -> SlowPart:
    """A channel below `top_hz`; its rate is 2.6 times that at least (or the record's)."""
    rate = view.record.sample_rate_hz
    factor = max(1, int(rate / (2.6 * top_hz)))
    x = view.signal(channel)
    x = x - x.mean()
    slow = resample_poly(x, 1, factor) if factor > 1 else x
    turns = None
    if view.phase is not None:
        turns = np.interp(np.arange(slow.size) * factor, view.phase.samples, view.phase.turns)
    ratios = tuple(sorted({abs(shaft.ratio) for shaft in view.machine.shafts if shaft.ratio}))
    return SlowPart(slow, rate / factor, turns, ratios)


def _projected(x: Array, spin: NDArray[np.complex128], count: int, window: Array) -> Array:
    """The part of a signal in the first multiples of a turning vector."""
    total = np.zeros(x.size)
    turned = np.ones(x.size, dtype=np.complex128)
    weighted = window * x
    for _ in range(count):
        turned = turned * spin
        total += 2.0 * np.real(np.vdot(turned, weighted) * turned)
    return total


def _sine(pair: Array, weight: Array, base: Array, rest: Array) -> tuple[Array, float]:
    """Amplitudes of cosine and sine in what orders leave, and the power that they explain."""
    pair = weight[:, None] * pair
    pair = pair - base @ (base.T @ pair)
    normal = pair.T @ pair
    # A sine that the orders beside it explain as well has no amplitude of its own.
    normal += 1e-6 * float(np.sum(weight**2)) * np.eye(2)
    product = pair.T @ rest
    solved: Array = np.asarray(np.linalg.solve(normal, product), dtype=np.float64)
    return solved, float(product @ solved)
