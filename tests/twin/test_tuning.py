"""Knobs of shipped machines: what the description has, scaled, and nothing else."""

from __future__ import annotations

import pytest

from gearsim_io.machines import read_machine_file
from gearsim_sim.scenario import parse_scenario
from gearsim_twin.knobs import KNOBS
from gearsim_twin.tuning import tuning_of

MACHINES = {
    "lpm22": "unsw_parallel",
    "lpm34": "unsw_parallel",
    "cb146": "unsw_parallel",
    "cb182": "unsw_parallel",
    "planetary18": "unsw_planetary",
    "planetary_cb": "unsw_planetary",
    "bearing2": "mfpt",
    "bearing4": "mfpt",
    "bearing5": "mfpt",
}


@pytest.mark.parametrize("model", KNOBS)
def test_every_knob_turns_numbers_that_the_simulator_knows(model, tmp_path):
    machine = MACHINES[model]
    tuning = tuning_of(machine, model)
    assert len(tuning.settings) >= 4
    content = {"machine": machine, "model": model, "operating_point": {"speed": "2 Hz", "load": "5 N*m"}}
    changed = tuning.apply(content, [0.5] * len(tuning.settings))
    scenario = parse_scenario(changed, tmp_path / "tuned.yaml")
    from gearsim_sim.models import parameters

    parameters(scenario)  # refuses names that are not there
    assert "parameters" not in content
    assert set(changed["parameters"]) == {name for s in tuning.settings for name, _, _ in s.numbers}


def test_nominal_coordinates_change_nothing_and_others_scale():
    tuning = tuning_of("unsw_parallel", "lpm34")
    content = {"machine": "unsw_parallel"}
    assert tuning.apply(content, tuning.nominal) == content
    one = [1.0 if s.name == "mesh stiffness" else 0.0 for s in tuning.settings]
    changed = tuning.apply(content, one)["parameters"]
    described = read_machine_file("unsw_parallel")[1]["model"]["mesh"]["mean_stiffness"]["value"]
    assert list(changed) == ["mesh.mean_stiffness"]
    assert changed["mesh.mean_stiffness"]["value"] == pytest.approx(1.1 * float(described))


def test_what_is_assumed_is_less_sure_than_what_a_table_tells():
    known = {s.name: s.prior.factor for s in tuning_of("unsw_parallel", "lpm34").settings}
    told = next(k for k in KNOBS["lpm34"] if k.name == "pedestal stiffness").factor
    assert known["pedestal stiffness"] == pytest.approx(told**2)  # assumed in the description
    assert known["mesh stiffness"] == pytest.approx(1.1)  # thesis Table A.1
