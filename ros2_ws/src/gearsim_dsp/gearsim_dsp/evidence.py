"""Evidence builds up over windows: averaged envelope spectra per channel, and their speed."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gearsim_dsp.bands import Band
from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.speed import ShaftSpeed, nameplate_speed
from gearsim_dsp.speed_estimate import estimate_speed
from gearsim_dsp.window import BandSpectrum, WindowResult
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine

__all__ = ["ChannelSpectra", "EvidencePool"]


@dataclass(frozen=True, slots=True, eq=False)
class ChannelSpectra:
    """Averaged spectra of one channel.

    Parameters
    ----------
    channel : str
    bands : tuple of Band
    power : ndarray of float64, shape (bands, lines)
        Averaged squared envelope spectra; line k at order k * `order_step`.
    level, kurtosis : ndarray of float64, shape (bands,)
        Mean over the windows of the bands' mean squares and excess kurtosis.
    whole : float
        Mean square of the signal below 4 kHz with all its lines, to compare levels with.
    order_step : float
    turns : float
        Mean number of turns behind each window: independent lines are 1 / turns apart.
    averages : float
        Independent averages behind `power`.
    windows : int
        Windows averaged.
    axis_speed_hz : float
        Speed that one order stands for, on average.
    first_sample, end_sample : int
        Stretch of the stream covered.
    """

    channel: str
    bands: tuple[Band, ...]
    power: NDArray[np.float64]
    level: NDArray[np.float64]
    kurtosis: NDArray[np.float64]
    whole: float
    order_step: float
    turns: float
    averages: float
    windows: int
    axis_speed_hz: float
    first_sample: int
    end_sample: int


class _Channel:
    """Running sums of one channel; the bank and the axis are the same for all windows in it.

    Further bands (given, or the kurtogram's) may come and go; those that not all windows have are left out.
    """

    def __init__(self, memory_windows: int | None) -> None:
        self.layout: tuple[object, ...] = ()
        self.memory_windows = memory_windows
        self.recent: deque[WindowResult] = deque(maxlen=memory_windows)
        self.last: WindowResult | None = None
        self._clear_sums()

    def _clear_sums(self) -> None:
        self.low: NDArray[np.float64] | None = None
        self.sums: dict[Band, _Sum] = {}
        self.marks: list[tuple[int, float, float]] = []

    def add(self, result: WindowResult) -> None:
        layout = _layout(result)
        if layout != self.layout:
            self.recent.clear()
            self._clear_sums()
            self.layout = layout
        if self.memory_windows is None:
            self._accumulate(result)
        else:
            self.recent.append(result)
            self._clear_sums()
            for item in self.recent:
                self._accumulate(item)
        self.last = result

    def _accumulate(self, result: WindowResult) -> None:
        assert result.low is not None
        low = result.low.power.astype(np.float64)
        self.low = low if self.low is None else self.low + low
        for spectrum in result.spectra:
            self.sums.setdefault(spectrum.band, _Sum()).add(spectrum)
        self.marks.append((result.first_sample, result.turns, result.axis_speed_hz))

    def complete(self) -> list[tuple[Band, _Sum]]:
        """The bands that all windows have, in the order of the latest."""
        bands = [s.band for s in self.last.spectra] if self.last else []
        return [(band, self.sums[band]) for band in bands if self.sums[band].count == len(self.marks)]


class _Sum:
    """Sums of one band over windows."""

    def __init__(self) -> None:
        self.count = 0
        self.power: NDArray[np.float64] = np.zeros(0)
        self.level = 0.0
        self.kurtosis = 0.0

    def add(self, spectrum: BandSpectrum) -> None:
        power = spectrum.power.astype(np.float64)
        self.power = power if self.count == 0 else self.power + power
        self.level += spectrum.level
        self.kurtosis += spectrum.kurtosis
        self.count += 1


def _layout(result: WindowResult) -> tuple[object, ...]:
    bank = tuple(s.band for s in result.spectra if s.band.why == "bank")
    step = result.spectra[0].order_step if result.spectra else 0.0
    lines = result.spectra[0].power.size if result.spectra else 0
    low = result.low.power.size if result.low else 0
    return result.sample_rate_hz, result.sample_count, bank, step, lines, low


class EvidencePool:
    """Averages the spectra of window after window, per channel.

    Parameters
    ----------
    machine : Machine
    memory_windows : int or None
        How many windows back the averages reach; None: all since the start (or since `reset`).
    """

    def __init__(self, machine: Machine, memory_windows: int | None = None) -> None:
        if memory_windows is not None and memory_windows < 1:
            raise InputError("EvidencePool", "memory_windows", memory_windows, "1 or more, or None for all")
        self.machine = machine
        self.memory_windows = memory_windows
        self._channels: dict[str, _Channel] = {}

    def reset(self) -> None:
        """Forget everything: the stream began anew or the operating point changed."""
        self._channels.clear()

    def add(self, results: Sequence[WindowResult]) -> None:
        """Take the results of one window, one per channel; those that could not be judged are left out."""
        for result in results:
            if result.low is not None:
                self._channels.setdefault(result.channel, _Channel(self.memory_windows)).add(result)

    def spectra(self) -> tuple[ChannelSpectra, ...]:
        """The averages of all channels that have envelope spectra."""
        found = []
        for name, channel in self._channels.items():
            bands = channel.complete()
            if bands and channel.last is not None:
                found.append(_averaged(name, channel, channel.last, bands))
        return tuple(found)

    def speed(self) -> ShaftSpeed:
        """Speed of the reference shaft over the windows held.

        From tacho or encoder where the latest windows have them (their mean), else estimated from the
        averaged low-frequency spectra of all channels, else the nameplate's.
        """
        held = [c for c in self._channels.values() if c.last is not None]
        if not held:
            return nameplate_speed(self.machine)
        last = held[0].last
        assert last is not None
        if last.speed.phase is not None:
            value = float(np.mean([m[2] for m in held[0].marks]))
            half = 0.5 * (last.speed.ci95_hz[1] - last.speed.ci95_hz[0])
            return ShaftSpeed(value, (value - half, value + half), last.speed.source, None, last.speed.note)
        assert last.low is not None
        same = [c for c in held if c.low is not None and c.layout == held[0].layout]
        power = [c.low / len(c.marks) for c in same if c.low is not None]
        starts = np.array([m[0] for m in held[0].marks], dtype=np.int64)
        averages = _averages(starts, last.sample_count)
        return estimate_speed(power, last.low.step_hz, averages, self.machine)


def _averaged(
    name: str, channel: _Channel, last: WindowResult, bands: list[tuple[Band, _Sum]]
) -> ChannelSpectra:
    count = len(channel.marks)
    starts = np.array([m[0] for m in channel.marks], dtype=np.int64)
    return ChannelSpectra(
        channel=name,
        bands=tuple(band for band, _ in bands),
        power=np.stack([total.power for _, total in bands]) / count,
        level=np.array([total.level for _, total in bands]) / count,
        kurtosis=np.array([total.kurtosis for _, total in bands]) / count,
        whole=float(np.sum(channel.low)) / count if channel.low is not None else 0.0,
        order_step=last.spectra[0].order_step,
        turns=float(np.mean([m[1] for m in channel.marks])),
        averages=_averages(starts, last.sample_count),
        windows=count,
        axis_speed_hz=float(np.mean([m[2] for m in channel.marks])),
        first_sample=int(starts.min()),
        end_sample=int(starts.max()) + last.sample_count,
    )


def _averages(starts: NDArray[np.int64], length: int) -> float:
    """Effective averages; for very many windows from the latest thousand, scaled up."""
    part = starts[-1000:]
    return effective_averages(part, length) * starts.size / part.size
