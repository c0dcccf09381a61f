"""Evidence builds up over windows: averaged envelope spectra per channel, and their speed."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from gearsim_io.errors import InputError
from gearsim_io.nameplate import Machine
from numpy.typing import NDArray

from gearsim_dsp.bands import Band
from gearsim_dsp.noise_floor import effective_averages
from gearsim_dsp.speed import ShaftSpeed, nameplate_speed
from gearsim_dsp.speed_estimate import estimate_speed
from gearsim_dsp.window import WindowResult

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
    order_step: float
    turns: float
    averages: float
    windows: int
    axis_speed_hz: float
    first_sample: int
    end_sample: int


class _Channel:
    """Running sums of one channel; the layout (bands, axis) is the same for all windows in it."""

    def __init__(self, memory_windows: int | None) -> None:
        self.memory_windows = memory_windows
        self.layout: tuple[object, ...] = ()
        self.recent: deque[WindowResult] = deque(maxlen=memory_windows)
        self.clear()

    def clear(self) -> None:
        self.recent.clear()
        self.power: NDArray[np.float64] | None = None
        self.low: NDArray[np.float64] | None = None
        self.level = np.zeros(0)
        self.kurtosis = np.zeros(0)
        self.marks: list[tuple[int, float, float]] = []
        self.last: WindowResult | None = None

    def add(self, result: WindowResult) -> None:
        lines = result.low.power.size if result.low else 0
        bands = tuple(s.band for s in result.spectra)
        step = result.spectra[0].order_step if result.spectra else 0.0
        size = result.spectra[0].power.size if result.spectra else 0
        layout = (result.sample_rate_hz, result.sample_count, bands, step, size, lines)
        if layout != self.layout:
            self.clear()
            self.layout = layout
        if self.memory_windows is None:
            self._accumulate(result)
        else:
            self.recent.append(result)
            kept = list(self.recent)
            self.clear_sums()
            for item in kept:
                self._accumulate(item)
        self.last = result

    def clear_sums(self) -> None:
        self.power, self.low, self.marks = None, None, []

    def _accumulate(self, result: WindowResult) -> None:
        assert result.low is not None
        stack = [s.power for s in result.spectra]
        power = np.stack(stack).astype(np.float64) if stack else np.zeros((0, 0))
        level = np.array([s.level for s in result.spectra])
        kurtosis = np.array([s.kurtosis for s in result.spectra])
        low = result.low.power.astype(np.float64)
        if self.power is None or self.low is None:
            self.power, self.level, self.kurtosis, self.low = power, level, kurtosis, low
        else:
            self.power += power
            self.level += level
            self.kurtosis += kurtosis
            self.low += low
        self.marks.append((result.first_sample, result.turns, result.axis_speed_hz))


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
            if channel.power is None or channel.power.size == 0 or channel.last is None:
                continue
            found.append(self._averaged(name, channel, channel.last))
        return tuple(found)

    def _averaged(self, name: str, channel: _Channel, last: WindowResult) -> ChannelSpectra:
        assert channel.power is not None
        count = len(channel.marks)
        starts = np.array([m[0] for m in channel.marks], dtype=np.int64)
        return ChannelSpectra(
            name,
            tuple(s.band for s in last.spectra),
            channel.power / count,
            channel.level / count,
            channel.kurtosis / count,
            last.spectra[0].order_step,
            float(np.mean([m[1] for m in channel.marks])),
            _averages(starts, last.sample_count),
            count,
            float(np.mean([m[2] for m in channel.marks])),
            int(starts.min()),
            int(starts.max()) + last.sample_count,
        )

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


def _averages(starts: NDArray[np.int64], length: int) -> float:
    """Effective averages; for very many windows from the latest thousand, scaled up."""
    part = starts[-1000:]
    return effective_averages(part, length) * starts.size / part.size
