"""One view cut and transformed for the representations; everything is computed once, when it is asked for."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import fft as sfft

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.spectra import good_length
from gearsim_dsp.speed import Phase
from gearsim_twin.compare.frame import Frame
from gearsim_twin.compare.windows import WindowSpectra, cut, spectra_of
from gearsim_twin.view import View

__all__ = ["BandEnvelope", "Material"]

_TAPER = 0.02
_PER_ORDER = 2.6
_ENVELOPE_MARGIN, _PER_WAVE = 1.25, 6


class BandEnvelope:
    """Squared envelope of one band over time, low-passed to what is wanted of it.

    Attributes
    ----------
    values : ndarray of float64, shape (n,)
        Local mean square of the band, in the signal's unit squared; not negative but for ripple.
    times : ndarray of float64, shape (n,)
        Sample index of each.
    """

    def __init__(self, values: NDArray[np.float64], times: NDArray[np.float64]) -> None:
        self.values = values
        self.times = times


class Material:
    """What the representations share of one view.

    Parameters
    ----------
    view : View
    frame : Frame
    """

    def __init__(self, view: View, frame: Frame) -> None:
        self.view = view
        self.frame = frame
        self._kept: dict[tuple[object, ...], object] = {}

    @property
    def rate_hz(self) -> float:
        """Sampling rate."""
        return self.view.record.sample_rate_hz

    @cached_property
    def phase(self) -> Phase | None:
        """The view's angle, or that of a constant speed; None where no speed is known."""
        if self.view.phase is not None:
            return self.view.phase
        speed = self.view.speed_hz
        if not (math.isfinite(speed) and speed > 0):
            return None
        end = self.view.record.sample_count - 1.0
        return Phase(np.array([0.0, end]), np.array([0.0, end]) * speed / self.rate_hz)

    @cached_property
    def speed_hz(self) -> float:
        """Mean speed of the reference shaft over the record."""
        if self.phase is None:
            return math.nan
        turns = float(self.phase.turns[-1] - self.phase.turns[0])
        return turns / float(self.phase.samples[-1] - self.phase.samples[0]) * self.rate_hz

    def turns_at(self, samples: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn of the reference shaft at fractional sample indices."""
        assert self.phase is not None
        return np.asarray(np.interp(samples, self.phase.samples, self.phase.turns))

    def samples(self, channel: str) -> NDArray[np.float64]:
        """A channel without its mean."""
        key = ("samples", channel)
        if key not in self._kept:
            x = self.view.signal(channel)
            self._kept[key] = x - x.mean()
        return self._kept[key]  # type: ignore[return-value]

    def time_spectra(self, channel: str) -> WindowSpectra:
        """Spectra over time, in Hz."""
        key = ("time", channel)
        if key not in self._kept:
            x = self.samples(channel)
            length = good_length(min(x.size, max(64, round(self.frame.window_s * self.rate_hz))))
            self._kept[key] = spectra_of(cut(x, length), self.rate_hz / length)
        return self._kept[key]  # type: ignore[return-value]

    def order_spectra(self, channel: str, top_order: float) -> WindowSpectra:
        """Spectra over the reference shaft's angle up to `top_order`, in orders."""
        key = ("orders", channel, top_order)
        if key not in self._kept:
            assert self.phase is not None
            per_turn = int(sfft.next_fast_len(max(8, math.ceil(_PER_ORDER * top_order)), real=True))
            signal = to_angle(self.samples(channel), self.phase, per_turn)
            self._kept[key] = self.angle_spectra(signal.values, per_turn)
        return self._kept[key]  # type: ignore[return-value]

    def angle_spectra(self, values: NDArray[np.float64], per_turn: int, ratio: float = 1.0) -> WindowSpectra:
        """Spectra, in orders of the reference shaft, of a signal sampled at equal angles of a shaft.

        `ratio` is that shaft's speed over the reference shaft's.
        """
        length = min(values.size, math.floor(self.frame.window_turns * ratio * per_turn))
        length = good_length(max(64, length))
        return spectra_of(cut(values, length), ratio * per_turn / length)

    def lines(self, channel: str) -> NDArray[np.complex128]:
        """One-sided spectrum of the whole channel, tapered at its ends."""
        key = ("lines", channel)
        if key not in self._kept:
            x = self.samples(channel)
            self._kept[key] = sfft.rfft(x[: good_length(x.size)] * _tapered(good_length(x.size)))
        return self._kept[key]  # type: ignore[return-value]

    def analytic(self, channel: str, band_hz: tuple[float, float]) -> tuple[NDArray[np.complex128], float]:
        """Analytic signal of a band, shifted to zero, and its distance of samples in those of the record."""
        key = ("analytic", channel, band_hz)
        if key not in self._kept:
            lines = self.lines(channel)
            total = good_length(self.samples(channel).size)
            low, high = (round(edge * total / self.rate_hz) for edge in band_hz)
            part = lines[max(low, 1) : min(high, lines.size)]
            length = int(sfft.next_fast_len(2 * part.size))
            buffer = np.zeros(length, dtype=np.complex128)
            buffer[: part.size] = part
            z = sfft.ifft(buffer, overwrite_x=True) * (2.0 * length / total)
            self._kept[key] = (z, total / length)
        return self._kept[key]  # type: ignore[return-value]

    def band_power(
        self, channel: str, band_hz: tuple[float, float]
    ) -> tuple[NDArray[np.float64], float, float]:
        """Squared envelope at the full rate of the band, without the tapered ends.

        Also the sample index of its first value, and the distance of two values in samples.
        """
        z, stride = self.analytic(channel, band_hz)
        edge = math.ceil(_TAPER * z.size)
        z = z[edge : z.size - edge]
        return np.asarray(0.5 * (z.real**2 + z.imag**2)), edge * stride, stride

    def envelope(self, channel: str, band_hz: tuple[float, float]) -> BandEnvelope:
        """Squared envelope, low-passed above the highest order wanted, without the tapered ends."""
        key = ("envelope", channel, band_hz)
        if key not in self._kept:
            self._kept[key] = self._envelope(channel, band_hz)
        return self._kept[key]  # type: ignore[return-value]

    def _envelope(self, channel: str, band_hz: tuple[float, float]) -> BandEnvelope:
        z, stride = self.analytic(channel, band_hz)
        full = 0.5 * (z.real**2 + z.imag**2)
        total = good_length(self.samples(channel).size)
        top = self.frame.highest_envelope_order * self.speed_hz if self.frame.has_orders else 200.0
        # What is beyond would be folded down by the reading at equal angles. That reads linearly between
        # samples, seven for the highest wave, and so takes off sinc^2 of the frequency over their rate.
        kept = max(16, math.ceil(_ENVELOPE_MARGIN * top * total / self.rate_hz))
        length = int(sfft.next_fast_len(max(64, _PER_WAVE * kept), real=True))
        lines = sfft.rfft(full)[:kept]
        lines /= np.sinc(np.arange(lines.size) / length) ** 2
        full = np.asarray(sfft.irfft(lines, length), dtype=np.float64) * (length / full.size)
        stride = total / length
        edge = math.ceil(_TAPER * full.size)
        times = stride * np.arange(full.size, dtype=np.float64)
        return BandEnvelope(full[edge : full.size - edge], times[edge : full.size - edge])

    def envelope_spectra(self, channel: str, band_hz: tuple[float, float]) -> WindowSpectra:
        """Spectra of the squared envelope over the shaft's angle; each window divided by its mean."""
        key = ("envelope spectra", channel, band_hz)
        if key not in self._kept:
            windows, per_turn = self.envelope_windows(channel, band_hz)
            self._kept[key] = spectra_of(windows, per_turn / windows.shape[1])
        return self._kept[key]  # type: ignore[return-value]

    def envelope_windows(self, channel: str, band_hz: tuple[float, float]) -> tuple[NDArray[np.float64], int]:
        """Windows of the squared envelope over the angle, over their means, less 1; samples per turn."""
        envelope = self.envelope(channel, band_hz)
        turns = self.turns_at(envelope.times)
        per_turn = int(
            sfft.next_fast_len(math.ceil(_PER_ORDER * self.frame.highest_envelope_order), real=True)
        )
        grid = np.arange(math.ceil(turns[0] * per_turn), math.floor(turns[-1] * per_turn)) / per_turn
        values = np.interp(grid, turns, envelope.values)
        length = good_length(max(16, math.floor(min(self.frame.window_turns * per_turn, values.size))))
        windows = cut(values, length)
        weight = windows.mean(axis=1, keepdims=True)
        return windows / np.maximum(weight, np.finfo(np.float64).tiny) - 1.0, per_turn


def _tapered(size: int) -> NDArray[np.float64]:
    edge = max(1, math.ceil(_TAPER * size))
    rise = 0.5 - 0.5 * np.cos(np.pi * (np.arange(edge) + 0.5) / edge)
    taper = np.ones(size)
    taper[:edge] = rise
    taper[size - edge :] = rise[::-1]
    return taper
