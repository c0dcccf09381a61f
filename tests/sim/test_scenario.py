"""Scenarios: the shipped ones, what the keys mean, and what is said about bad ones."""

import math

import pytest

from gearsim_io.errors import InputError
from gearsim_sim.events import Clear, Inject, SetOperatingPoint
from gearsim_sim.scenario import load_scenario, scenario_names

BASE = """
machine: unsw_parallel
operating_point: {speed: 10 Hz, load: 50 N*m}
"""


def _load(tmp_path, text, base=BASE):
    path = tmp_path / "mine.yaml"
    path.write_text(base + text)
    return load_scenario(path)


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_load(name):
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.description
    assert [event.at_sample for event in scenario.events] == sorted(e.at_sample for e in scenario.events)


def test_the_promised_scenarios_are_there():
    assert {"healthy", "demo", "inner_race", "two_faults", "speed_ramp", "quick"} <= set(scenario_names())


def test_demo_is_what_the_issue_says():
    demo = load_scenario("demo")
    assert demo.sample_rate_hz == 65536
    assert demo.faults == ()
    (event,) = demo.events
    assert isinstance(event, Inject)
    assert (event.at_sample, event.fault.kind) == (8 * 65536, "outer_race_spall")
    assert event.fault.component == "bearing_3"
    assert len(demo.sensors.accelerometers) == 8


def test_a_path_of_ones_own_with_every_key(tmp_path):
    scenario = _load(
        tmp_path,
        """
description: all keys
model: lpm34
seed: 77
sample_rate: 51.2 kHz
oversampling: 8
batch_samples: 1000
rate_factor: 0.5
sensors:
  accelerometers: {chain: industrial, channels: [b3_y, b1_x], all: {adc_bits: off}}
  tachos: {shafts: [output]}
  encoders: {shafts: [input], lines: 1024}
faults:
  - {kind: outer_race_spall, component: bearing_1, params: {width_m: 0.8 mm}, severity: 0.5, id: one}
timeline:
  - {at: 3 s, clear: {id: one, ramp: 20 ms}}
  - {at: 1000 ms, set: {speed: 600 rpm, ramp: 2 s}}
  - {at: 2 s, inject: {kind: inner_race_spall, component: bearing_2, ramp: 0 s}}
""",
    )
    assert (scenario.name, scenario.seed, scenario.rate_factor) == ("mine", 77, 0.5)
    assert (scenario.sample_rate_hz, scenario.oversampling, scenario.batch_samples) == (51200.0, 8, 1000)
    assert [row.channel for row in scenario.sensors.accelerometers] == ["b3_y", "b1_x"]
    assert scenario.faults[0].name == "one"
    change, inject, clear = scenario.events
    assert change == SetOperatingPoint(10.0, None, 2.0, 51200)
    assert isinstance(inject, Inject)
    assert inject.at_sample == 102400
    assert inject.fault.name == "bearing_2/inner_race_spall"
    assert clear == Clear("one", 0.02, 153600)
    # The nameplate tells what this rig has.
    machine = scenario.machine
    assert [channel.name for channel in machine.channels] == ["b3_y", "b1_x"]
    assert machine.channels[0].full_scale == 500.0
    assert machine.bearing("bearing_3").channels == ("b3_y",)
    assert machine.bearing("bearing_2").channels == ()
    assert (machine.tacho_shafts, machine.encoder_shafts) == (("output",), ("input",))


def test_keys_can_be_replaced():
    scenario = load_scenario("quick", {"seed": 9, "batch_samples": 64})
    assert (scenario.name, scenario.seed, scenario.batch_samples) == ("quick", 9, 64)
    with pytest.raises(InputError, match="seed: got -1"):
        load_scenario("quick", {"seed": -1})


def test_event_times_become_the_nearest_sample(tmp_path):
    scenario = _load(
        tmp_path, "sample_rate: 16384 Hz\ntimeline: [{at: 0.1 s, clear: {}}, {at: 0.2 s, clear: {}}]"
    )
    assert [event.at_sample for event in scenario.events] == [1638, 3277]


def test_full_scale_is_not_known_without_a_range(tmp_path):
    scenario = _load(tmp_path, "sensors: {accelerometers: {chain: ideal}}")
    assert math.isnan(scenario.machine.channels[0].full_scale)


_TRACE = "time_s,speed_hz,load_nm\n" + "".join(f"{k},{5 + k},{7 + k}\n" for k in range(8))

BAD = [
    ("speed: 10 Hz", "got speed, expected one of the keys batch_samples, description, faults, "),
    ("model: lpm99", "model: got lpm99, expected one of bearing2, "),
    ("seed: -1", "seed: got -1, expected "),
    (
        "sample_rate: 65536",
        "sample_rate: got 65536, expected a number in Hz, >= 1000 and <= 2000000 (the unit",
    ),
    ("sample_rate: 65536 m", "(not m)"),
    ("sample_rate: 10 Hz", "sample_rate: got 10 Hz, expected a number in Hz, >= 1000"),
    ("sample_rate: .nan", "sample_rate: got nan"),
    ("oversampling: 1", "oversampling: got 1, expected "),
    ("batch_samples: 60000", "batch_samples: got 60000, expected at most 15000, so that a message of 8"),
    ("batch_samples: many", "batch_samples: got many, expected "),
    ("rate_factor: -2", "rate_factor: got -2, expected a number without unit, >= 0"),
    (
        "faults: [{kind: x, component: y}]",
        "(entry 1 of 1): kind: got x, expected one of ball_waviness, ",
    ),
    (
        "faults: [{kind: outer_race_spall, component: bearing_1, params: {width: 1 mm}}]",
        "faults (entry 1 of 1): got width, expected one of the keys depth_m, geometry, position_rad, row, "
        "width_m; did you mean width_m?",
    ),
    (
        "timeline: [{at: 1 s, inject: {kind: outer_race_spall, component: b, params: {width_m: 1 V}}}]",
        "timeline (entry 1 of 1).inject: width_m: got 1 V, expected a number in m, > 0 (not V)",
    ),
    ("faults: [{kind: x}]", "faults (entry 1 of 1).component: got nothing, expected this key"),
    (
        "faults: [{kind: x, component: y, size: 3}]",
        "faults (entry 1 of 1): got size, expected one of the keys component, id, ",
    ),
    ("faults: [{kind: x, component: y, severity: 3}]", "faults (entry 1 of 1).severity: got 3, expected"),
    (
        "timeline: [{at: 1 s, set: {sped: 1}}]",
        "set: got sped, expected one of the keys load, ramp, speed; did you mean speed?",
    ),
    (
        "sensors: {accelerometers: {each: {b1_x: {r: 2}}}}",
        "each.b1_x: got r, expected one of the keys adc_",
    ),
    ("timeline: [{at: 8, clear: {}}]", "timeline (entry 1 of 1).at: got 8, expected a number in s"),
    (
        "timeline: [{at: -1 s, clear: {}}]",
        "timeline (entry 1 of 1).at: got -1 s, expected a number in s, ",
    ),
    ("timeline: [{at: 1 s}]", "expected one of inject, set, clear beside at"),
    ("timeline: [{at: 1 s, clear: {}, set: {}}]", "expected one of inject, set, clear beside at"),
    ("timeline: [{at: 1 s, set: {speed: -1 Hz}}]", "timeline (entry 1 of 1).set.speed: got -1 Hz, expected"),
    ("sensors: {accelerometers: {chain: gold}}", "sensors.accelerometers.chain: got gold, expected one of"),
    ("seed: 1\nseed: 2", 'got duplicate key "seed", expected valid YAML'),
    ("model: [", "line 4, column 9: got the end of the file, expected a value"),
]


@pytest.mark.parametrize(("text", "message"), BAD, ids=[text[:32] for text, _ in BAD])
def test_bad_scenarios_are_told_in_one_line(tmp_path, text, message):
    with pytest.raises(InputError) as caught:
        _load(tmp_path, text)
    line = str(caught.value)
    assert line.startswith(f"{tmp_path}/mine.yaml")
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("base", "message"),
    [
        ("", "expected a mapping of scenario keys"),
        ("machine: unsw_parallel", "operating_point.speed: got nothing, expected a speed, or else"),
        (
            "operating_point: {speed: 10 Hz}",
            "operating_point.load: got nothing, expected a load, or else a load column in profile.trace",
        ),
        (
            "profile: {trace: {file: trace.csv}}",
            "operating_point.load: got nothing, expected a load, or else a load column in profile.trace",
        ),
        (
            "machine: moon\n" + BASE.replace("machine: unsw_parallel", ""),
            "machine: got moon, expected one of",
        ),
    ],
)
def test_bad_wholes(tmp_path, base, message):
    (tmp_path / "trace.csv").write_text(_TRACE)
    with pytest.raises(InputError) as caught:
        _load(tmp_path, "", base)
    assert message in str(caught.value)


@pytest.mark.parametrize(("point", "load_nm"), [("{}", 7.0), ("{load: 20 N*m}", 20.0)])
def test_a_trace_may_give_the_load(tmp_path, point, load_nm):
    (tmp_path / "trace.csv").write_text(_TRACE)
    base = f"operating_point: {point}\nprofile: {{trace: {{file: trace.csv, load: load_nm}}}}"
    scenario = _load(tmp_path, "", base)
    assert (scenario.speed_hz, scenario.load_nm) == (5.0, load_nm)


def test_unknown_names_and_files(tmp_path):
    with pytest.raises(InputError, match="scenario: got nope, expected one of added_structure, "):
        load_scenario("nope")
    with pytest.raises(InputError, match=r"none\.yaml, expected a file that exists"):
        load_scenario(tmp_path / "none.yaml")


def test_a_machine_beside_the_scenario(tmp_path):
    from gearsim_io.machines import machine_file

    text = machine_file("unsw_parallel").read_text().replace("name: unsw_parallel", "name: mine", 1)
    (tmp_path / "my_rig.yaml").write_text(text)
    scenario = _load(tmp_path, "", BASE.replace("unsw_parallel", "my_rig.yaml"))
    assert scenario.machine.name == "mine"
    assert scenario.machine_path == tmp_path / "my_rig.yaml"
