"""A speed that swings at random about its mean, as of a slack controller or an uneven drive."""

from __future__ import annotations

import copy
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gearsim_twin.causes.cause import Content, Parameter, Values
from gearsim_twin.causes.mesh_orders import finest_marks
from gearsim_twin.causes.prior import LogNormal

if TYPE_CHECKING:
    from gearsim_twin.causes.context import Context
    from gearsim_twin.view import View

__all__ = ["SpeedFluctuation", "Swing", "course_of", "swing_of"]

Array = NDArray[np.float64]

_STEP_S = 0.02
_WHITE_FROM = 0.35  # of the rate of the points
_MEDIAN = 0.693  # of an exponential variable
_LEAST = 1e-4  # of the speed
_OVER_MODEL = 2.0
_POINTS_PER_PERIOD = 6.0
_WAVES = 48
_MARGIN_S = 1.0
_LARGEST = 0.2
_BAND_HZ = (0.05, 15.0)


@dataclass(frozen=True, slots=True)
class Swing:
    """Rms over mean of the speed's random part, and the frequency up to which most of it lies."""

    relative: float
    relative_std: float
    bandwidth_hz: float


def swing_of(view: View) -> Swing | None:
    """The swing of the speed over a record; None without an angle or with fewer than 16 points.

    The slow course (a straight line) is no swing.
    """
    course = _course(view)
    if course is None:
        return None
    step_s, speed_hz = course
    if speed_hz.size < 16:
        return None
    mean = float(speed_hz.mean())
    place = np.arange(speed_hz.size)
    rest = speed_hz - np.polyval(np.polyfit(place, speed_hz, 1), place)
    window = np.hanning(rest.size + 2)[1:-1]
    power = np.abs(np.fft.rfft(rest * window)) ** 2 / (rest.size * np.sum(window**2))
    power[1:-1] *= 2
    frequency = np.fft.rfftfreq(rest.size, step_s)
    # What is white from point to point is the marks' and the torsion's, not the drive's.
    upper = power[frequency > _WHITE_FROM / step_s]
    power = np.maximum(power - float(np.median(upper)) / _MEDIAN, 0.0)
    inside = (frequency > 0) & (frequency <= min(_BAND_HZ[1], _WHITE_FROM / step_s))
    # Means over a step pass sinc(f step) of a swing.
    power = np.where(inside, power / np.sinc(frequency * step_s) ** 2, 0.0)
    rms = float(power.sum()) ** 0.5
    share = np.cumsum(power) / max(float(power.sum()), 1e-300)
    seconds = rest.size * step_s
    reached = min(int(np.searchsorted(share, 0.9)), frequency.size - 1)  # never, of a speed without a swing
    bandwidth = float(np.clip(frequency[reached], 1 / seconds, _BAND_HZ[1]))
    # Independent values in a record: two per period of the bandwidth.
    count = max(2.0 * bandwidth * seconds, 2.0)
    return Swing(rms / mean, rms / mean / math.sqrt(2 * count), bandwidth)


def _course(view: View) -> tuple[float, Array] | None:
    """Time step, and speed of the reference shaft as means over it, from the finest marks there are."""
    marks = finest_marks(view)
    if marks is None:
        return None
    rate, count = view.record.sample_rate_hz, view.record.sample_count
    per_second = (marks.samples.size - 1) / (marks.samples[-1] - marks.samples[0]) * rate
    step_s = max(_STEP_S, 2.0 / per_second)
    steps = int(count / rate / step_s)
    edges = np.linspace(marks.samples[0], marks.samples[-1], max(steps, 1) + 1)
    turns = np.interp(edges, marks.samples, marks.turns)
    step_s = float(edges[1] - edges[0]) / rate
    return step_s, np.diff(turns) / step_s


class SpeedFluctuation:
    """Random swings of the speed about its mean."""

    name = "speed_fluctuation"
    proven = True  # read off the marks of the shaft; few places have a level that tells of it
    parameters: tuple[Parameter, ...] = (
        Parameter("rms_relative", "1", LogNormal(3e-3, 4.0, 1e-6, _LARGEST)),
        Parameter("bandwidth_hz", "Hz", LogNormal(1.0, 3.0, *_BAND_HZ)),
    )
    confused_with: tuple[tuple[str, str], ...] = (
        ("load_fluctuation", "a torque transducer: a load that swings comes first, and the speed follows"),
        ("shaft_speed_offset", "a tacho over a longer time: an offset stays, swings come and go"),
    )

    def applies(self, context: Context) -> bool:
        """Where the angle is known."""
        return any(view.phase is not None for view in context.views)

    def starts(self, context: Context) -> list[dict[str, float | str]]:
        """The swing of all records together, where it exceeds what the model's speed does by itself."""
        swings, models = [], []
        for view, model in zip(context.views, context.simulated_views, strict=True):
            swing = swing_of(view)
            if swing is not None:
                swings.append(swing)
                own = swing_of(model)
                models.append(own.relative if own is not None else 0.0)
        if not swings:
            return []
        square = float(np.mean([s.relative**2 for s in swings]) - np.mean(np.square(models)))
        if square <= 0 or square**0.5 < max(_LEAST, _OVER_MODEL * float(np.mean(models))):
            return []
        bandwidth = float(np.median([s.bandwidth_hz for s in swings]))
        std = float(np.mean([s.relative_std for s in swings])) / len(swings) ** 0.5
        return [
            {
                "rms_relative": min(square**0.5, _LARGEST),
                "std:rms_relative": std,
                "bandwidth_hz": bandwidth,
                "std:bandwidth_hz": 0.3 * bandwidth,
            }
        ]

    def extend(self, content: Content, values: Values, context: Context) -> Content:
        """The content with a course of the speed in place of the constant one."""
        changed = copy.deepcopy(content)
        bandwidth = float(values["bandwidth_hz"])
        seconds = max(view.record.seconds for view in context.views) + _MARGIN_S
        profile = changed.setdefault("profile", {})
        trace = profile.get("trace")
        point = changed.get("operating_point", {})
        time_s = np.arange(0.0, seconds + 1.0 / bandwidth, 1.0 / (_POINTS_PER_PERIOD * bandwidth))
        if trace is not None and "columns" in trace:
            columns = trace["columns"]
            base = np.interp(time_s, columns["time_s"], columns["speed_hz"])
        else:
            base = np.full(time_s.size, _in_hz(point["speed"]))
        course = course_of(time_s, bandwidth)
        # The mean speed of the record is known; what swings is the rest.
        course -= float(np.mean(course[time_s <= seconds - _MARGIN_S]))
        swing = 1.0 + float(values["rms_relative"]) * course
        speed_hz = np.maximum(base * swing, 0.01 * base)
        profile["trace"] = {
            "columns": {
                "time_s": [float(f"{t:.9g}") for t in time_s],
                "speed_hz": [float(f"{v:.9g}") for v in speed_hz],
            },
            # A record is longer than the points only by what is left out of it.
            "max_gap": "1000 s",
        }
        point.pop("speed", None)
        return changed

    def signature(self, values: Values) -> str:
        """In plain words."""
        return (
            f"the speed swings by {100 * float(values['rms_relative']):.2g} % (rms) at up to "
            f"{float(values['bandwidth_hz']):.2g} Hz: lines are smeared, the more the higher their order"
        )


def course_of(time_s: Array, bandwidth_hz: float, seed: int = 1) -> Array:
    """A random course with mean square one and power alike up to the bandwidth: a sum of many waves."""
    draws = np.random.default_rng(seed)
    # Frequencies in equal parts of the band, one in each, so that every length of time sees all of it.
    frequency = bandwidth_hz * (np.arange(_WAVES) + draws.random(_WAVES)) / _WAVES
    phase = 2 * np.pi * draws.random(_WAVES)
    waves = np.cos(2 * np.pi * np.outer(time_s, frequency) + phase)
    return np.asarray(waves.sum(axis=1) * (2.0 / _WAVES) ** 0.5)


def _in_hz(speed: Any) -> float:
    """A speed as contents have it: a number with its unit, or the number alone."""
    if isinstance(speed, dict):
        return float(speed["value"]) / (60.0 if speed.get("unit") == "rpm" else 1.0)
    number, _, unit = str(speed).partition(" ")
    return float(number) / (60.0 if unit.strip() == "rpm" else 1.0)
