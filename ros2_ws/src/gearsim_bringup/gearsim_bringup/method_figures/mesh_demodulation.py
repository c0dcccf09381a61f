"""The mesh of a measured gear pair demodulated over the turns of both wheels."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, HEALTHY, new_figure
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.gear_kinematics import gear_wheels
from gearsim_dsp.synchronous.modulation import demodulate_mesh
from gearsim_dsp.synchronous.tsa import shaft_average

RECORD = "wt_hss_gear/health_20160306171241_25600.csv"
SIDEBANDS = 8


def draw(records: Measured) -> Figure:
    """Amplitude and phase of the mesh's first harmonic over a turn of pinion and wheel."""
    signal, rate_hz = records.signal(RECORD)
    machine = records.machine(RECORD)
    phase = track_speed(signal, rate_hz, machine).phase
    figure = new_figure(f"wind turbine, mesh of the high-speed stage, {SIDEBANDS} sidebands on either side")
    for column, wheel in enumerate(gear_wheels(machine)):
        average = shaft_average(signal, phase, ratio=wheel.turn_order)
        found = demodulate_mesh(average, wheel.teeth, sideband_count=SIDEBANDS)
        rows = (
            (100 * found.amplitude, "amplitude [%]", HEALTHY),
            (np.degrees(found.phase_rad), "phase [deg of the mesh]", FAULTY),
        )
        for row, (values, text, colour) in enumerate(rows):
            axes = figure.add_subplot(2, 2, 1 + 2 * row + column)
            axes.plot(average.turns, values, color=colour, linewidth=1.0)
            axes.set_xlim(0, 1)
            axes.set_ylabel(text)
            axes.set_xlabel(f"turn of the wheel with {wheel.teeth} teeth ({average.count} averaged)")
    return figure
