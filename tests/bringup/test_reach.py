"""What a live run's monitors cannot see is said beforehand, and windows fit the machine."""

from dataclasses import replace

import pytest

from gearsim_bringup.reach import reach_lines
from gearsim_dsp.nodes.envelope_node import EnvelopeParameters
from gearsim_dsp.nodes.envelope_node import make_monitor as make_envelope
from gearsim_dsp.nodes.gear_node import GearParameters
from gearsim_dsp.nodes.gear_node import make_monitor as make_gear
from gearsim_io.machines import load_machine
from gearsim_sim.scenario import load_scenario

USUAL = ("envelope", "kurtosis")


@pytest.mark.parametrize(("machine", "window_s"), [("unsw_parallel", 2.0), ("unsw_planetary", 4.2)])
def test_the_envelope_nodes_windows_hold_eight_turns(machine, window_s):
    monitor = make_envelope(load_machine(machine), EnvelopeParameters())
    assert monitor.monitor.assembler.settings.window_s == window_s


def test_the_gear_nodes_windows_hold_eight_turns_of_the_slowest_shaft(tmp_path):
    plate = load_machine("unsw_parallel")
    first, second = plate.shafts
    slow = replace(plate, shafts=(first, replace(second, ratio=0.1)))
    parameters = GearParameters(baseline_dir=str(tmp_path))
    assert make_gear(plate, parameters).monitor.assembler.settings.window_s == 4.0
    assert make_gear(slow, parameters).monitor.assembler.settings.window_s == pytest.approx(8.8, abs=0.11)


def test_a_planets_tooth_is_told_to_be_beyond_the_usual_monitors():
    windows, unseen = reach_lines(load_scenario("planetary_crack"), USUAL)
    assert windows == "bearings are judged by windows of 4.2 s: at 2.13 Hz they hold 8 turns"
    assert "planet tooth crack of planet_1" in unseen
    assert "--monitors all" in unseen
    assert reach_lines(load_scenario("planetary_crack"), (*USUAL, "gear")) == [windows]


def test_faults_of_bearings_need_no_words():
    assert reach_lines(load_scenario("demo"), USUAL) == []
    assert reach_lines(load_scenario("gear_wear"), ()) == []


def test_a_speed_too_low_for_the_windows_is_told():
    slow = replace(load_scenario("demo"), speed_hz=3.0)
    (line,) = reach_lines(slow, USUAL)
    assert line.startswith("windows of 2 s hold 6 turns at 3 Hz and bearings are judged by 8: set window_s")
