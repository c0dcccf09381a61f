"""`gearsim casing update` on a coarse casing."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest

from gearsim_bringup.cli import BAD_INPUT, main
from gearsim_sim.model.casing.params import load_casing


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
    out, export = tmp_path / "hammer", tmp_path / "test.uff"
    hammer = ["casing", "update", coarse, "--hammer", "4", "--steps", "4", "--export", str(export)]
    assert main([*hammer, "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["after"]["mean_percent"] < 0.5 * told["before"]["mean_percent"]
    assert set(told["true_change"]) == set(told["change"])
    names = {file.name for file in out.iterdir()}
    assert {"mac.png", "responses.png", "updated.yaml"} <= names
    assert {Path(file).name for file in told["files"]} == names | {"test.uff"}
    # The same responses through a file, as a laboratory's: the same modes, the same pairs.
    back = ["casing", "update", coarse, "--test", str(export), "--steps", "1"]
    assert main([*back, "--out", str(tmp_path / "back"), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    assert again["modes_of_test"] == pytest.approx(told["modes_of_test"], rel=1e-9)
    assert again["before"] == pytest.approx(told["before"], rel=1e-6)
    assert {file.name for file in (tmp_path / "back").iterdir()} == names


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--test", "none.uff"], "none.uff: got no such file"),
        (["--test", "none.uff", "--hammer", "1"], "one of them at a time"),
        (["--placement", "p.yaml"], "--placement goes with --test"),
        (["--band", "100", "500"], "--band goes with --test"),
        (["--test", "none.uff", "--placement", "p.yaml"], "p.yaml: got no such file"),
        (["--test", "none.uff", "--band", "0", "500"], "--band"),
        (["--export", "test.uff"], "--export goes with --hammer"),
        (["--hammer", "1", "--export", "test.txt"], "ends in .uff"),
    ],
)
def test_options_that_do_not_go_together_are_one_line(arguments, told, coarse, tmp_path, capsys):
    assert main(["casing", "update", coarse, *arguments, "--out", str(tmp_path / "out")]) == BAD_INPUT
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "\n" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["coarse.yaml"]


def test_other_kinds_of_casings_are_not_updated(tmp_path, capsys):
    arguments = ["casing", "update", "unsw_planetary_housing", "--out", str(tmp_path / "out")]
    assert main(arguments) == BAD_INPUT
    assert "kind: got ring_housing, expected a box of plates" in capsys.readouterr().err


def test_a_file_in_the_way_is_told_in_one_line(coarse, tmp_path, capsys):
    out = tmp_path / "taken"
    out.write_text("")
    assert main(["casing", "update", coarse, "--steps", "1", "--out", str(out)]) == BAD_INPUT
    assert "--out" in capsys.readouterr().err
