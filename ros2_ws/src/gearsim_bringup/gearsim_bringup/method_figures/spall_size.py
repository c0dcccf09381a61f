"""Entry and impact of two measured spalls, and the widths that they tell."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import uniform_filter1d

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, mark, new_figure
from gearsim_dsp.sizing.crossing import RacePass
from gearsim_dsp.sizing.energy_pair import energy_pair
from gearsim_dsp.sizing.impacts import MeanImpact, mean_impact
from gearsim_dsp.sizing.spall_width import explanations, judged
from gearsim_dsp.sizing.votes import width_grid, width_vote
from gearsim_dsp.sizing.whitening import whitened

WIDE, WIDE_HZ, WIDE_DEG = "hit_sm/SQ_OR8_600.mat", 35.98, 8.0
NARROW, NARROW_HZ, NARROW_DEG = "hit_sm/SQ_OR2_1200.mat", 71.73, 2.0


def draw(records: Measured) -> Figure:
    """One crossing and the mean energy of a wide spall; mean impact and votes of a narrow one."""
    figure = new_figure("spalls of the outer race of a 6205, sized from entry and impact", 5.6)
    panels = figure.subplots(2, 2)
    _wide(panels[0], records)
    _narrow(panels[1], records)
    return figure


def _impacts(records: Measured, name: str, passes_hz: float) -> tuple[MeanImpact, float, RacePass]:
    signal, rate_hz = records.signal(name)
    (bearing,) = records.machine(name).bearings
    white, _ = whitened(signal, rate_hz, passes_hz, 0.0, [])
    mean = mean_impact(white, rate_hz, passes_hz, None)
    assert mean is not None
    return mean, rate_hz, RacePass.of(bearing, "outer_race", passes_hz)


def _wide(row: tuple[Axes, Axes], records: Measured) -> None:
    mean, rate_hz, way = _impacts(records, WIDE, WIDE_HZ)
    per_m = rate_hz / way.speed_m_s
    pair = energy_pair(mean.segments, rate_hz, 4 * way.release_m * per_m, 0.45 * mean.period)
    assert pair is not None
    energy = np.median(uniform_filter1d(np.diff(mean.segments, axis=1) ** 2, 7, axis=1), axis=0)
    place = (np.arange(energy.size) - int(np.argmax(energy))) / per_m * 1e3
    spacing = pair.spacing / per_m * 1e3
    # The louder event is at 0; the other is where there is more energy, before or behind.
    before, behind = (energy[np.abs(place - side * spacing) < 0.1].max() for side in (-1, 1))
    entry = -spacing if before > behind else 0.0
    impact = entry + spacing
    row[0].plot(place, mean.segments[20, : energy.size], color=GREY, linewidth=0.6)
    row[0].set_title("8 degrees: one crossing, whitened", fontsize=9, pad=14)
    row[1].semilogy(place, energy, color=FAULTY, linewidth=0.8)
    row[1].set_title(f"energy of {mean.count} crossings: {spacing:.2f} mm apart", fontsize=9, pad=14)
    for axes in row:
        mark(axes, entry, "entry")
        mark(axes, impact, "impact")
        axes.set_xlim(entry - 2.5, impact + 2.5)
        axes.set_xlabel("along the race [mm]")


def _narrow(row: tuple[Axes, Axes], records: Measured) -> None:
    mean, rate_hz, way = _impacts(records, NARROW, NARROW_HZ)
    found = explanations(mean, rate_hz, way)
    verdict = judged(found, None, rate_hz / way.speed_m_s, way)
    best, per_m = found[0]
    down = round(rate_hz / way.speed_m_s / per_m)
    place = (np.arange(mean.values.size) / down - best.entry[0]) / per_m * 1e3
    row[0].plot(place, mean.values, color=HEALTHY, linewidth=0.8)
    row[0].set_title(f"2 degrees: mean of {mean.count} impacts", fontsize=9, pad=14)
    mark(row[0], 0.0, "entry")
    mark(row[0], (best.width[0] - best.release[0]) / per_m * 1e3, "impact")
    row[0].set_xlim(-1.0, 2.0)
    row[0].set_xlabel("along the race [mm]")
    grid = width_grid(0.05 * way.element_radius_m, 0.45 * way.spacing_m)
    degrees = np.degrees(np.exp(grid) / way.race_radius_m)
    for number, (each, rate) in enumerate(found):
        vote = width_vote(grid, each.width / rate, each.cost, way.release_m)
        row[1].plot(degrees, vote, color=GREY, linewidth=0.7 + 0.4 * number, label=f"band {number + 1}")
    low, high = (math.degrees(way.arc_rad(value)) for value in (verdict.low, verdict.high))
    row[1].axvspan(low, high, color=HEALTHY, alpha=0.2, label="95 % interval")
    mark(row[1], NARROW_DEG, "stated")
    row[1].set_xlim(0.5, 5)
    row[1].set_xlabel("width of the spall [degrees of the race]")
    row[1].set_ylabel("vote against")
    row[1].legend(loc="lower right", fontsize=7.5)
