"""HIT-SM: the double impact of a wide spall, learnt at 600 rpm and stated for other speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_bringup.stories.views import view_at
from gearsim_dsp.sizing.crossing import RacePass
from gearsim_dsp.sizing.impacts import mean_impact
from gearsim_dsp.sizing.spall_width import Sizing
from gearsim_dsp.sizing.whitening import whitened
from gearsim_io.machines import load_machine
from gearsim_sim.scenario import parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.causes.bearing_signs import signs_of, size_of
from gearsim_twin.view import View, view_of

__all__ = ["LEARNT", "SHORTER", "Crossing", "Wide", "crossing_of", "draw", "extended_view", "tell"]

LEARNT, SHORTER = "hit_sm/SQ_OR8_600.mat", "hit_sm/SQ_OR2_1200.mat"
_ARCS_DEG = {LEARNT: 8.0, SHORTER: 2.0}
SPEEDS_HZ = (10.0, 15.0, 20.0)
_SECONDS, _DEPTH_M = 4.0, 20e-6


@dataclass(frozen=True, slots=True)
class Crossing:
    """What one record tells of a spall of the outer race.

    Attributes
    ----------
    speed_hz : float
    line_order : float
        Of the BPFO, as found.
    length_m, ci95_m : float, tuple of float
        Along the race, with its 95 % interval.
    crossing_s : float
        Time from entry to exit: the length over the speed of an element along the race.
    apart_s : float
        Distance of two separate events; NaN where they are not separate.
    kind : str
        As the sizing calls it.
    """

    speed_hz: float
    line_order: float
    length_m: float
    ci95_m: tuple[float, float]
    crossing_s: float
    apart_s: float
    kind: str


@dataclass(frozen=True, slots=True)
class Wide:
    """The spall learnt at 600 rpm, the shorter one at 1200 rpm, and the extended model at some speeds.

    `arc_m` is the length that the data set states for each of the two.
    """

    learnt: Crossing
    shorter: Crossing
    arc_m: tuple[float, float]
    extended: tuple[Crossing, ...]


def crossing_of(view: View) -> Crossing:
    """Length and time of the strongest sign of the outer race in a view."""
    sign = next(each for each in signs_of(view) if each.fault == "outer_race")
    sizing = size_of(view, sign)
    assert isinstance(sizing, Sizing)
    assert sizing.width is not None
    width = sizing.width
    bearing = view.machine.bearing(sign.component)
    way = RacePass.of(bearing, sign.fault, sign.found_order * view.speed_hz)
    rate = view.record.sample_rate_hz
    apart = sizing.pair.spacing / rate if sizing.pair is not None else math.nan
    crossing = width.value_m / way.speed_m_s
    return Crossing(
        view.speed_hz, sign.found_order, width.value_m, width.ci95_m, crossing, apart, sizing.kind
    )


def extended_view(length_m: float, speed_hz: float) -> View:
    """What the rig's model gives with a spall of that length, at a speed."""
    params = {"race": "outer", "length_m": length_m, "depth_m": _DEPTH_M}
    content = {
        "machine": "hit_sq",
        "model": "bearing5",
        "sample_rate": "51200 Hz",
        "operating_point": {"speed": f"{speed_hz} Hz", "load": "0 N*m"},
        "sensors": {
            "accelerometers": {"chain": "ideal", "all": {"noise_density": "0.002 m/s^2/Hz^0.5"}},
            "tachos": {"shafts": ["shaft"], "pulses": 1},
            "encoders": {"shafts": []},
        },
        "faults": [{"kind": "wide_spall", "component": "test_bearing", "params": params}],
    }
    record = to_record(parse_scenario(content, Path("hit_sq.yaml")), _SECONDS)
    return view_of(record, load_machine("hit_sq"))


def tell(records: Measured) -> Wide:
    """Learn the length at 600 rpm; state it for other speeds by the extended model.

    Raises
    ------
    EnvironmentLackError
        If a record is in no data folder.
    """
    learnt, shorter = (crossing_of(view_at(records, name)) for name in (LEARNT, SHORTER))
    (bearing,) = records.machine(LEARNT).bearings
    radius = 0.5 * (bearing.pitch_diameter_m + bearing.element_diameter_m)
    arcs = tuple(math.radians(_ARCS_DEG[name]) * radius for name in (LEARNT, SHORTER))
    extended = tuple(crossing_of(extended_view(learnt.length_m, speed)) for speed in SPEEDS_HZ)
    return Wide(learnt, shorter, (arcs[0], arcs[1]), extended)


def draw(records: Measured) -> Figure:
    """Energy of the crossings at 600 rpm, and the time between the events against the speed."""
    told = tell(records)
    figure = new_figure("HIT-SM: a spall of 8 degrees, learnt at 600 rpm", 4.2)
    left, right = figure.subplots(1, 2)
    _energy(left, records, told.learnt)
    speed = np.linspace(8.0, 24.0, 60)
    way = 1e3 * told.learnt.crossing_s * told.learnt.speed_hz
    right.plot(speed, way / speed, color=FAULTY, linewidth=1.0, label="8 degrees: learnt, stated as 1/speed")
    right.plot(speed, way / speed / 4, color=HEALTHY, linewidth=1.0, label="2 degrees: stated, a quarter")
    right.axhline(
        1e3 * told.learnt.crossing_s, color=GREY, linestyle=":", label="an echo would keep its time"
    )
    right.plot(
        told.learnt.speed_hz, 1e3 * told.learnt.crossing_s, "o", color=FAULTY, label="measured, learnt from"
    )
    right.plot(
        told.shorter.speed_hz, 1e3 * told.shorter.crossing_s, "s", color=HEALTHY, label="measured, held out"
    )
    right.plot(
        [each.speed_hz for each in told.extended],
        [1e3 * each.crossing_s for each in told.extended],
        "x",
        color="black",
        label="extended model, simulated and measured alike",
    )
    right.set_xlabel("speed [Hz]")
    right.set_ylabel("from entry to exit [ms]")
    right.set_ylim(0.0, 8.0)
    right.legend(loc="upper right", fontsize=7)
    return figure


def _energy(axes: Axes, records: Measured, told: Crossing) -> None:
    signal, rate_hz = records.signal(LEARNT)
    white, _ = whitened(signal, rate_hz, told.line_order * told.speed_hz, 0.0, [])
    mean = mean_impact(white, rate_hz, told.line_order * told.speed_hz, None)
    assert mean is not None
    energy = np.median(uniform_filter1d(np.diff(mean.segments, axis=1) ** 2, 7, axis=1), axis=0)
    time_ms = 1e3 * (np.arange(energy.size) - int(np.argmax(energy))) / rate_hz
    axes.semilogy(time_ms, energy, color=FAULTY, linewidth=0.8)
    gap = 1e3 * told.apart_s
    before = energy[np.abs(time_ms + gap) < 0.15].max() > energy[np.abs(time_ms - gap) < 0.15].max()
    entry = -gap if before else 0.0
    mark(axes, entry, "entry")
    mark(axes, entry + gap, "impact")
    axes.set_xlim(entry - 3.0, entry + gap + 3.0)
    axes.set_xlabel("time [ms]")
    axes.set_title(f"energy of {mean.count} crossings", fontsize=9, pad=14)
