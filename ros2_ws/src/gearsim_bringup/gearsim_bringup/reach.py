"""What the chosen monitors cannot see of a scenario, said before it runs."""

from __future__ import annotations

from collections.abc import Sequence

from gearsim_dsp.bands import LEAST_TURNS, least_window_s
from gearsim_dsp.streams.assembler import WindowSettings
from gearsim_dsp.streams.fitting import for_bearings
from gearsim_io.numbers import number
from gearsim_sim.events import Inject
from gearsim_sim.scenario import Scenario

__all__ = ["reach_lines"]


def reach_lines(scenario: Scenario, monitors: Sequence[str]) -> list[str]:
    """Lines on windows that are longer than usual, or too short, and on faults that no chosen node judges.

    Parameters
    ----------
    scenario : Scenario
    monitors : sequence of str
        Names of the diagnostic nodes that run.
    """
    lines = []
    if "envelope" in monitors and scenario.machine.bearings:
        lines += _windows(scenario)
    if monitors and "gear" not in monitors:
        lines += _unseen(scenario)
    return lines


def _windows(scenario: Scenario) -> list[str]:
    usual, speed_hz = WindowSettings(), scenario.speed_hz
    window_s = for_bearings(usual, scenario.machine).window_s
    turns = window_s * speed_hz
    if 0 < turns < LEAST_TURNS:
        return [
            f"windows of {number(window_s, 3)} s hold {number(turns, 2)} turns at {number(speed_hz, 3)} Hz "
            f"and bearings are judged by {LEAST_TURNS:.0f}: set window_s of the envelope node to "
            f"{number(least_window_s(speed_hz), 3)}, or record the run and diagnose that"
        ]
    if window_s > usual.window_s:
        nominal = number(scenario.machine.nominal_speed_hz, 3)
        return [
            f"bearings are judged by windows of {number(window_s, 3)} s: at {nominal} Hz they hold "
            f"{LEAST_TURNS:.0f} turns"
        ]
    return []


def _unseen(scenario: Scenario) -> list[str]:
    """Faults of anything but a bearing."""
    bearings = {bearing.name for bearing in scenario.machine.bearings}
    faults = [*scenario.faults, *(event.fault for event in scenario.events if isinstance(event, Inject))]
    others = [fault for fault in faults if fault.component not in bearings]
    if not others:
        return []
    named = ", ".join(dict.fromkeys(f"{one.kind.replace('_', ' ')} of {one.component}" for one in others))
    return [
        f"not judged by these nodes: {named}; --monitors all adds one that learns what is healthy first, and "
        "./gearsim diagnose judges a recording (--record)"
    ]
