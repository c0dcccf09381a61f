"""The simulated rig, whose fault lines come out of rollers crossing a pit, against a diagnosis from
nameplate data.

The seeds, speeds and loads are fixed; docs/diagnosis.md has the rates of a larger study.
"""

from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.evidence import EvidencePool
from gearsim_dsp.judges.bearing import MODULATION_LIMIT, find_faults
from gearsim_dsp.speed import window_speed
from gearsim_dsp.window import WindowInput, analyse_window
from gearsim_io.record import PulseTrain
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

CASES = [
    ("outer_race", "bearing_1", 11, 9.3, 35.0),
    ("outer_race", "bearing_2", 12, 14.0, 70.0),
    ("outer_race", "bearing_3", 13, 10.0, 50.0),
    ("outer_race", "bearing_4", 14, 19.5, 25.0),
    ("inner_race", "bearing_1", 15, 17.0, 60.0),
    ("inner_race", "bearing_2", 16, 10.0, 50.0),
    ("inner_race", "bearing_3", 17, 23.0, 30.0),
    ("inner_race", "bearing_4", 18, 8.5, 75.0),
]


def _run(seed, speed, load, seconds, fault=None, component=""):
    changes = {"seed": seed, "operating_point": {"speed": f"{speed} Hz", "load": f"{load} N*m"}}
    if fault:
        changes["faults"] = [
            {"kind": f"{fault}_spall", "component": component, "params": {"width_m": "0.8 mm"}}
        ]
    scenario = load_scenario("healthy", changes)
    return to_record(scenario, seconds), scenario.machine


def _judge(record, machine, first, length, tacho=True):
    """The verdict on one window."""
    rate = record.sample_rate_hz
    trains = []
    if tacho:
        for train in record.tachos:
            inside = train.samples[(train.samples >= first) & (train.samples < first + length)] - first
            trains.append(PulseTrain(train.shaft, train.pulses_per_revolution, inside))
    speed = window_speed(trains, length, rate, machine)
    pool = EvidencePool(machine)
    rows = zip(record.channels, record.data, strict=True)
    pool.add(
        [
            analyse_window(WindowInput(row[first : first + length], rate, name, first, speed, machine))
            for name, row in rows
        ]
    )
    return find_faults(machine, pool)


def _without_angle(machine, speed):
    """The machine as one without angle signals whose nameplate is 1 % off."""
    shafts = tuple(replace(s, nominal_speed_hz=1.01 * speed * s.ratio) for s in machine.shafts)
    return replace(machine, shafts=shafts, tacho_shafts=(), encoder_shafts=())


@pytest.mark.parametrize(("fault", "component", "seed", "speed", "load"), CASES)
def test_a_spall_of_0_8_mm_is_found_and_named_in_one_window(fault, component, seed, speed, load):
    seconds = max(2.0, 20 / speed)
    record, machine = _run(seed, speed, load, seconds + 0.05, fault, component)
    length = round(seconds * record.sample_rate_hz)
    (finding,) = _judge(record, machine, 0, length).findings
    assert (finding.component, finding.fault) == (component, fault)
    assert finding.found_order == pytest.approx(finding.expected_order, rel=3e-3)
    assert finding.confidence > 0.5
    verdict = _judge(record, _without_angle(machine, speed), 0, length, tacho=False)
    assert [(f.component, f.fault) for f in verdict.findings] == [(component, fault)]
    assert verdict.speed.source == "estimated"
    assert verdict.speed.value_hz == pytest.approx(speed, rel=2e-3)


@pytest.mark.parametrize(("seed", "speed", "load"), [(21, 10.0, 50.0), (22, 12.66, 20.4), (23, 23.6, 22.4)])
def test_a_healthy_rig_shows_nothing_in_any_window(seed, speed, load):
    record, machine = _run(seed, speed, load, 5.0)
    length = round(max(2.0, 20 / speed) * record.sample_rate_hz)
    for first in np.arange(0, record.sample_count - length, length // 2):
        verdict = _judge(record, machine, int(first), length)
        assert verdict.findings == ()
        assert max(e.modulation for e in verdict.evidence) < 0.5 * MODULATION_LIMIT
