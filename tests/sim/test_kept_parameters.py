"""Parameters of machines are read once, and again when the file or what a scenario replaces is another."""

from __future__ import annotations

import os
from pathlib import Path

from gearsim_io.machines import machine_file
from gearsim_sim.models import parameters
from gearsim_sim.scenario import parse_scenario


def _parameters(machine: str | Path, **replaced: str):
    point = {"speed": "2.1333 Hz", "load": "46.9 N*m"}
    content = {"machine": str(machine), "model": "planetary18", "operating_point": point}
    return parameters(parse_scenario({**content, "parameters": replaced}, Path("kept.yaml")))


def test_the_same_scenario_shares_its_parameters_and_another_does_not() -> None:
    first = _parameters("unsw_planetary", **{"planet.mass": "0.12 kg"})
    assert _parameters("unsw_planetary", **{"planet.mass": "0.12 kg"}) is first
    heavier = _parameters("unsw_planetary", **{"planet.mass": "0.13 kg"})
    assert (first.model.planet.mass_kg, heavier.model.planet.mass_kg) == (0.12, 0.13)


def test_a_machine_file_that_has_changed_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "own.yaml"
    text = machine_file("unsw_planetary").read_text()
    file.write_text(text)
    before = _parameters(file)
    old = f"{before.model.mesh.mean_stiffness_n_per_m:g}"
    changed = text.replace("name: ", "name:  ", 1)
    file.write_text(changed)
    os.utime(file, ns=(1, 1))
    assert _parameters(file) is not before
    assert f"{_parameters(file).model.mesh.mean_stiffness_n_per_m:g}" == old
