"""Three planets told apart from one sensor on the ring of a simulated hunting-tooth stage.

No measured record of such a stage with a known fault is at hand; `records` is not used.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.speed import window_speed
from gearsim_dsp.synchronous.pass_weights import McFaddenWindow, PassWeights, forrester_weights
from gearsim_dsp.synchronous.planets import Separation, pass_harmonics, separate, strike_levels
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_io.nameplate import PlanetaryStage
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

FAULT = {"kind": "planet_tooth_spall", "component": "planet_2", "params": {"side": "sun", "tooth": 21}}
SECONDS = 11.5
# The vertical sensor on the rigid ring hears a planet loudest where its line of action, 20 degrees off the
# tangent, is vertical: 20 degrees before planet 1 is level with the centre, half a turn past the mark.
LOUDEST_TURN = 0.5 - 20 / 360


def draw(_records: Measured) -> Figure:
    """Difference signals of the planets, by both kinds of weights."""
    changes = {"sample_rate": "16384 Hz", "faults": [FAULT], "parameters": {"gear_errors.runout": "5 um"}}
    scenario = load_scenario("planetary_hunting", changes)
    record, machine = to_record(scenario, SECONDS), scenario.machine
    stage = machine.planetary_stages[0]
    signal = record.data[record.channels.index("ring")]
    phase = window_speed(record.tachos, record.sample_count, record.sample_rate_hz, machine).phase
    assert phase is not None
    loudness = pass_harmonics(signal, phase, machine, stage)
    figure = new_figure("simulated stage, planet 2 with a spalled tooth, 23 turns of the carrier", 5.4)
    kinds: tuple[tuple[str, PassWeights], ...] = (
        ("Forrester's weights", forrester_weights(stage, loudness)),
        ("McFadden's windows", McFaddenWindow(stage.ring_teeth)),
    )
    for column, (name, weights) in enumerate(kinds):
        found = separate(signal, phase, machine, stage, weights, pass_turn=LOUDEST_TURN)
        _planets(figure, column, name, found, stage)
    return figure


def _planets(figure: Figure, column: int, name: str, found: Separation, stage: PlanetaryStage) -> None:
    """One row for each planet."""
    levels = strike_levels(found, stage.planet_teeth)
    rest = [difference_signal(a, [stage.planet_teeth]) for a in found.averages]
    most = 1.1 * max(float(np.max(np.abs(r))) for r in rest)
    for row, (average, values) in enumerate(zip(found.averages, rest, strict=True)):
        axes = figure.add_subplot(len(rest), 2, 1 + 2 * row + column)
        colour = FAULTY if row == int(np.argmax(levels)) else HEALTHY
        axes.axhspan(-average.noise_rms, average.noise_rms, color=GREY, alpha=0.4, linewidth=0)
        axes.plot(average.turns * stage.planet_teeth, values, color=colour, linewidth=0.6)
        axes.set_ylim(-most, most)
        axes.set_xlim(0, stage.planet_teeth)
        axes.set_title(f"{name}, planet {row + 1}: strike level {levels[row]:.2f} m/s²", fontsize=9)
    axes.set_xlabel("tooth of the planet")
