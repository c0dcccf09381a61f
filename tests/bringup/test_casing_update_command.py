"""`gearsim casing update` on a coarse casing."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from gearsim_bringup.cli import BAD_INPUT, main
from gearsim_sim.model.casing.params import FOLDER, load_casing


@pytest.fixture
def coarse(tmp_path: Path) -> str:
    text = (FOLDER / "unsw_casing.yaml").read_text()
    for old, new in (
        ("name: unsw_casing", "name: coarse"),
        ("plate_size: {value: 7.5,", "plate_size: {value: 25,"),
        ("ring_layers: {value: 4,", "ring_layers: {value: 1,"),
    ):
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "coarse.yaml"
    path.write_text(text)
    return str(path)


def test_update_leaves_description_table_and_pictures(coarse, tmp_path, capsys):
    out = tmp_path / "updated"
    assert main(["casing", "update", coarse, "--steps", "3", "--mirrored", "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["after"]["mean_percent"] < told["before"]["mean_percent"]
    assert {Path(file).name for file in told["files"]} == {file.name for file in out.iterdir()}
    assert all(Path(file).stat().st_size > 500 for file in told["files"])
    assert told["change"]["end_a/b1_weld"] == told["change"]["end_b/b4_weld"]
    with (out / "pairs.csv").open() as stream:
        rows = list(csv.reader(stream))
    assert len(rows) == 18
    off = [abs(float(row[-1])) for row in rows[1:]]
    # The table is rounded to hundredths.
    assert sum(off) / 17 == pytest.approx(told["after"]["mean_percent"], abs=0.01)
    assert load_casing(str(out / "updated.yaml")).name == "coarse_updated"


def test_a_virtual_hammer_test_is_struck_identified_and_updated_to(coarse, tmp_path, capsys):
    out = tmp_path / "hammer"
    assert (
        main(["casing", "update", coarse, "--hammer", "4", "--steps", "4", "--out", str(out), "--json"]) == 0
    )
    told = json.loads(capsys.readouterr().out)
    assert told["after"]["mean_percent"] < 0.5 * told["before"]["mean_percent"]
    assert set(told["true_change"]) == set(told["change"])
    names = {file.name for file in out.iterdir()}
    assert {"mac.png", "responses.png", "updated.yaml"} <= names
    assert {Path(file).name for file in told["files"]} == names


def test_a_file_in_the_way_is_told_in_one_line(coarse, tmp_path, capsys):
    out = tmp_path / "taken"
    out.write_text("")
    assert main(["casing", "update", coarse, "--steps", "1", "--out", str(out)]) == BAD_INPUT
    assert "--out" in capsys.readouterr().err
