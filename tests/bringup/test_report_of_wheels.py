"""The report's pictures of gears, planets and shafts, for findings as their judges make them."""

import base64
import dataclasses

import numpy as np
import pytest

from gearsim_bringup.diagnosis_report.material import Material
from gearsim_bringup.diagnosis_report.tooth import draw_turn
from gearsim_bringup.diagnosis_report.words import evidence_rows, fault_name, meaning
from gearsim_dsp.angle.record_speed import record_speed
from gearsim_dsp.diagnose import Diagnosis
from gearsim_dsp.judges.finding import Finding, Size
from gearsim_dsp.speed import ShaftSpeed


def _material(name: str, seconds: float) -> Material:
    from gearsim_sim.scenario import load_scenario
    from gearsim_sim.simulation import to_record

    scenario = load_scenario(name)
    record = to_record(scenario, seconds)
    speed = ShaftSpeed(scenario.speed_hz, (scenario.speed_hz, scenario.speed_hz), "tacho")
    diagnosis = Diagnosis(speed, (), (), angle=record_speed(record, scenario.machine))
    return Material.of(record, scenario.machine, diagnosis)


def _finding(fault: str, component: str, channel: str, **evidence: object) -> Finding:
    return Finding(component, fault, 1.0, 1.0, 10.0, 20.0, 0.9, "moderate", channel, dict(evidence))


def _values(trace: dict) -> np.ndarray:
    return np.frombuffer(base64.b64decode(trace["y"]["bdata"]), "<f4")


def test_the_bad_tooth_bursts_out_of_the_difference_signal():
    material = _material("gear_tooth_spall", 2.0)
    plot = draw_turn(material, 0, _finding("gear_tooth_spall", "gears.gear", "b4_y", tooth_angle_turns=0.25))
    difference = _values(plot.data[1])
    teeth = plot.data[1]["dx"] * difference.size
    assert teeth == pytest.approx(32)
    level = np.abs(difference)
    around = np.abs((np.arange(level.size) - np.argmax(level)) * plot.data[1]["dx"])
    # Everything above a third of the burst lies within two teeth of its top.
    far = (around > 2) & (around < teeth - 2)
    assert level[far].max() < level.max() / 3
    assert plot.layout["shapes"][0]["x0"] == pytest.approx(0.25 * 32 - 1)


def test_the_transmission_error_swings_by_the_run_out():
    material = _material("gear_eccentricity", 2.0)
    plot = draw_turn(material, 0, _finding("gear_eccentricity", "gears", "transmission error"))
    share = _values(plot.data[0])
    turns = plot.layout["xaxis"]["range"][1]
    lines = np.abs(np.fft.rfft(share)) * 2 / share.size
    once = lines[round(turns)]
    # 0.1 mm off the axis of wheels of module 2 mm swings by 0.1 / (2 pi) pitches along the line of action.
    assert once == pytest.approx(100 * 0.1 / (2 * np.pi), rel=0.05)
    assert once == lines[1 : 3 * round(turns)].max()


def test_the_cracked_tooth_of_a_planet_stands_at_a_quarter():
    material = _material("planetary_crack", 5.0)
    plot = draw_turn(material, 0, _finding("planet_tooth_crack", "insert.planet", "carrier"))
    assert [trace["name"] for trace in plot.data] == ["ring", "carrier", "sun"]
    profile = _values(plot.data[1])
    assert np.argmax(profile) == profile.size // 4
    assert profile.max() > 1.2 * np.median(profile)


def test_velocities_are_bars_under_their_limit():
    material = _material("healthy", 1.0)
    told = {"1": 2.5, "2": 0.25}
    finding = _finding(
        "unbalance", "input", "b1_y", order_velocities_mm_s=told, limit_mm_s=1.8, velocity_mm_s=2.5
    )
    plot = draw_turn(material, 0, finding)
    assert (plot.data[0]["x"], plot.data[0]["y"]) == ([1.0, 2.0], [2.5, 0.25])
    assert plot.layout["shapes"][0]["y0"] == 1.8
    assert fault_name(finding) == "unbalance, shaft input"
    assert ("vibration velocity, mm/s RMS", "2.5", "") in evidence_rows(material, finding)


def test_every_fault_word_has_a_sentence_and_the_width_is_told():
    from gearsim_dsp.judges.finding import FAULT_WORDS

    for word in FAULT_WORDS:
        finding = _finding(word, "part", "b1_y")
        assert "10.00" in meaning(finding), word
        assert "{" not in meaning(finding)
        assert "_" not in fault_name(finding)
    wide = dataclasses.replace(_finding("outer_race", "bearing_3", "b1_y"), size=Size(0.82, (0.7, 0.95)))
    assert "about 0.82 mm wide (0.7 to 0.95 mm)" in meaning(wide)
