"""`gearsim twin`: its words, its folder, its exit codes; the judge itself is tested under tests/twin."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from gearsim_bringup import cli
from gearsim_bringup.offline import simulate_to
from gearsim_bringup.options import spread
from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import to_record

OPTIONS = ("--healthy", "--holdout")


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("a b --holdout c d --json", "a b --holdout c --holdout d --json"),
        ("--holdout c --machine m a", "--holdout c --machine m a"),
        ("--healthy=h1 h2 --holdout c d e", "--healthy=h1 --healthy h2 --holdout c --holdout d --holdout e"),
        ("--holdout c d -- a b", "--holdout c --holdout d -- a b"),
        ("--machine m a b", "--machine m a b"),
        ("--holdout - d --json", "--holdout - --holdout d --json"),
    ],
)
def test_options_take_several_values(words, expected):
    assert spread(words.split(), OPTIONS) == expected.split()


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("twin") / "bag"
    simulate_to(load_scenario("quick"), 3.2, folder, ("mcap",))
    return folder


class Said:
    """A verdict that needs no judge."""

    def __init__(self, extended: Path) -> None:
        self.extended = extended
        self.remarks = ("no held-out record was given ...", "bag: the lines tell another speed")

    def words(self) -> str:
        return "The model misses mains_interference."

    def to_json(self) -> dict[str, object]:
        score = {"metric": "rms_db", "baseline": 9.1, "tuned_only": 6.2, "extended": 1.3, "noise_floor": 1.1}
        number = {"value": 50.01, "unit": "Hz", "ci95": [49.9, 50.1]}
        cause = {
            "name": "mains_interference",
            "component": "b3_y",
            "parameters": {"frequency_hz": number},
            "heldout_gain_db": 4.9,
            "probability": 0.97,
            "signature": "lines at 50 Hz and multiples",
        }
        place = {"id": "1", "domain": "psd", "where": "b3_y at 50 Hz", "size_db": 21.0, "z": 14.0}
        return {
            "verdict": "explained",
            "score": {**score, "heldout": True},
            "discrepancies": [{**place, "explained_by": "mains_interference"}] * 14,
            "causes": [cause],
            "rejected": [{"name": "inverter_lines", "why": "no group of lines", "heldout_gain_db": None}],
            "extended_model": str(self.extended),
            "remarks": [float("nan")],
        }


@pytest.fixture
def judged(monkeypatch: pytest.MonkeyPatch) -> dict[str, object]:
    """What the judge was asked; it answers at once."""
    asked: dict[str, object] = {}

    def judge(case, settings, out, tell, show):
        tell("simulating")
        out.write_text("machine: unsw_parallel\n", encoding="utf-8")
        asked.update(case=case, settings=settings, out=out, show=show)
        if "fails" in asked:
            raise asked["fails"]
        return Said(out)

    monkeypatch.setattr("gearsim_twin.judge.judge", judge)
    monkeypatch.setattr("gearsim_bringup.twin_report.page.make_twin_page", lambda verdict: verdict.words())
    return asked


def twin(*words: str | Path) -> int:
    return cli.main(["twin", *map(str, words), "--machine", "unsw_parallel", "--model", "lpm34"])


def test_json_is_one_object_and_the_folder_holds_all_files(bag, judged, tmp_path, capsys):
    out = tmp_path / "report"
    assert twin(bag, "--json", "--report", out, "--seed", "5", "--workers", "1") == 0
    printed = capsys.readouterr()
    content = json.loads(printed.out)
    assert content["verdict"] == "explained"
    assert content["remarks"] == [None]
    assert "note: no held-out record" in printed.err
    assert "twin: simulating" in printed.err
    assert printed.err.count("note: ") == 2
    assert "note: bag: the lines tell another speed" in printed.err
    assert {path.name for path in out.iterdir()} == {"twin.json", "extended.yaml", "report.html"}
    assert (out / "report.html").read_text() == "The model misses mains_interference."
    assert judged["show"]
    assert json.loads((out / "twin.json").read_text()) == content
    assert (judged["settings"].seed, judged["settings"].workers) == (5, 1)
    assert judged["case"].split


def test_people_get_lines_and_a_folder_that_is_free(bag, judged, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out" / "twin_1").mkdir(parents=True)
    assert twin(bag) == 0
    told = capsys.readouterr().out
    assert judged["out"] == Path("out/twin_2/extended.yaml")
    assert "error on held-out records: baseline 9.10 dB, tuned only 6.20 dB, extended 1.30 dB" in told
    assert "cause: mains_interference of b3_y, probability 0.97, held-out gain 4.90 dB" in told
    assert "frequency_hz: 50.01 Hz (95 %: 49.9 to 50.1)" in told
    assert "rejected: inverter_lines: no group of lines" in told
    assert told.count("differs: b3_y at 50 Hz: +21.0 dB (z +14.0), explained by mains_interference") == 12
    assert "... and 2 more places" in told


@pytest.mark.parametrize(("error", "code"), [(KeyboardInterrupt(), 130), (OSError("disk full"), 1)])
def test_what_ends_early_leaves_nothing(error, code, bag, judged, tmp_path, capsys, monkeypatch):
    judged["fails"] = error
    monkeypatch.chdir(tmp_path)
    before = set(tmp_path.iterdir())
    assert twin(bag, "--report", tmp_path / "new" / "report") == code
    assert twin(bag) == code  # to out/twin_1
    assert set(tmp_path.iterdir()) == before
    assert capsys.readouterr().err.strip().splitlines()[-1].startswith("gearsim: ")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("{bag}", "--holdout", "{bag}"), "once more, expected a recording that nothing is fitted to"),
        (("{bag}", "nothing.mat"), "nothing.mat: got nothing there"),
        (("{bag}", "--report", "{bag}"), "a folder that exists already"),
        (("--holdout", "{bag}"), "MEASURED"),
        (("{bag}", "--workers", "0"), "--workers"),
    ],
)
def test_bad_input_is_told_in_one_line(words, told, bag, judged, capsys):
    assert twin(*(word.format(bag=bag) for word in words)) == 2
    printed = capsys.readouterr()
    assert told in printed.err
    assert printed.out == ""
    assert len(printed.err.strip().splitlines()) == 1
    assert not judged


RIG = {
    "machine": "mfpt",
    "model": "bearing5",
    "sample_rate": "12000 Hz",
    "operating_point": {"speed": "24.8 Hz", "load": "0 N*m"},
    "sensors": {"tachos": {"shafts": ["shaft"]}, "encoders": {"shafts": []}},
    "faults": [{"kind": "outer_race_spall", "component": "test_bearing", "params": {"width_m": "0.5 mm"}}],
}
WORDS = {"consistent", "explained", "partly_explained", "unknown"}


def test_the_whole_way_from_a_bag_to_a_model_that_runs(tmp_path, capsys):
    """The contract of --json; what the judge finds is tested where the judge is."""
    simulate_to(parse_scenario(RIG, Path("rig.yaml")), 2.4, tmp_path / "bag", ("mcap",))
    words = ["--machine", "mfpt", "--model", "bearing5", "--json", "--workers", "1"]
    code = cli.main(["twin", str(tmp_path / "bag"), *words, "--report", str(tmp_path / "report")])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    content = json.loads(printed.out)
    assert content["verdict"] in WORDS
    assert {"metric", "baseline", "tuned_only", "extended", "noise_floor", "heldout"} <= set(content["score"])
    assert content["score"]["heldout"] is True
    for one in content["discrepancies"]:
        assert {"id", "domain", "where", "size_db", "z", "explained_by"} <= set(one)
    assert content["discrepancies"]  # the model has no spall
    for one in content["causes"]:
        assert {"name", "parameters", "heldout_gain_db", "probability", "signature"} <= set(one)
        for number in one["parameters"].values():
            assert {"value", "unit", "ci95"} <= set(number)
    for one in content["rejected"]:
        assert {"name", "why", "heldout_gain_db"} <= set(one)
    extended = Path(content["extended_model"])
    assert extended.parent == tmp_path / "report"
    assert to_record(load_scenario(extended), 0.2).channels == ("accel",)
    page = (tmp_path / "report" / "report.html").read_text()
    assert "Map of discrepancies" in page
    assert "Not shown" not in page
