"""The measured records with known faults, through the whole diagnosis."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt, zoom_fft

from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.kinematics import fault_families
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

pytestmark = pytest.mark.records

FAULTY = [
    ("mfpt/OuterRaceFault_1.mat", "mfpt", "test_bearing", "outer_race"),
    ("mfpt/OuterRaceFault_vload_1.mat", "mfpt", "test_bearing", "outer_race"),
    ("mfpt/OuterRaceFault_vload_3.mat", "mfpt", "test_bearing", "outer_race"),
    ("mfpt/OuterRaceFault_vload_5.mat", "mfpt", "test_bearing", "outer_race"),
    ("mfpt/InnerRaceFault_vload_1.mat", "mfpt", "test_bearing", "inner_race"),
    ("mfpt/InnerRaceFault_vload_3.mat", "mfpt", "test_bearing", "inner_race"),
    ("mfpt/InnerRaceFault_vload_5.mat", "mfpt", "test_bearing", "inner_race"),
    ("hit_sm/SQ_IR2_1200.mat", "hit_sq", "test_bearing", "inner_race"),
    ("hit_sm/SQ_OR2_1200.mat", "hit_sq", "test_bearing", "outer_race"),
    ("hit_sm/SQ_OR8_600.mat", "hit_sq", "test_bearing", "outer_race"),
    ("cwru/135_0.mat", "cwru_drive_end", "drive_end", "outer_race"),
]
HEALTHY = [
    ("mfpt/baseline_1.mat", "mfpt"),
    ("hit_sm/SQ_Normal_1200.mat", "hit_sq"),
    ("hit_sm/SQ_Normal_600.mat", "hit_sq"),
    ("cwru/97_Normal_0.mat", "cwru_drive_end"),
]
WITHOUT_BEARINGS = [
    ("gear0/3027_217_Data_Chan12.mat", "gear0", 2000 / 60),
    ("wt_hss_gear/health_20160306171241_25600.csv", "wt_hss", None),
    ("sq_gearbox/h30hz0.csv.gz", "sq_gearbox", 29.76),
    ("sq_gearbox/b30hz0.csv.gz", "sq_gearbox", 29.76),
]


@pytest.fixture(scope="module")
def diagnosed():
    """The record and the diagnosis of a file, made once however many tests look at it."""
    known = {}

    def look(path, machine):
        if (path, machine) not in known:
            record = import_file(path, machine)
            known[path, machine] = record, diagnose_record(record, load_machine(machine))
        return known[path, machine]

    return look


def zoomed_line(x, rate_hz, expected_hz):
    """The envelope's line near a frequency: scipy's filter and Hilbert, whole record, three harmonics,
    fine steps.

    Of several octaves that band is taken in which the line stands out most.
    """
    best = (0.0, float("nan"))
    low = 2000.0
    while 2 * low < 0.45 * rate_hz:
        sos = butter(4, [low, 2 * low], "bandpass", fs=rate_hz, output="sos")
        envelope = np.abs(hilbert(sosfiltfilt(sos, x))) ** 2
        keep = max(1, int(rate_hz / (12 * expected_hz)))
        envelope = envelope[: envelope.size // keep * keep].reshape(-1, keep).mean(axis=1)
        envelope = (envelope - envelope.mean()) * np.hanning(envelope.size)
        frequency = expected_hz * np.linspace(0.965, 1.035, 561)
        level = 0.0
        for k in (1, 2, 3):
            span = [k * frequency[0], k * frequency[-1]]
            level = level + np.abs(zoom_fft(envelope, span, 561, fs=rate_hz / keep, endpoint=True)) ** 2
        height = float(level.max() / np.median(level))
        if height > best[0]:
            best = (height, float(frequency[np.argmax(level)]))
        low *= 2
    return best[1]


@pytest.mark.parametrize(("name", "machine", "component", "fault"), FAULTY, ids=[row[0] for row in FAULTY])
def test_faulty_records(diagnosed, record_file, name, machine, component, fault):
    plate = load_machine(machine)
    record, diagnosis = diagnosed(record_file(name), machine)
    assert [(f.component, f.fault) for f in diagnosis.findings] == [(component, fault)]
    assert not diagnosis.healthy
    assert diagnosis.speed.source == "estimated"
    (finding,) = diagnosis.findings
    assert finding.confidence > 0.7
    family = next(f for f in fault_families(plate) if f.fault == fault)
    nominal = float(record.notes.get("speed_hz", plate.nominal_speed_hz))
    line = zoomed_line(record.data[0].astype(np.float64), record.sample_rate_hz, family.order * nominal)
    assert finding.found_hz == pytest.approx(line, rel=3e-3)


@pytest.mark.parametrize(("name", "machine"), HEALTHY, ids=[row[0] for row in HEALTHY])
def test_healthy_records(diagnosed, record_file, name, machine):
    _, diagnosis = diagnosed(record_file(name), machine)
    assert diagnosis.findings == ()
    assert diagnosis.healthy
    assert diagnosis.judged
    assert not any(issue.fatal for issue in diagnosis.quality)


def test_inverter_and_supply_lines_of_the_hit_rig_are_named(diagnosed, record_file):
    _, diagnosis = diagnosed(record_file("hit_sm/SQ_Normal_1200.mat"), "hit_sq")
    kinds = {issue.issue: issue.detail for issue in diagnosis.quality}
    assert "50 Hz supply" in kinds["electrical_lines"]
    assert "12002" in kinds["inverter_lines"]


@pytest.mark.parametrize(("name", "machine", "speed"), WITHOUT_BEARINGS, ids=[r[0] for r in WITHOUT_BEARINGS])
def test_records_without_bearing_data_run_and_give_no_finding(diagnosed, record_file, name, machine, speed):
    plate = load_machine(machine)
    _, diagnosis = diagnosed(record_file(name), machine)
    assert diagnosis.findings == ()
    # Gears are judged by the angle that is found in the vibration; Gear0's mate is not documented.
    assert diagnosis.judged_parts == (("gears",) if plate.gear_meshes else ())
    assert "nothing_to_look_for" in {issue.issue for issue in diagnosis.quality}
    if speed is not None:
        assert diagnosis.speed.value_hz == pytest.approx(speed, rel=2e-3)
        assert diagnosis.speed.source == "estimated"
    told = "judged: gears" if plate.gear_meshes else "nothing could be judged"
    assert any(told in line for line in diagnosis.lines())


def test_json_is_the_contract(diagnosed, record_file):
    _, diagnosis = diagnosed(record_file("mfpt/OuterRaceFault_vload_3.mat"), "mfpt")
    made = json.loads(json.dumps(diagnosis.to_json(), allow_nan=False))
    assert set(made) == {"speed_hz", "quality", "healthy", "findings"}
    assert set(made["speed_hz"]) == {"value", "ci95", "source"}
    low, high = made["speed_hz"]["ci95"]
    assert low < made["speed_hz"]["value"] < high
    (finding,) = made["findings"]
    assert set(finding) == {
        "component",
        "fault",
        "expected_order",
        "found_order",
        "snr_db",
        "confidence",
        "severity",
        "size_mm",
        "evidence",
    }
    assert finding["size_mm"] is None or set(finding["size_mm"]) == {"value", "ci95"}
    assert {"channel", "band_hz", "harmonic_snr_db", "false_alarm_probability", "frequency_hz"} <= set(
        finding["evidence"]
    )
    assert made["healthy"] is False


def test_half_the_record_and_any_batch_size_give_the_same_verdict(record_file):
    from gearsim_dsp.diagnose import DiagnosisSettings

    plate = load_machine("mfpt")
    record = import_file(record_file("mfpt/OuterRaceFault_vload_5.mat"), "mfpt")
    whole = diagnose_record(record, plate, DiagnosisSettings(batch_samples=777))
    again = diagnose_record(record, plate, DiagnosisSettings(batch_samples=50_000))
    assert whole.to_json() == again.to_json()
    half = replace(record, data=np.ascontiguousarray(record.data[:, : record.sample_count // 2]))
    assert [f.fault for f in diagnose_record(half, plate).findings] == ["outer_race"]


def test_gear0_tells_the_mesh_that_its_nameplate_does_not_list(diagnosed, record_file):
    _, diagnosis = diagnosed(record_file("gear0/3027_217_Data_Chan12.mat"), "gear0")
    (mesh,) = [q for q in diagnosis.quality if q.issue == "unlisted_mesh"]
    # 23 teeth at 2000 rpm pass at 766.7 Hz (README of the data set); the line is that of an FFT.
    assert mesh.channel == "ch12"
    assert "order 23 (766.6 Hz" in mesh.detail
    assert "23 teeth on shaft 'pinion'" in mesh.detail
    assert "strongest at -1" in mesh.detail
    assert "teeth of both wheels" in mesh.detail
    assert "lists neither bearings nor pairs of gears" in diagnosis.lines()[-1]


def test_measured_records_are_not_said_to_be_sampled_wrongly_nor_to_have_unlisted_gears(
    diagnosed, record_file
):
    for name, machine, *_ in (*FAULTY, *HEALTHY, *WITHOUT_BEARINGS[1:]):
        _, diagnosis = diagnosed(record_file(name), machine)
        kinds = {q.issue for q in diagnosis.quality}
        assert not kinds & {"sampling_rate_doubtful", "unlisted_mesh"}, name
