"""Expected orders of a two-stage gearbox in its measured order spectrum."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import HEALTHY, mark, new_figure
from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.gear_kinematics import gear_wheels

RECORD, CHANNEL = "sq_gearbox/h30hz0.csv.gz", 2
SAMPLES_PER_TURN = 256


def draw(records: Measured) -> Figure:
    """All lines up to above the second mesh harmonic, and those around the mesh of the first stage."""
    machine = records.machine(RECORD)
    record = records.record(RECORD)
    track = track_speed(record.data, record.sample_rate_hz, machine)
    signal = records.signal(RECORD, CHANNEL)[0]
    orders, lines = to_angle(signal - signal.mean(), track.phase, SAMPLES_PER_TURN).spectrum()
    level = 20 * np.log10(lines)
    wheels = gear_wheels(machine)
    figure = new_figure(f"SpectraQuest gearbox, {track.mean_hz:.3f} Hz found without tacho")
    upper, lower = figure.subplots(2, 1)
    meshes = {wheel.mesh: wheel.mesh_order for wheel in wheels}
    for axes, low, high in ((upper, 0.0, 70.0), (lower, 30.0, 34.0)):
        inside = (orders > low) & (orders < high)
        axes.plot(orders[inside], level[inside], color=HEALTHY, linewidth=0.7)
        axes.set_xlim(low, high)
        axes.set_ylabel("amplitude [dB]")
        axes.set_xlabel("order of the input shaft")
    for name, order in meshes.items():
        for harmonic in range(1, int(70 // order) + 1):
            mark(upper, harmonic * order, f"{harmonic} {name}" if harmonic > 1 else name)
    mesh = meshes["stage_1"]
    mark(lower, mesh, "mesh")
    for wheel in wheels:
        if wheel.mesh == "stage_1":
            for k in range(1, int(2 / wheel.turn_order) + 1):
                if abs(k * wheel.turn_order - 2) > 1e-9:
                    mark(lower, mesh + k * wheel.turn_order, f"+{k} x {wheel.turn_order:g}")
                    mark(lower, mesh - k * wheel.turn_order, f"-{k} x {wheel.turn_order:g}")
    return figure
