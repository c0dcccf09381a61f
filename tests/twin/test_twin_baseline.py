"""The nominal model under the conditions of a record."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rig_records import case_of, parallel_record, rig_record, turning
from ruamel.yaml import YAML

from gearsim_io.errors import InputError
from gearsim_io.machines import machine_file
from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import to_record
from gearsim_twin.baseline import follows_speed, machine_word, scenario_content
from gearsim_twin.case import load_case
from gearsim_twin.simulated import Simulator


def test_conditions_and_sensors_are_those_of_the_record():
    case = case_of("unsw_parallel", "lpm34", parallel_record())
    view, _ = case.views()
    content = scenario_content(case, view)
    point = content["operating_point"]
    assert point["speed"]["value"] == pytest.approx(9.9, rel=1e-6)
    assert point["load"]["value"] == pytest.approx(view.load_nm, rel=1e-11)
    assert "faults" not in content
    assert "profile" not in content
    scenario = parse_scenario(content, Path("x.yaml"))
    assert scenario.machine_path == machine_file("unsw_parallel")
    assert scenario.sample_rate_hz == 8192.0
    assert [row.channel for row in scenario.sensors.accelerometers] == ["b1_y", "b3_y"]
    rows = scenario.sensors.accelerometers
    assert all(row.noise_density in (None, 0.0) and not row.adc_bits for row in rows)
    assert [one.shaft for one in scenario.sensors.tachos] == ["input", "output"]
    assert not scenario.sensors.encoders
    assert [row.channel for row in scenario.sensors.torques] == ["input_torque"]


def test_of_tachos_with_other_pulses_that_of_the_reference_shaft_counts():
    record = parallel_record()
    one, other = record.tachos
    fine = np.linspace(0.0, record.sample_count - 1.0, 1800)
    dense = dataclasses.replace(other, pulses_per_revolution=60.0, samples=fine)
    odd = dataclasses.replace(one, pulses_per_revolution=0.5, samples=one.samples[::2])
    case = case_of("unsw_parallel", "lpm34", dataclasses.replace(record, tachos=(dense, one)))
    tachos = scenario_content(case, case.views()[0])["sensors"]["tachos"]
    assert tachos == {"shafts": ["input"], "pulses": 1}
    case = case_of("unsw_parallel", "lpm34", dataclasses.replace(record, tachos=(odd,)))
    view = case.views()[0]
    content = scenario_content(case, view)
    assert content["sensors"]["tachos"] == {"shafts": []}  # no scenario can have half a pulse
    with Simulator(case, measured=[view]) as simulator:
        (made,) = simulator.views({0: content}, 1.0)
    assert made.speed_hz == view.speed_hz == pytest.approx(9.9, rel=1e-5)
    assert made.phase is not None


def test_a_file_of_the_content_is_a_scenario(tmp_path: Path):
    case = case_of("unsw_parallel", "lpm34", parallel_record())
    content = scenario_content(case, case.views()[0])
    path = tmp_path / "model.yaml"
    with path.open("w") as stream:
        YAML(typ="safe").dump(content, stream)
    again = load_scenario(path)
    assert again.speed_hz == content["operating_point"]["speed"]["value"]
    own = tmp_path / "mine.yaml"
    own.write_text(machine_file("unsw_parallel").read_text(encoding="utf-8"), encoding="utf-8")
    assert machine_word(own) == str(own)
    assert machine_word(machine_file("mfpt")) == "mfpt"


def test_a_radial_force_that_a_file_states_loads_the_bearing():
    record = dataclasses.replace(rig_record(), notes={"load": "200 lbf"})
    case = case_of("mfpt", "bearing5", record)
    content = scenario_content(case, case.views()[0])
    assert content["parameters"]["radial_load"] == {"value": pytest.approx(889.6443, rel=1e-6), "unit": "N"}
    assert content["operating_point"]["load"]["value"] == 0.0
    assert "parameters" not in scenario_content(case, case_of("mfpt", "bearing5", rig_record()).views()[0])


def test_a_run_up_is_followed_and_a_wavering_speed_is_not():
    rate_hz = 4096.0
    t = np.arange(round(6.0 * rate_hz)) / rate_hz
    ramp = turning(8.0 + 0.5 * t, rate_hz)
    case = case_of("unsw_parallel", "lpm34", ramp)
    views = case.views()
    assert follows_speed(views[0])
    content = scenario_content(case, views[0])
    assert "speed" not in content["operating_point"]
    with Simulator(case, measured=views) as simulator:
        (view,) = simulator.views({0: content})
    time_s, speed_hz = view.speed_course(0.25)
    # Where the course is bent least; the ends have a led-in acceleration outside of the record.
    assert np.max(np.abs(speed_hz - (8.0 + 0.5 * time_s))[1:-1]) < 0.02
    wavering = turning(10.0 * (1 + 0.05 * np.sin(2 * np.pi * 3.0 * t)), rate_hz)
    steady = case_of("unsw_parallel", "lpm34", wavering).views()[0]
    assert not follows_speed(steady)
    assert scenario_content(case, steady)["operating_point"]["speed"]["value"] == pytest.approx(10, rel=1e-2)


def test_without_any_speed_nothing_is_made_up():
    case = case_of("mfpt", "bearing5", rig_record())
    view = case.views()[0]
    lost = dataclasses.replace(view, speed=dataclasses.replace(view.speed, value_hz=np.nan, phase=None))
    with pytest.raises(InputError, match=r"speed: got none .*expected .*tacho.*--speed.*diagnose"):
        scenario_content(case, lost)


def test_what_the_described_drive_cannot_do_is_another_machine():
    case = case_of("unsw_parallel", "lpm34", parallel_record())
    view = case.views()[0]
    fast = dataclasses.replace(view, speed=dataclasses.replace(view.speed, value_hz=31.0, phase=None))
    with pytest.raises(InputError, match=r"speed: got 31 Hz .*at most 30 Hz.*another machine"):
        scenario_content(case, fast)
    with pytest.raises(InputError, match=r"load: got 201 N\*m, expected at most 200 N\*m.*another machine"):
        scenario_content(case, dataclasses.replace(view, load_nm=201.0))


@pytest.mark.records
@pytest.mark.parametrize(
    ("machine", "name", "force_n"),
    [
        ("mfpt", "mfpt/OuterRaceFault_vload_3.mat", 444.822),
        ("mfpt", "mfpt/baseline_1.mat", 1201.02),
        ("hit_sq", "hit_sm/SQ_OR2_1200.mat", None),
        ("cwru_drive_end", "cwru/135_0.mat", None),
    ],
)
def test_the_rigs_run_beside_real_records(
    machine: str, name: str, force_n: float | None, record_file: Callable[[str], Path]
):
    case = load_case([record_file(name)], machine, "bearing5")
    view = case.views()[1]
    content = scenario_content(case, view)
    record = to_record(parse_scenario(content, Path("x.yaml")), view.record.seconds)
    assert record.sample_count == view.record.sample_count
    assert record.channels == view.record.channels
    assert record.sample_rate_hz == view.record.sample_rate_hz
    assert np.std(record.data) > 0
    assert abs(view.speed_hz / view.machine.nominal_speed_hz - 1) < 0.02
    if force_n is not None:
        assert content["parameters"]["radial_load"]["value"] == pytest.approx(force_n, rel=1e-5)
