"""`gearsim casing`: what a user meets, on a coarse casing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from gearsim_bringup.cli import BAD_INPUT, main
from gearsim_sim.frf.file import load_responses
from gearsim_sim.model.casing.reduced import find_reduced, load_reduced


def test_build_writes_what_reduce_reads(coarse, tmp_path, capsys):
    out = tmp_path / "built"
    deck_file = tmp_path / "c.bdf"
    assert main(["casing", "build", coarse, "--out", str(out), "--deck", str(deck_file), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["displacements"] > 1000
    names = {Path(file).name for file in told["files"]}
    assert names == {"stiffness.npz", "mass.npz", "casing.yaml", "c.bdf"}
    deck = deck_file.read_text()
    assert deck.count("CQUAD4*") == told["shells"]
    assert deck.count("CHEXA*") == told["solids"]
    assert deck.count("GRID*") == told["nodes"]
    for arguments in ([coarse], [str(out / "casing.yaml")]):
        file = tmp_path / "reduced.npz"
        assert main(["casing", "reduce", *arguments, "--modes", "20", "--out", str(file), "--json"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert (told["size"], told["modes"], told["masters"]) == (44, 20, ["b1", "b2", "b3", "b4"])
        assert 0 < told["valid_hz"] <= told["cutoff_hz"]
        assert load_reduced(file).size == 44


def test_sensors_anywhere_come_into_the_file(coarse, tmp_path, capsys):
    file = tmp_path / "reduced.npz"
    sensor = ["--sensor", "lid:0,0.095,0.06:y"]
    assert main(["casing", "reduce", coarse, "--modes", "10", *sensor, "--out", str(file)]) == 0
    assert "lid" in capsys.readouterr().out
    site = load_reduced(file).site("lid")
    assert site.direction == (0.0, 1.0, 0.0)
    assert main(["casing", "build", coarse, "--deck", str(tmp_path / "c.bdf")]) == 0
    cards = (tmp_path / "c.bdf").read_text().split("GRID*")[1:]
    near = [card for card in cards if abs(_place(card) - np.array(site.position_m)).max() < 1e-6]
    number = near[0][:20].split()[0]
    numbered = ["--sensor", f"again:{number}:0,2,0"]
    assert main(["casing", "reduce", coarse, "--modes", "10", *numbered, "--out", str(file)]) == 0
    again = load_reduced(file).site("again")
    assert again.position_m == site.position_m
    assert np.array_equal(again.rows, site.rows)


def _place(card: str) -> np.ndarray:
    """Coordinates of a node in a deck, from its card of large fields."""
    first, second = (line.ljust(80) for line in card.splitlines()[:2])
    return np.array([float(first[35:51]), float(first[51:67]), float(second[8:24])])


def test_responses_are_made_from_a_description_and_from_a_reduced_casing(coarse, tmp_path, capsys):
    reduced, own, again = (tmp_path / name for name in ("reduced.npz", "own.npz", "again.npz"))
    sensor = ["--sensor", "lid:0,0.095,0.06:y"]
    assert main(["casing", "reduce", coarse, "--modes", "40", *sensor, "--out", str(reduced)]) == 0
    few = ["--modes", "40", "--band", "1000"]
    assert main(["casing", "responses", coarse, *few, *sensor, "--out", str(own)]) == 0
    told = capsys.readouterr().out
    assert "b1_x, b1_y, b2_x" in told
    assert "lid" in told
    assert main(["casing", "responses", str(reduced), "--band", "1000", "--out", str(again), "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert content["sensors"][-1] == "lid"
    lines = np.array([100.0, 1000.0])
    both = [load_responses(file).accelerances(lines) for file in (own, again)]
    assert np.allclose(*both, rtol=1e-6, atol=1e-9 * np.abs(both[0]).max())
    for arguments, message in (
        ([str(reduced), "--band", "9000"], "a reduction valid to 9000 Hz"),
        ([str(reduced), *sensor, "--band", "1000"], "gearsim casing reduce"),
        ([str(own)], "as `gearsim casing reduce` writes it"),
    ):
        assert main(["casing", "responses", *arguments, "--out", str(tmp_path / "no.npz")]) == BAD_INPUT
        assert message in capsys.readouterr().err
    assert not (tmp_path / "no.npz").exists()


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["reduce", "no_casing", "--out", "x.npz"], "one of unsw_casing"),
        (["reduce", "--out", "x.txt"], "ends in .npz"),
        (["reduce", "--out", "none/x.npz"], "folder that exists"),
        (["reduce", "--out", "x.npz", "--sensor", "far:9,9,9:y"], "sensor far"),
        (["reduce", "--out", "x.npz", "--sensor", "far"], "NAME:X,Y,Z:DIRECTION"),
        (["reduce", "--out", "x.npz", "--sensor", "far:0:y"], "sensor far: got node 0, expected 1 to"),
        (["reduce", "--out", "x.npz", "--modes", "-1"], "--modes"),
        (["reduce", "--out", "x.npz", "--modes", "8", "--band", "4000"], "valid up to"),
        (["check", "none.yaml"], "no such file"),
        (["show", "--out", "pictures", "--modes", "0"], "--modes"),
    ],
)
def test_mistakes_are_one_line(arguments, told, coarse, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "reduce" in arguments and "no_casing" not in arguments:
        arguments = ["reduce", coarse, *arguments[1:]]
    assert main(["casing", *arguments]) == BAD_INPUT
    said = capsys.readouterr().err.strip()
    assert told in said
    assert "\n" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["coarse.yaml"]


def test_pictures_are_drawn(coarse, tmp_path, capsys):
    assert main(["casing", "show", coarse, "--modes", "5", "--out", str(tmp_path / "p"), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["frequencies_hz"]) == 5
    assert told["frequencies_hz"][0] > 100  # rigid-body modes are left out
    for file in told["files"]:
        assert Path(file).read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("name", ["unsw_casing", "unsw_casing_updated"])
def test_the_shipped_casings_are_as_large_and_good_as_that_of_the_thesis(name):
    casing = find_reduced(name)
    assert casing.name == name
    assert casing.size == 124
    assert casing.masters == ("b1", "b2", "b3", "b4")
    # Within 0.1, 0.3 and 0.6 % below 1, 2 and 4 kHz.
    assert casing.valid_hz > 4000
    assert casing.provenance["accuracy"] == [[1000.0, 0.001], [2000.0, 0.003], [4000.0, 0.006]]
    assert casing.site("b3_top_y").direction == (0.0, 1.0, 0.0)
