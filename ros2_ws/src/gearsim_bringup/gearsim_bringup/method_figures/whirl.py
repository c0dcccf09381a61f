"""A planet with a spall to the sun, and one with a spall to the ring: the tooth, and how the sun whirls.

No measured record of such a stage with a known fault is at hand; `records` is not used.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from gearsim_bringup.method_figures.measured import Measured
from gearsim_bringup.method_figures.style import FAULTY, GREY, HEALTHY, new_figure
from gearsim_dsp.judges.measured import Measured as Judged
from gearsim_dsp.judges.planet_turns import TURN_BANDS_HZ, averaged_profile, averaged_turns
from gearsim_dsp.speed import window_speed
from gearsim_dsp.synchronous.whirl import blow_of_tooth
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

SECONDS = 6.0
BINS_PER_TOOTH = 8
TOOTH = 3


def draw(_records: Measured) -> Figure:
    """Profile of the averaged turns on the left, forward over backward whirl of the sun on the right."""
    figure = new_figure("simulated stage 80/20/40, spall of 1 mm on a tooth of planet 2", 3.6)
    left, right = figure.subplots(1, 2)
    middles = np.arange(len(TURN_BANDS_HZ))
    for side, colour in (("sun", FAULTY), ("ring", HEALTHY)):
        measured = _record(side)
        stage = measured.machine.planetary_stages[0]
        turns = averaged_turns(measured, stage)
        profile = averaged_profile(turns["sun"], stage.planet_teeth, BINS_PER_TOOTH)
        place = int(np.argmax(profile))
        shown = np.roll(profile, profile.size // 4 - place)
        teeth = np.arange(profile.size) / BINS_PER_TOOTH
        left.semilogy(teeth, shown, color=colour, label=f"spall to the {side}")
        blow = blow_of_tooth(turns["sun"].mean(axis=0), stage.planet_teeth, place / profile.size)
        ratio = 10 * np.log10(blow.net[:, 0] / blow.net[:, 1])
        relative = np.sqrt(np.sum(blow.variance[:, :2] / blow.net[:, :2] ** 2, axis=1))
        error = np.minimum(10 / np.log(10) * relative, 20.0)
        right.errorbar(middles, ratio, error, color=colour, marker="o", linestyle="", capsize=3)
    left.set(xlabel="tooth of the planet", ylabel="energy over its median", title="sensor at the sun")
    left.legend(loc="upper right")
    right.axhline(0.0, color=GREY, linewidth=0.8)
    right.set_xticks(middles, [f"{low / 1e3:g}-{high / 1e3:g}" for low, high in TURN_BANDS_HZ])
    right.set(
        xlabel="band, kHz", ylabel="forward over backward, dB", title="whirl of the sun", ylim=(-22, 22)
    )
    return figure


def _record(side: str) -> Judged:
    """The shipped stage with a run-out of 5 um and one spalled tooth."""
    fault = {"kind": "planet_tooth_spall", "component": "planet_2", "params": {"side": side, "tooth": TOOTH}}
    changes = {"sample_rate": "32768 Hz", "faults": [fault], "parameters": {"gear_errors.runout": "5 um"}}
    scenario = load_scenario("planetary_healthy", changes)
    record = to_record(scenario, SECONDS)
    speed = window_speed(record.tachos, record.sample_count, record.sample_rate_hz, scenario.machine)
    return Judged.of_record(record, scenario.machine, speed)
