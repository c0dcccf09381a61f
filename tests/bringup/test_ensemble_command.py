"""`gearsim ensemble`: a YAML of variants becomes one file for each, with what was chosen for it."""

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from gearsim_bringup import cli
from gearsim_io.errors import InputError
from gearsim_sim.engine import Engine
from gearsim_sim.ensemble_spec import load_ensemble_spec
from gearsim_sim.models import parameters

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "ensemble.yaml"
BASE = """
machine: unsw_parallel
operating_point: {speed: 10 Hz, load: 50 N*m}
faults: [{id: spall, kind: outer_race_spall, component: bearing_3}]
timeline: [{at: 10 ms, set: {speed: 12 Hz, ramp: 20 ms}}]
"""
SPEC = """
base: base.yaml
seed: 3
count: 2
random:
  load: {from: 40 N*m, to: 60 N*m}
  severity: {spall: {from: 0.2, to: 0.4}}
  parameters: {mesh.damping: {from: 500 N*s/m, to: 900 N*s/m}}
variants: [{name: plain, faults: [], parameters: {mesh.damping: 700 N*s/m}}]
"""


def written(folder, spec=SPEC):
    (folder / "base.yaml").write_text(BASE)
    (folder / "many.yaml").write_text(spec)
    return folder / "many.yaml"


def test_the_example_is_read():
    spec = load_ensemble_spec(EXAMPLE)
    assert len(spec.variants) == 34
    speeds = [one.scenario.speed_hz for one in spec.variants[:32]]
    assert min(speeds) >= 9
    assert max(speeds) <= 11
    assert np.std(speeds) > 0.3
    assert spec.variants[-2].scenario.faults == ()


def test_what_is_drawn_depends_on_seed_and_number_only(tmp_path):
    first = load_ensemble_spec(written(tmp_path))
    more = load_ensemble_spec(written(tmp_path, SPEC.replace("count: 2", "count: 5")))
    other = load_ensemble_spec(written(tmp_path, SPEC.replace("seed: 3", "seed: 4")))
    assert [one.chosen for one in first.variants[:2]] == [one.chosen for one in more.variants[:2]]
    assert first.variants[0].chosen["load_nm"] != other.variants[0].chosen["load_nm"]


def test_files_hold_what_the_engine_gives(tmp_path, capsys):
    file = written(tmp_path)
    code = cli.main(["ensemble", str(file), "--seconds", "0.05", "--out", str(tmp_path / "out"), "--json"])
    assert code == 0
    told = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in told["variants"]] == ["v0", "v1", "plain"]
    variant = load_ensemble_spec(file).variants[1].scenario
    engine = Engine(
        parameters(variant), variant.seed, 65536.0, 4, variant.faults,
        speed_hz=variant.speed_hz, load_nm=variant.load_nm,
    )  # fmt: skip
    expected = engine.advance(round(0.05 * 65536), variant.events)
    with np.load(told["variants"][1]["file"]) as found:
        assert found["sample_rate_hz"] == 65536
        for name, signal in zip(expected.site_names, expected.accel, strict=True):
            # Written as float32; an ensemble looks meshes up at every step, an engine at nodes.
            assert found[name] == pytest.approx(signal, abs=1e-5 * np.std(signal))
        angle = (expected.turns + expected.fraction)[0, :: int(found["angle_every"])]
        assert found[f"angle_turns_{expected.shaft_names[0]}"] == pytest.approx(angle, abs=1e-12)
    with open(told["table"]) as table:
        rows = list(csv.DictReader(table))
    assert [row["name"] for row in rows] == ["v0", "v1", "plain"]
    assert [row["seed"] for row in rows] == ["3", "4", "5"]
    assert [repr(one["chosen"]["seed"]) for one in told["variants"]] == ["3", "4", "5"]
    assert 500 <= float(rows[0]["mesh.damping [N*s/m]"]) <= 900
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "plain.npz", "v0.npz", "v1.npz", "variants.csv",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("base: base.yaml", "base: nowhere"), "nowhere"),
        (("count: 2", "count: -1"), "count"),
        (("from: 40 N*m, to: 60", "from: 70 N*m, to: 60"), "random.load"),
        (("{spall: {from", "{other: {from"), "spall"),
        (("to: 900 N*s/m", "to: 900 kg"), "mesh.damping"),
        (("name: plain", "name: v0"), "v0"),
        (("mesh.damping: {from", "mesh.damp: {from"), "mesh"),
    ],
)
def test_mistakes_are_named(tmp_path, change, words):
    file = written(tmp_path, SPEC.replace(*change))
    with pytest.raises(InputError) as error:
        load_ensemble_spec(file).ensemble()
    assert words in str(error.value)
