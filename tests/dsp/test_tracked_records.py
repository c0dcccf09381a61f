"""Speed found without tacho in the measured gear records, and order spectra that are sharp after tracking."""

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_dsp.angle.record_speed import changes, record_speed
from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.diagnose import diagnose_record
from gearsim_dsp.noise_floor import local_floor
from gearsim_dsp.speed import Phase
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

pytestmark = pytest.mark.records

TURBINE = "wt_hss_gear/health_20160306171241_25600.csv"
GEAR0 = "gear0/3027_217_Data_Chan12.mat"
TWO_STAGES = ("sq_gearbox/h30hz0.csv.gz", "sq_gearbox/b30hz0.csv.gz")
PER_TURN = 1024


def _tracked(record_file, path, machine):
    record = import_file(record_file(path), machine)
    return record, track_speed(record.data, record.sample_rate_hz, load_machine(machine))


def _sharpness(signal, order):
    """Share of the power within 0.3 orders of a line that lies in its three highest neighbours (Hann)."""
    orders, lines = signal.spectrum()
    around = np.flatnonzero(np.abs(orders - order) < 0.3)
    top = around[np.argmax(lines[around])]
    return np.sum(lines[top - 1 : top + 2] ** 2) / np.sum(lines[around] ** 2), orders[top]


def test_a_turbine_that_slows_by_four_percent_is_followed(record_file):
    record, track = _tracked(record_file, TURBINE, "wt_hss")
    assert track.confidence > 0.9
    assert changes(track)
    # By another way: the mesh alone, band-passed where it runs through the record, differentiated.
    sos = butter(4, [415, 470], "bandpass", fs=record.sample_rate_hz, output="sos")
    angle = np.unwrap(np.angle(hilbert(sosfiltfilt(sos, record.data[0].astype(float)))))
    seconds = np.arange(angle.size) / record.sample_rate_hz
    mesh_hz = np.polyval(np.polyder(np.polyfit(seconds, angle, 5)), seconds) / (2 * np.pi)
    inner = slice(angle.size // 20, -angle.size // 20)
    found = np.interp(seconds, track.time_s, track.speed_hz)
    assert found[inner] == pytest.approx(mesh_hz[inner] / 22, rel=2e-3)
    assert track.speed_hz[0] / track.speed_hz[-1] - 1 == pytest.approx(0.045, abs=0.005)


def test_the_diagnosis_of_the_turbine_rests_on_the_speed_followed(record_file):
    record, track = _tracked(record_file, TURBINE, "wt_hss")
    diagnosis = diagnose_record(record, load_machine("wt_hss"))
    assert diagnosis.speed.source == "estimated"
    assert diagnosis.speed.value_hz == pytest.approx(track.mean_hz, rel=1e-6)
    assert diagnosis.findings == ()


def test_a_turbines_orders_are_sharp_after_tracking(record_file):
    record, track = _tracked(record_file, TURBINE, "wt_hss")
    x = record.data[0]
    sharp = to_angle(x, track.phase, PER_TURN)
    steady = Phase(track.phase.samples[[0, -1]], track.phase.turns[[0, -1]])
    blurred = to_angle(x, steady, PER_TURN)
    for order, least in ((22, 0.9), (44, 0.65), (88, 0.65)):
        share, at = _sharpness(sharp, order)
        assert share > least
        assert at == pytest.approx(order, abs=1.5 / sharp.turn_count)
    # The mesh alone blurs over one order (4.3 % of 22) at a constant speed.
    assert _sharpness(blurred, 22)[0] < 0.5


def test_the_turbines_other_lines_tell_the_teeth_of_its_wheel(record_file):
    """Nothing in the comb knows the mate of the intermediate pinion: 21 teeth at 22 / 112 orders."""
    record, track = _tracked(record_file, TURBINE, "wt_hss")
    orders, lines = to_angle(record.data[0], track.phase, PER_TURN).spectrum()
    height = 10 * np.log10(lines**2 / local_floor(lines**2, 64, 1.0, 2))
    for k in (1, 2, 3, 4):
        near = np.flatnonzero(np.abs(orders - k * 4.125) < 0.05)
        top = near[np.argmax(height[near])]
        assert height[top] > 15
        assert orders[top] == pytest.approx(k * 21 * 22 / 112, abs=1.0 / 80)


def test_speed_of_gear0_and_its_mesh(record_file):
    record, track = _tracked(record_file, GEAR0, "gear0")
    assert track.confidence > 0.9
    assert track.mean_hz == pytest.approx(2000 / 60, rel=2e-3)
    tracked = to_angle(record.data[0], track.phase, PER_TURN)
    for order in (23, 46):  # the pinion's teeth, which the nameplate's comb does not hold
        share, at = _sharpness(tracked, order)
        assert share > 0.95
        assert at == pytest.approx(order, abs=1.0 / tracked.turn_count)


@pytest.mark.parametrize("path", TWO_STAGES)
def test_speed_of_a_two_stage_gearbox_is_below_its_inverters(record_file, path):
    record, track = _tracked(record_file, path, "sq_gearbox")
    assert track.confidence > 0.9
    assert track.mean_hz == pytest.approx(29.756, abs=0.01)
    assert not changes(track)
    tracked = to_angle(record.data[0], track.phase, PER_TURN)
    share, at = _sharpness(tracked, 32)
    assert share > 0.85
    assert at == pytest.approx(32, abs=1.5 / tracked.turn_count)


@pytest.mark.parametrize(
    ("path", "machine"),
    [("mfpt/baseline_1.mat", "mfpt"), ("cwru/97_Normal_0.mat", "cwru_drive_end")],
)
def test_steady_rigs_are_left_to_the_averaged_spectra(record_file, path, machine):
    found = record_speed(import_file(record_file(path), machine), load_machine(machine))
    assert not found.replaces_angle
    assert found.issues == ()
