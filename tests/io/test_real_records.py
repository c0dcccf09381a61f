"""The measured records, against what scipy and Python's csv read of them."""

from __future__ import annotations

import csv
import gzip

import numpy as np
import pytest
from scipy.io import loadmat

from gearsim_io.bags import read_machine, read_record
from gearsim_io.errors import InputError
from gearsim_io.importers import Overrides, import_file, import_to_bag, machine_for
from gearsim_io.machines import load_machine

pytestmark = pytest.mark.records
G = 9.80665


@pytest.mark.parametrize(
    ("name", "rate_hz", "seconds", "load"),
    [
        ("baseline_1", 97656, 6.0, 270),
        ("OuterRaceFault_1", 97656, 6.0, 270),
        ("OuterRaceFault_vload_1", 48828, 3.0, 25),
        ("InnerRaceFault_vload_3", 48828, 3.0, 100),
    ],
)
def test_mfpt(record_file, name, rate_hz, seconds, load):
    path = record_file(f"mfpt/{name}.mat")
    record = import_file(path, "mfpt")
    raw = loadmat(path)["bearing"]["gs"][0, 0].ravel()
    assert record.sample_rate_hz == rate_hz
    assert record.seconds == pytest.approx(seconds, rel=1e-3)
    assert record.unit == "m/s^2"
    assert np.array_equal(record.data[0], (raw * G).astype(np.float32))
    assert record.notes["load"] == f"{load} lbf"
    assert machine_for(record, load_machine("mfpt")).nominal_speed_hz == 25.0


@pytest.mark.parametrize(("name", "speed_hz"), [("SQ_Normal_600", 10.0), ("SQ_IR2_1200", 20.0)])
def test_hit(record_file, name, speed_hz):
    path = record_file(f"hit_sm/{name}.mat")
    record = import_file(path, "hit_sq")
    raw = next(value for key, value in loadmat(path).items() if not key.startswith("__")).ravel()
    assert np.array_equal(record.data[0], raw.astype(np.float32))
    assert (record.sample_rate_hz, record.unit) == (51200.0, "1")
    assert float(record.notes["speed_hz"]) == speed_hz


@pytest.mark.parametrize(("name", "number"), [("97_Normal_0", "097"), ("135_0", "135")])
def test_cwru(record_file, name, number):
    path = record_file(f"cwru/{name}.mat")
    record = import_file(path, "cwru_drive_end")
    raw = loadmat(path)
    assert record.channels == ("drive_end", "fan_end")
    assert np.array_equal(record.data[0], (raw[f"X{number}_DE_time"].ravel() * G).astype(np.float32))
    assert np.array_equal(record.data[1], (raw[f"X{number}_FE_time"].ravel() * G).astype(np.float32))
    assert float(record.notes["speed_hz"]) == pytest.approx(1796 / 60)


def test_gear0(record_file):
    """The file holds its variables twice, the first time all zero."""
    path = record_file("gear0/3027_217_Data_Chan12.mat")
    record = import_file(path, "gear0")
    assert (record.sample_rate_hz, record.unit) == (25600.0, "m/s^2")
    assert record.seconds == pytest.approx(11.04)
    assert record.data.std() == pytest.approx(26.7225, abs=1e-3)
    assert "occurs several times" in record.notes["variable Data1"]
    with pytest.raises(InputError, match=r"Head_1.SampFreq: got 25600 Hz, expected 256000 Hz"):
        import_file(path, "gear0", Overrides(rate_hz=256_000.0))


def test_wind_turbine(record_file):
    path = record_file("wt_hss_gear/health_20160306171241_25600.csv")
    record = import_file(path, "wt_hss")
    with open(path) as stream:
        raw = [float(row[0]) for row in csv.reader(stream)]
    assert (record.sample_rate_hz, record.unit) == (25600.0, "1")
    assert np.array_equal(record.data[0], np.array(raw).astype(np.float32))
    assert "speed_hz" not in record.notes


def test_gearbox(record_file):
    path = record_file("sq_gearbox/b30hz0.csv.gz")
    record = import_file(path, "sq_gearbox")
    with gzip.open(path, "rt") as stream:
        rows = list(csv.DictReader(stream))
    assert record.channels == ("a1", "a2", "a3", "a4")
    assert record.data.shape == (4, len(rows))
    assert np.array_equal(record.data[2], np.array([float(row["a3"]) for row in rows]).astype(np.float32))
    assert record.notes["load"] == "0 %"


def test_a_real_record_survives_the_bag(record_file, tmp_path):
    path = record_file("mfpt/OuterRaceFault_vload_1.mat")
    ((bag, record),) = import_to_bag([path], "mfpt", tmp_path / "bag")
    back = read_record(bag)
    assert back.data.tobytes() == record.data.tobytes()
    assert back.sample_rate_hz == record.sample_rate_hz
    assert read_machine(bag).bearing("test_bearing") == load_machine("mfpt").bearing("test_bearing")
