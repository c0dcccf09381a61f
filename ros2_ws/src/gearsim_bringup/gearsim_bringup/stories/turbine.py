"""Wind turbine: a speed that falls through the record, and the teeth that fit its orders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_bringup.stories.views import learnt_and_held_out, view_at
from gearsim_dsp.angle.resample import AngleSignal
from gearsim_twin.view import View

__all__ = ["RECORD", "Turbine", "draw", "family_db", "tell"]

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
_CHANNEL, _PER_TURN = "accel", 512
# The stage before has a pinion of 21 teeth on the shaft of the wheel in question, by the author's code.
_PINION, _MESH = 21, 22
_WHEELS = tuple(range(90, 141))
_MULTIPLES, _HALF_WIDTH = 6, 0.03

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Turbine:
    """What the record tells.

    Attributes
    ----------
    time_s, speed_hz : ndarray, shape (n,)
        Course of the speed.
    mesh_db : float
        By how much the line of the mesh is higher over the angle than over time, on the last third.
    wheels : tuple of int
    learnt_db, held_out_db : ndarray, shape (wheels,)
        Mean height of six multiples of the family that each number of teeth predicts, over the orders beside
        them, on two thirds and on the last third.
    """

    time_s: Array
    speed_hz: Array
    mesh_db: float
    wheels: tuple[int, ...]
    learnt_db: Array
    held_out_db: Array

    @property
    def best(self) -> int:
        """Teeth of the wheel whose family stands out most on the first two thirds."""
        return self.wheels[int(np.argmax(self.learnt_db))]

    def height(self, teeth: int) -> tuple[float, float]:
        """Heights for a number of teeth: learnt, and held out, in dB."""
        k = self.wheels.index(teeth)
        return float(self.learnt_db[k]), float(self.held_out_db[k])


def tell(records: Measured) -> Turbine:
    """Course of the speed, and the wheel by its orders.

    Raises
    ------
    EnvironmentLackError
        If the record is in no data folder.
    """
    view = view_at(records, RECORD)
    first, last = learnt_and_held_out(view)
    time_s, speed_hz = view.speed_course(0.1)
    heights = [
        np.array([family_db(_orders(part), _PINION * _MESH / wheel) for wheel in _WHEELS])
        for part in (first, last)
    ]
    return Turbine(time_s, speed_hz, _mesh_gain_db(last), _WHEELS, heights[0], heights[1])


def _orders(view: View) -> tuple[Array, Array]:
    """Orders and amplitudes of the channel over the angle."""
    signal = view.angle(_CHANNEL, _PER_TURN)
    assert isinstance(signal, AngleSignal)
    return _spectrum(signal.values, _PER_TURN)


def _spectrum(values: Array, rate: float) -> tuple[Array, Array]:
    window = np.hanning(values.size)
    amplitude = 2 * np.abs(np.fft.rfft((values - values.mean()) * window)) / window.sum()
    return np.arange(amplitude.size) * rate / values.size, amplitude


def family_db(spectrum: tuple[Array, Array], order: float) -> float:
    """Mean height of the first six multiples of an order over the orders beside them, in dB."""
    axis, amplitude = spectrum
    heights = []
    for multiple in range(1, _MULTIPLES + 1):
        away = np.abs(axis - multiple * order)
        beside = amplitude[(away > 0.1) & (away < 0.6)]
        heights.append(20 * np.log10(amplitude[away <= _HALF_WIDTH].max() / np.median(beside)))
    return float(np.mean(heights))


def _mesh_gain_db(view: View) -> float:
    axis, over_angle = _orders(view)
    high = over_angle[np.abs(axis - _MESH) < 0.3].max()
    frequency, over_time = _spectrum(view.signal(_CHANNEL), view.record.sample_rate_hz)
    low = over_time[np.abs(frequency - _MESH * view.speed_hz) < 0.05 * _MESH * view.speed_hz].max()
    return float(20 * np.log10(high / low))


def draw(records: Measured) -> Figure:
    """Speed, and heights of the families of all wheels."""
    told = tell(records)
    figure = new_figure("wind turbine: a falling speed, and the wheel that fits", 4.0)
    left, right = figure.subplots(1, 2)
    left.plot(told.time_s, told.speed_hz, color=HEALTHY)
    left.axhline(float(told.speed_hz.mean()), color=GREY, linestyle="--", label="the baseline's speed")
    left.set_xlabel("time [s]")
    left.set_ylabel("speed of the high-speed shaft [Hz]")
    left.legend(fontsize=8)
    _wheels(right, told)
    return figure


def _wheels(axes: Axes, told: Turbine) -> None:
    axes.plot(told.wheels, told.learnt_db, color=HEALTHY, linewidth=0.9, label="first two thirds")
    axes.plot(told.wheels, told.held_out_db, color=FAULTY, linewidth=0.9, label="last third, held out")
    for teeth in (112, 121):
        axes.axvline(teeth, color=GREY, linestyle=":", linewidth=0.8)
        axes.text(teeth, 1.01, str(teeth), ha="center", fontsize=8, transform=axes.get_xaxis_transform())
    axes.set_xlabel("teeth of the wheel")
    axes.set_ylabel("height of its family [dB]")
    axes.legend(fontsize=8)
