"""Dropouts: stretches in which a channel shows nothing, its last value or the end of its range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.edit import with_sensor
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context

__all__ = ["Bursts", "Dropouts", "find_bursts"]

Shows = Literal["zero", "hold", "rail"]

_LEAST_RUN = 6  # equal samples; of a converter's codes that few in a row are common, see `_least_run`
_QUIET = 0.02  # of the usual short-time level: no vibration is interrupted like that
_QUIET_SAMPLES = 24
_RAIL = 0.999
_JUMP = 6.0  # of the usual distance of neighbours


@dataclass(frozen=True, slots=True)
class Bursts:
    """Dropouts of one channel: number, mean duration, rate, and what is shown meanwhile."""

    count: int
    rate_hz: float
    rate_std_hz: float
    duration_s: float
    duration_std_s: float
    shows: Shows


def find_bursts(samples: NDArray[np.floating], sample_rate_hz: float) -> Bursts | None:
    """Look for dropouts.

    Parameters
    ----------
    samples : ndarray, shape (n,)
    sample_rate_hz : float

    Returns
    -------
    Bursts or None
        None where no stretch is constant, or silent, for longer than the signal's own samples would be.

    Notes
    -----
    Lengths are exponential, so the mean length over the least that can be seen is the mean of all, and of
    those that are seen a part exp(-least / mean) is.
    """
    x = np.asarray(samples, dtype=np.float64)
    if x.size < 256 or not np.all(np.isfinite(x)) or np.ptp(x) == 0:
        return None
    moving = np.diff(x)
    step = float(np.sqrt(np.mean(moving[moving != 0] ** 2)))
    for runs, least in (_constant(x), _silent(x)):
        kept = [(start, stop) for start, stop in runs if not _rail_of_clipping(x, start, stop, step)]
        if kept:
            return _counted(x, kept, least, sample_rate_hz)
    return None


def _constant(x: NDArray[np.float64]) -> tuple[list[tuple[int, int]], int]:
    """Runs of equal samples that are longer than chance makes them."""
    same = np.diff(x) == 0
    least = _least_run(same)
    return [(a, b + 1) for a, b in _stretches(same) if b - a + 1 >= least], least


def _least_run(same: NDArray[np.bool_]) -> int:
    """Equal neighbours come with probability q by the converter's steps: (q^k n) below 1e-4.

    q is that outside the longest runs, so that dropouts do not hide themselves.
    """
    runs = np.array([b - a for a, b in _stretches(same)])
    short = int(np.sum(runs[runs < _LEAST_RUN])) if runs.size else 0
    q = max(short / max(same.size - (int(runs.sum()) - short if runs.size else 0), 1), 1e-6)
    # Neighbours of a slow signal are alike in numbers: q is taken as its square root, on the safe side.
    return max(_LEAST_RUN, int(np.ceil(np.log(1e-4 / same.size) / np.log(min(q**0.5, 0.99)))))


def _silent(x: NDArray[np.float64]) -> tuple[list[tuple[int, int]], int]:
    """Stretches whose quick changes vanish, as where noise comes in behind the loose contact."""
    level = uniform_filter1d(np.diff(x) ** 2, _QUIET_SAMPLES)
    usual = float(np.median(level))
    quiet = level < _QUIET**2 * usual
    half = _QUIET_SAMPLES // 2
    # Around silence the filter sees the signal on either side.
    return [(a - half, b + half) for a, b in _stretches(quiet) if b - a >= half], 2 * _QUIET_SAMPLES


def _stretches(at: NDArray[np.bool_]) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate(([False], at, [False])).astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _rail_of_clipping(x: NDArray[np.float64], start: int, stop: int, step: float) -> bool:
    """Whether a run at an extreme is a peak cut off: the signal comes to it, or leaves it, without a jump."""
    value = float(np.median(x[start:stop]))
    if value < _RAIL * x.max() and value > _RAIL * x.min():
        return False
    before = abs(x[max(start - 1, 0)] - value)
    after = abs(x[min(stop, x.size - 1)] - value)
    return bool(min(before, after) <= _JUMP * step)


def _counted(x: NDArray[np.float64], runs: Sequence[tuple[int, int]], least: int, rate_hz: float) -> Bursts:
    lengths = np.array([stop - start for start, stop in runs], dtype=np.float64)
    mean = max(float(np.mean(lengths)) - least, 0.25 * least, 1.0)
    seen = float(np.exp(-least / mean))
    free = max(x.size - float(lengths.sum()), 1.0) / rate_hz
    count = len(runs)
    rate = count / seen / free
    values = np.array([float(np.median(x[start:stop])) for start, stop in runs])
    top = max(float(x.max()), -float(x.min()))
    shows: Shows = "hold"
    if np.median(np.abs(values)) <= 1e-3 * float(np.std(x)):
        shows = "zero"
    elif np.all(np.abs(values) >= _RAIL * top):
        shows = "rail"
    relative = count**-0.5
    return Bursts(count, rate, rate * relative, mean / rate_hz, mean / rate_hz * relative, shows)


class Dropouts:
    """A loose cable, a worn slip ring, a telemetry link that fails now and then."""

    name = "dropouts"
    proven = True  # its finder has a false alarm rate of its own
    parameters: tuple[Parameter, ...] = (
        Parameter("rate_hz", "Hz", LogNormal(1.0, 5.0, 1e-3, 1000.0)),
        Parameter("duration_s", "s", LogNormal(5e-3, 4.0, 1e-5, 100.0)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("clipping", "the waveform itself: a peak cut off begins and ends at the limit"),
    )

    def applies(self, context: Context) -> bool:
        """Wherever there are accelerometers."""
        return bool(context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """One start per pattern of channels: those that have bursts."""
        found: dict[str, list[Bursts]] = {}
        for view, model in zip(context.views, context.simulated_views, strict=True):
            rate = view.record.sample_rate_hz
            for channel in view.record.channels:
                bursts = find_bursts(view.signal(channel), rate)
                own = find_bursts(model.signal(channel), rate) if channel in model.record.channels else None
                if bursts is not None and (own is None or own.rate_hz < 0.5 * bursts.rate_hz):
                    found.setdefault(channel, []).append(bursts)
        if not found:
            return []
        every = [one for bursts in found.values() for one in bursts]
        count = sum(one.count for one in every)
        mean_rate = sum(one.rate_hz * one.count for one in every) / count
        duration = sum(one.duration_s * one.count for one in every) / count
        start: dict[str, float | str] = {
            "rate_hz": mean_rate,
            "std:rate_hz": mean_rate * count**-0.5,
            "duration_s": duration,
            "std:duration_s": duration * count**-0.5,
            "shows": max(every, key=lambda one: one.count).shows,
            "component": ",".join(sorted(found)),
        }
        return [start]

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content with dropouts on the channels that have them."""
        shows = str(values["shows"])
        dropouts = {
            "rate": f"{float(values['rate_hz']):.9g} Hz",
            "duration": f"{float(values['duration_s']):.9g} s",
            "shows": shows,
        }
        for channel in str(values["component"]).split(","):
            content = with_sensor(content, channel, "dropouts", dropouts)
            if shows == "rail":
                top = max(
                    float(np.abs(view.signal(channel)).max())
                    for view in context.views
                    if channel in view.record.channels
                )
                content = with_sensor(content, channel, "range", f"{top:.9g} m/s^2")
        return content

    def signature(self, values: Values) -> str:
        """In plain words."""
        word = {"zero": "zero", "hold": "its last value", "rail": "the end of its range"}[
            str(values["shows"])
        ]
        return (
            f"{float(values['rate_hz']):.3g} times a second {values['component']} shows {word} for some "
            f"{1e3 * float(values['duration_s']):.2g} ms"
        )
