"""What a case holds, and what is refused in which words."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from rig_records import RATE_HZ, case_of, parallel_record, rig_record, turning

from gearsim_io.errors import InputError
from gearsim_io.machines import machine_file
from gearsim_io.record import Record
from gearsim_twin.case import least_seconds, load_case
from gearsim_twin.recordings import cut, same_recording, thinned


def with_(record: Record, **changes: object) -> Record:
    return dataclasses.replace(record, **changes)


def without_model(folder: Path) -> Path:
    """A machine whose description has a nameplate only."""
    text, _, _ = machine_file("gear0").read_text(encoding="utf-8").partition("\nmodel:")
    path = folder / "plate_only.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_last_third_is_held_out_and_nothing_is_lost():
    record = parallel_record()
    case = case_of("unsw_parallel", "lpm34", record)
    (training,), (held,) = case.training, case.holdout
    assert case.split
    assert any("last third" in remark for remark in case.remarks)
    assert held.sample_count == record.sample_count // 3
    assert np.array_equal(np.hstack([training.data, held.data]), record.data)
    torques = np.hstack([training.torques.data_nm, held.torques.data_nm])
    assert np.array_equal(torques, record.torques.data_nm)
    for k, train in enumerate(record.tachos):
        both = np.concatenate([training.tachos[k].samples, held.tachos[k].samples + training.sample_count])
        assert np.array_equal(both, train.samples)
    assert held.first_sample == training.sample_count
    assert held.t0_ns == round(training.sample_count / RATE_HZ * 1e9)


def test_edges_that_are_cut_keep_their_numbers():
    from gearsim_io.record import EdgeTrain

    edges = EdgeTrain("input", 4, 10, np.arange(0.5, 100, 7.0))
    record = Record(1000.0, ("b1_y",), "m/s^2", np.ones((1, 100), np.float32), encoders=(edges,))
    part = cut(record, 30, 60).encoders[0]
    assert part.first_edge == 15  # edges 10 to 14 are at 0.5, 7.5 ... 28.5
    assert part.samples[0] == pytest.approx(5.5)
    assert np.all(part.samples < 30)


def test_given_records_are_held_out_whole():
    case = case_of("unsw_parallel", "lpm34", parallel_record(), holdout=(parallel_record(1.5, seed=2),))
    assert not case.split
    assert [one.seconds for one in case.records] == [3.0, 1.5]
    assert len(case.views()) == 2


# Slowest is the cage of the bearings: 10 Hz (1 - 7.12 / 38.5) / 2 = 4.075 Hz, four turns of it 0.982 s.
CAGE_S = 4 / (10 * 0.5 * (1 - 7.12 / 38.5))


def test_how_long_a_record_must_be():
    case = case_of("unsw_parallel", "lpm34", parallel_record())
    assert least_seconds(case.machine) == pytest.approx(CAGE_S, rel=1e-12)
    planetary = case_of("unsw_planetary", "planetary18", noise(("ring",), 40000, 4096.0)).machine
    assert least_seconds(planetary) == pytest.approx(4 / 2.13333, rel=1e-4)  # the carrier


def noise(channels: tuple[str, ...], samples: int, rate_hz: float, seed: int = 0) -> Record:
    data = np.random.default_rng(seed).standard_normal((len(channels), samples)).astype(np.float32)
    return Record(rate_hz, channels, "m/s^2", data, source=f"noise {seed}")


@pytest.mark.parametrize(("seconds", "ok"), [(2.90, False), (2.96, True)])
def test_short_records_are_refused_with_the_length_that_would_do(seconds, ok):
    record = noise(("b1_y",), round(seconds * 4096), 4096.0)
    if ok:
        assert case_of("unsw_parallel", "lpm34", record)
        return
    with pytest.raises(InputError, match=r"length: got 2\.9 s, expected at least 2\.95 s.*or 0\.982 s with"):
        case_of("unsw_parallel", "lpm34", record)
    held = noise(("b1_y",), 3000, 4096.0, 1)
    with pytest.raises(InputError, match=r"noise 1: length: got 0\.732 s, expected at least 0\.982 s"):
        case_of("unsw_parallel", "lpm34", record, holdout=(held,))


def test_one_recording_in_two_places_is_refused():
    record = parallel_record()
    scaled = with_(record, data=record.data * np.float32(9.81), source="scaled.npz")
    part = with_(cut(record, 5000, 20000), source="part.npz")
    for again in (record, scaled, part):
        with pytest.raises(InputError, match=r"--holdout.*of MEASURED once more.*nothing is fitted to"):
            case_of("unsw_parallel", "lpm34", record, holdout=(again,))
        with pytest.raises(InputError, match=r"--healthy.*once more.*without the effect"):
            case_of("unsw_parallel", "lpm34", record, healthy=(again,))
    with pytest.raises(InputError, match=r"MEASURED.*once more, expected every recording once"):
        case_of("unsw_parallel", "lpm34", record, scaled)
    assert not same_recording(record, parallel_record(1.5, seed=2))
    # The same run with other noise, 60 dB down, is another recording.
    noise = np.random.default_rng(0).standard_normal(record.data.shape) * 1e-3 * record.data.std()
    assert not same_recording(record, with_(record, data=(record.data + noise).astype(np.float32)))


def test_models_that_do_not_describe_the_machine(tmp_path):
    record = parallel_record()
    with pytest.raises(InputError, match=r"--model: got lpm43.*did you mean lpm34\?"):
        case_of("unsw_parallel", "lpm43", record)
    with pytest.raises(
        InputError, match="a model that describes unsw_parallel: one of cb146, cb182, lpm22, lpm34"
    ):
        case_of("unsw_parallel", "planetary18", record)
    with pytest.raises(InputError, match=r"section `model`.*docs/rigs.md; the machines .*mfpt.* have one"):
        case_of(str(without_model(tmp_path)), "lpm34", record)


def test_channels_that_cannot_be_compared():
    record = noise(("drive_end", "fan_end"), 60000, 12000.0)
    case = case_of("cwru_drive_end", "bearing5", record)
    assert case.channels == ("drive_end",)
    assert "channel fan_end is left out: bearing5 has no such place" in case.remarks
    assert case.originals[0].channels == ("drive_end", "fan_end")  # which all tell the speed
    with pytest.raises(InputError, match="channels: got fan_end, expected a channel that bearing5 gives"):
        case_of("cwru_drive_end", "bearing5", noise(("fan_end",), 60000, 12000.0))
    broken = noise(("b1_y", "b2_y", "b3_y"), 16384, 4096.0)
    broken.data[1] = 3.0
    case = case_of("unsw_parallel", "lpm34", broken, noise(("b1_y", "b2_y"), 16384, 4096.0, 1))
    assert case.channels == ("b1_y",)
    assert any("b2_y is left out: noise 0 has a constant" in remark for remark in case.remarks)
    assert any("b3_y is left out: noise 1 does not have it" in remark for remark in case.remarks)
    with pytest.raises(InputError, match=r"at least one good channel that all records have.*b1_y: noise 1"):
        case_of("unsw_parallel", "lpm34", noise(("b1_y",), 16384, 4096.0), noise(("b2_y",), 16384, 4096.0, 1))


def test_units_and_rates_of_several_records():
    one, other = noise(("accel",), 90000, 20000.0), noise(("accel",), 90000, 20000.0, 1)
    unknown = case_of("mfpt", "bearing5", with_(one, unit="1"))
    assert not unknown.levels_known
    assert any("works on shapes" in remark for remark in unknown.remarks)
    assert case_of("mfpt", "bearing5", one).levels_known
    with pytest.raises(InputError, match=r"noise 1: unit: got 1, expected m/s\^2.*--unit"):
        case_of("mfpt", "bearing5", one, with_(other, unit="1"))
    with pytest.raises(InputError, match=r"sampling rate: got 500 Hz, expected 1000 to 1e\+06 Hz"):
        case_of("mfpt", "bearing5", with_(one, sample_rate_hz=500.0))
    with pytest.raises(InputError, match=r"20500 Hz, expected 20000 Hz .*whole multiple"):
        case_of("mfpt", "bearing5", one, with_(other, sample_rate_hz=20500.0))
    twice = case_of("mfpt", "bearing5", one, with_(other, sample_rate_hz=40000.0))
    assert [r.sample_rate_hz for r in twice.records] == [20000.0] * 4
    assert any("noise 1 was thinned from 40000 Hz to 20000 Hz" in remark for remark in twice.remarks)


def test_a_thinned_record_has_what_was_below_and_nothing_of_what_was_above():
    rate_hz, n = 8000.0, 16000
    t = np.arange(n) / rate_hz
    low, high = np.sin(2 * np.pi * 850 * t + 0.3), np.sin(2 * np.pi * 1150 * t)
    record = with_(turning(np.full(n, 10.0), rate_hz), data=np.array([low + high, low], np.float32))
    record = with_(record, channels=("b1_y", "b2_y"))
    thin = thinned(record, 4)
    assert thin.sample_rate_hz == 2000.0
    middle = slice(200, 3800)  # the filter's ends see zeros
    expected = np.sin(2 * np.pi * 850 * np.arange(4000) / 2000.0 + 0.3)
    # 850 Hz is below 0.45 and 1150 Hz beyond 0.55 of the new rate: both errors are the filter's 100 dB.
    assert np.max(np.abs(thin.data[:, middle] - expected[middle])) < 2e-5
    assert np.allclose(thin.tachos[0].samples * 4, record.tachos[0].samples)


def test_bags_and_files_give_the_same_case(tmp_path: Path):
    from gearsim_bringup.offline import simulate_to
    from gearsim_sim.scenario import load_scenario

    simulate_to(load_scenario("quick"), 3.2, tmp_path / "bag", ("mcap", "npz"))
    bag, file = tmp_path / "bag", tmp_path / "bag" / "signals.npz"
    of_bag = load_case([bag], "unsw_parallel", "lpm34")
    of_file = load_case([file], "unsw_parallel", "lpm34")
    assert of_bag.channels == of_file.channels
    assert np.array_equal(of_bag.training[0].data, of_file.training[0].data)
    assert not any("nameplate" in remark for remark in of_bag.remarks)
    own = tmp_path / "mine.yaml"
    text = machine_file("unsw_parallel").read_text(encoding="utf-8")
    own.write_text(text.replace("value: 7.12, unit: mm", "value: 7.00, unit: mm"), encoding="utf-8")
    remarks = load_case([bag], own, "lpm34").remarks
    assert any("nameplate in the bag has other bearings than the description" in one for one in remarks)
    with pytest.raises(InputError, match="once more"):
        load_case([bag], "unsw_parallel", "lpm34", holdout=[file])
    with pytest.raises(InputError, match=r"--holdout: .*got the recording .*bag of MEASURED once more"):
        load_case([bag], "unsw_parallel", "lpm34", holdout=[tmp_path / "." / "bag"])
    with pytest.raises(InputError, match=r"none\.npz: got nothing there, expected a bag or a measured file"):
        load_case([tmp_path / "none.npz"], "unsw_parallel", "lpm34")


@pytest.mark.records
def test_real_records_make_cases(record_file: Callable[[str], Path]):
    names = [f"mfpt/OuterRaceFault_vload_{k}.mat" for k in (1, 3, 5)]
    files = [record_file(name) for name in names]
    case = load_case(files[:2], "mfpt", "bearing5", [record_file("mfpt/baseline_1.mat")], files[2:])
    assert {record.sample_rate_hz for record in case.records} == {48828.0}
    assert any("baseline_1.mat was thinned from 97656" in remark for remark in case.remarks)
    hit = load_case([record_file("hit_sm/SQ_OR2_1200.mat")], "hit_sq", "bearing5")
    assert not hit.levels_known
    assert rig_record().channels == case.channels
