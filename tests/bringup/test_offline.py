"""simulate, info and diagnose as a user runs them: files, JSON contract, nothing half-written."""

from __future__ import annotations

import json

import numpy as np
import pytest
import soundfile

from gearsim_bringup import cli, offline
from gearsim_io.bags import read_objects, read_record
from gearsim_io.batches import SampleBatch
from gearsim_io.importers import import_file
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

SECONDS = 4.5


@pytest.fixture(scope="module")
def simulated(tmp_path_factory):
    out = tmp_path_factory.mktemp("offline") / "run"
    offline.simulate_to(load_scenario("quick"), SECONDS, out, ("mcap", "npz", "wav"))
    return out


@pytest.fixture(scope="module")
def truth():
    return to_record(load_scenario("quick"), SECONDS)


def run_json(capsys, *words):
    code = cli.main([*words, "--json"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out), printed.err


def test_bag_npz_and_wav_hold_the_same_samples(simulated, truth):
    record = read_record(simulated)
    np.testing.assert_array_equal(record.data, truth.data)
    arrays = np.load(simulated / "signals.npz")
    for name, row in zip(truth.channels, truth.data, strict=True):
        np.testing.assert_array_equal(arrays[name], row)
    sound, rate = soundfile.read(simulated / "signals.wav", dtype="float32")
    np.testing.assert_array_equal(sound.T, truth.data)
    assert rate == truth.sample_rate_hz
    for tacho in truth.tachos:
        np.testing.assert_allclose(arrays[f"tacho_{tacho.shaft}"], tacho.samples, rtol=0, atol=1e-9)
    for encoder in truth.encoders:
        np.testing.assert_allclose(arrays[f"encoder_{encoder.shaft}"], encoder.samples, rtol=0, atol=1e-9)


def test_bag_tells_what_really_ran(simulated):
    truths = [item for item in read_objects(simulated) if type(item).__name__ == "SimpleNamespace"]
    batches = [item for item in read_objects(simulated) if isinstance(item, SampleBatch)]
    assert sum(batch.sample_count for batch in batches) == round(SECONDS * 16384)
    assert truths == []  # read_objects gives what a diagnosis may see, never the truth


def test_info_and_diagnose_by_the_contract(simulated, capsys):
    code, info, _ = run_json(capsys, "info", str(simulated))
    assert (code, info["sound"]) == (0, True)
    names = {topic["name"]: topic["messages"] for topic in info["topics"]}
    assert names["/gearsim/ground_truth"] == 2  # at the start, and when the fault begins
    code, verdict, _ = run_json(capsys, "diagnose", str(simulated))
    assert code == 0
    assert set(verdict) == {"speed_hz", "quality", "healthy", "findings"}
    assert set(verdict["speed_hz"]) == {"value", "ci95", "source"}
    assert verdict["speed_hz"]["source"] == "tacho"
    assert verdict["speed_hz"]["value"] == pytest.approx(10.0, rel=1e-3)
    assert verdict["healthy"] is False
    (finding,) = verdict["findings"]
    assert set(finding) == {
        *("component", "fault", "expected_order", "found_order", "snr_db", "confidence"),
        *("severity", "size_mm", "evidence"),
    }
    assert (finding["component"], finding["fault"]) == ("bearing_3", "outer_race")
    assert finding["found_order"] == pytest.approx(4.8904, rel=3e-3)  # 12 balls, 7.12 / 38.5 mm


def test_the_arrays_import_again(simulated, truth, capsys):
    record = import_file(simulated / "signals.npz", "unsw_parallel")
    np.testing.assert_array_equal(record.data, truth.data)
    assert (record.channels, record.sample_rate_hz) == (truth.channels, truth.sample_rate_hz)
    code, verdict, _ = run_json(
        capsys, "diagnose", str(simulated / "signals.npz"), "--machine", "unsw_parallel"
    )
    assert code == 0
    assert [(f["component"], f["fault"]) for f in verdict["findings"]] == [("bearing_3", "outer_race")]
    assert verdict["speed_hz"]["source"] != "tacho"  # an array file has no tacho that the importer knows


def test_an_existing_folder_is_refused_and_left_alone(tmp_path, capsys):
    taken = tmp_path / "taken"
    taken.mkdir()
    (taken / "mine.txt").write_text("mine")
    assert cli.main(["simulate", "quick", "--seconds", "1", "--out", str(taken)]) == 2
    assert "got a folder that exists already, expected the name of a new folder" in capsys.readouterr().err
    assert [file.name for file in taken.iterdir()] == ["mine.txt"]


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_whatever_interrupts_a_run_leaves_nothing_half_written(error, tmp_path, monkeypatch, capsys):
    class Breaking(offline._NpzSink):
        def take(self, _batches):
            raise error

    monkeypatch.setattr(offline, "_NpzSink", Breaking)
    out = tmp_path / "out"
    code = cli.main(["simulate", "quick", "--seconds", "1", "--out", str(out), "--format", "mcap,npz"])
    assert code == (130 if isinstance(error, KeyboardInterrupt) else 1)
    assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--seconds", "1e-9"), "seconds: got 1e-09"),
        (("--seconds", "1", "--format", "mp3"), "got 'mp3', expected some of mcap, npz, wav"),
    ],
)
def test_what_cannot_be_simulated_is_told(words, expected, tmp_path, capsys):
    assert cli.main(["simulate", "quick", *words, "--out", str(tmp_path / "x")]) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "x").exists()
