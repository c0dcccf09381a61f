"""Records of the single-bearing rigs: what a scenario gives, what the diagnosis reads, real ones beside."""

from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.diagnose import diagnose_record
from gearsim_io.errors import InputError
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine, machine_file
from gearsim_sim.engine import Engine
from gearsim_sim.events import FaultSpec
from gearsim_sim.model.plants import make_plant
from gearsim_sim.params import load_bearing_rig_params
from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import Simulation, to_record

RATE_HZ = 48828.0
OUTER = {"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.4 mm"}}
INNER = {**OUTER, "kind": "inner_race_spall"}


def mfpt(model="bearing5", faults=(), **changes):
    given = {"model": model, "faults": list(faults), "sample_rate": f"{RATE_HZ} Hz", **changes}
    scenario = load_scenario("mfpt_outer", given)
    return to_record(scenario, 3.0), scenario.machine


def findings(record, machine):
    return [(one.component, one.fault) for one in diagnose_record(record, machine).findings]


@pytest.mark.parametrize("model", ["bearing2", "bearing4", "bearing5"])
@pytest.mark.parametrize(("spall", "fault"), [(OUTER, "outer_race"), (INNER, "inner_race")])
def test_the_diagnosis_names_the_simulated_fault(model, spall, fault):
    record, machine = mfpt(model, [spall])
    assert findings(record, machine) == [("test_bearing", fault)]


def test_a_healthy_rig_gives_no_finding():
    record, machine = mfpt()
    diagnosis = diagnose_record(record, machine)
    assert diagnosis.findings == ()
    assert diagnosis.judged


REAL = [
    ("mfpt/OuterRaceFault_vload_5.mat", OUTER, {"radial_load": "200 lbf"}),
    ("mfpt/InnerRaceFault_vload_5.mat", INNER, {"radial_load": "200 lbf"}),
]


@pytest.mark.records
@pytest.mark.parametrize(("name", "spall", "parameters"), REAL, ids=[row[0] for row in REAL])
def test_the_simulated_record_is_like_the_measured_one(record_file, name, spall, parameters):
    """Same channels, rate and unit, and the envelope's line at the same order.

    Tolerance: the rings of the real bearing slip by a few per mille, and the speed of neither record is known
    better than to one per mille.
    """
    real = import_file(record_file(name), "mfpt")
    record, machine = mfpt(faults=[spall], parameters=parameters)
    assert (record.channels, record.sample_rate_hz, record.unit) == (
        real.channels, real.sample_rate_hz, real.unit,
    )  # fmt: skip
    assert record.sample_count == pytest.approx(real.sample_count, rel=0.01)
    (measured,) = diagnose_record(real, load_machine("mfpt")).findings
    (simulated,) = diagnose_record(record, machine).findings
    assert simulated.fault == measured.fault
    assert simulated.found_order == pytest.approx(measured.found_order, rel=5e-3)
    assert simulated.found_order == pytest.approx(simulated.expected_order, rel=1e-3)


def test_cwru_scenario():
    scenario = load_scenario("cwru_inner")
    record = to_record(scenario, 3.0)
    assert record.channels == ("drive_end",)
    assert record.sample_rate_hz == 48000.0
    assert findings(record, scenario.machine) == [("drive_end", "inner_race")]


def test_hit_rig():
    """Defects of two degrees of the race: 0.82 mm on the outer race, which a light load hardly presses."""
    content = {
        "machine": "hit_sq",
        "model": "bearing5",
        "sample_rate": "51200 Hz",
        "operating_point": {"speed": "1200 rpm", "load": "0 N*m"},
        "faults": [{**OUTER, "params": {"width_m": "0.82 mm"}}],
    }
    scenario = parse_scenario(content, machine_file("hit_sq"))
    record = to_record(scenario, 3.0)
    assert record.channels == ("accel",)
    assert findings(record, scenario.machine) == [("test_bearing", "outer_race")]


def test_output_is_the_same_for_any_chunk():
    params, fault = (
        load_bearing_rig_params(),
        FaultSpec("outer_race_spall", "test_bearing", {"width_m": 4e-4}),
    )
    whole = Engine(params, 1, RATE_HZ, faults=[fault]).advance(2000).accel
    engine = Engine(params, 1, RATE_HZ, faults=[fault])
    parts = [engine.advance(n).accel for n in (1, 7, 992, 1000)]
    assert np.array_equal(np.concatenate(parts, axis=1), whole)


def test_only_passing_balls_move_a_healthy_rig():
    """Stiffness varies as balls pass (varying compliance, at the BPFO); with standing balls nothing moves."""
    params, sites = load_bearing_rig_params(), {"accel": {"y_p": 1.0}}
    passing = Engine(params, 1, RATE_HZ, sites=sites).advance(round(RATE_HZ)).accel[0]
    standing = Engine(params.with_physics(ball_passing=False), 1, RATE_HZ, sites=sites).advance(5000).accel[0]
    assert np.abs(standing).max() < 1e-9 * np.abs(passing).max()
    spectrum = np.abs(np.fft.rfft(passing * np.hanning(passing.size)))
    bpfo = 4 * 25.0 * (1 - 0.235 / 1.245)
    assert np.argmax(spectrum) % bpfo == pytest.approx(0, abs=1) or (
        bpfo - np.argmax(spectrum) % bpfo == pytest.approx(0, abs=1)
    )


def test_load_and_clearance_come_from_the_scenario():
    light = load_bearing_rig_params("mfpt", {"radial_load": "25 lbf"}, "test")
    assert light.model.radial_load_n == pytest.approx(25 * 4.4482216)
    loose = {"radial_load": "0 N", "shaft.mass": "4.02 kg", "bearing.radial_clearance": "300 um"}
    params = load_bearing_rig_params("mfpt", loose, "test")
    with pytest.raises(InputError, match=r"bearing.radial_clearance.*load zone under 39.4 N"):
        make_plant(params, 1)


def test_a_rig_whose_outer_ring_turns():
    """The cage is faster, a pit of the outer race turns, and one of the inner race stands."""
    params = load_bearing_rig_params()
    bearing = replace(params.bearing, outer_ring_rotates=True)
    plant = make_plant(params.model_copy(update={"bearing": bearing}), 1)
    gamma = 0.235 / 1.245
    cage = plant.rates[plant.bearings[0].cage]
    assert cage == pytest.approx(0.5 * (1 + gamma), rel=1e-12)
    phases = plant.phases(0.3)
    assert plant.bearings[0].outer.angle_turns(phases) == pytest.approx(0.3)
    assert plant.bearings[0].inner.angle_turns(phases) == 0
    # Elements pass a point of the turning outer race at the BPFO, of the standing inner race at the BPFI.
    assert 8 * (1 - cage) == pytest.approx(4 * (1 - gamma))
    assert 8 * cage == pytest.approx(4 * (1 + gamma))


def rig_file(tmp_path, *pairs):
    text = machine_file("mfpt").read_text(encoding="utf-8")
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "rig.yaml"
    path.write_text(text, encoding="utf-8")
    return path


REFUSED = [
    ("sites: {accel: y}", "sites: {acel: y}", "sites.acel.*one of the channels accel"),
    ("sites: {accel: y}", "sites: {accel: z}", "sites.accel: got z, expected one of x, y"),
    ("kind: bearing_rig", "kind: gearbox", "kind.*bearing_rig"),
    ("  pedestal:\n", "  plinth:\n", "plinth|pedestal.*nothing"),
    (
        "rolling_elements: {value: 8",
        "rolling_elements: {value: 18",
        "rolling_elements.*fit on a pitch circle",
    ),
    ("speed_limit: {value: 60", "speed_limit: {value: 20", "drive.speed.*20"),
    ("270, unit: lbf", "270, unit: kg", "radial_load.*number in N"),
]


@pytest.mark.parametrize(("old", "new", "expected"), REFUSED)
def test_what_cannot_be_is_named(tmp_path, old, new, expected):
    with pytest.raises(InputError, match=expected):
        load_bearing_rig_params(rig_file(tmp_path, (old, new)))


def test_a_rig_has_one_bearing(tmp_path):
    with pytest.raises(InputError, match=r"kind.*parallel_shaft.*bearing_rig, as machine mfpt has it"):
        load_bearing_rig_params("unsw_parallel")
    plate = (tmp_path / "plate_only.yaml").resolve()
    plate.write_text(machine_file("gear0").read_text(encoding="utf-8").partition("\nmodel:")[0], "utf-8")
    with pytest.raises(InputError, match=r"kind.*None.*bearing_rig"):
        load_bearing_rig_params(plate)


def test_a_channel_that_the_model_lacks_is_named():
    scenario = load_scenario("cwru_inner", {"sensors": {}})  # all channels of the machine: the fan end too
    with pytest.raises(InputError, match=r"fan_end"):
        Simulation(scenario)
