"""Averages of measured gears, whose angle is found in the vibration itself."""

import numpy as np
import pytest

from gearsim_dsp.angle.resample import to_angle
from gearsim_dsp.angle.tacholess import track_speed
from gearsim_dsp.features import rms
from gearsim_dsp.gear_kinematics import gear_wheels
from gearsim_dsp.speed import Phase
from gearsim_dsp.synchronous.indicators import gear_indicators
from gearsim_dsp.synchronous.modulation import demodulate_mesh
from gearsim_dsp.synchronous.tsa import shaft_average, synchronous_average, synchronous_part
from gearsim_io.importers import import_file
from gearsim_io.machines import load_machine

pytestmark = pytest.mark.records

TURBINE = "wt_hss_gear/health_20160306171241_25600.csv"
PINION_TEETH = 22


@pytest.fixture(scope="module")
def turbine(record_file):
    record = import_file(record_file(TURBINE), "wt_hss")
    x = record.data[0].astype(float)
    x -= x.mean()
    return x, track_speed(x, record.sample_rate_hz, load_machine("wt_hss")).phase


def test_a_turbines_pinion_stands_out_though_its_speed_falls_by_four_percent(turbine):
    x, phase = turbine
    average = shaft_average(x, phase)
    orders, lines = average.spectrum()
    assert orders[np.argmax(lines)] == PINION_TEETH
    # By a constant speed the mesh slips by many pitches over the record, and averages out.
    steady = Phase(phase.samples[[0, -1]], phase.turns[[0, -1]])
    blurred = shaft_average(x, steady, samples_per_turn=average.samples_per_turn)
    assert lines[PINION_TEETH] > 5 * blurred.spectrum()[1][PINION_TEETH]
    assert rms(average.values) > 0.7 * rms(x)


def test_turns_of_both_halves_of_the_record_agree(turbine):
    """What is in the average is the gear's: it comes again in turns that the other average does not hold."""
    x, phase = turbine
    angle = to_angle(x, phase, 1024)
    whole = synchronous_average(angle)
    turns = (angle.values.size // 1024) * 1024
    periods = angle.values[:turns].reshape(-1, 1024)
    odd, even = periods[::2].mean(axis=0), periods[1::2].mean(axis=0)
    # The difference of two averages of half the turns each has four times the power of the whole's noise.
    assert rms(odd - even) / 2 == pytest.approx(whole.noise_rms, rel=0.25)
    assert np.corrcoef(odd, even)[0, 1] > 0.95


def test_a_turbines_pinion_is_taken_out_of_the_record(turbine):
    x, phase = turbine
    average = shaft_average(x, phase)
    rest = x - synchronous_part(average, phase, x.size)
    assert rms(rest) ** 2 == pytest.approx(rms(x) ** 2 - rms(average.values) ** 2, rel=0.05)


def test_both_wheels_of_a_turbines_mesh_are_demodulated(turbine):
    x, phase = turbine
    amplitudes = []
    for wheel in gear_wheels(load_machine("wt_hss")):
        average = shaft_average(x, phase, ratio=wheel.turn_order)
        found = demodulate_mesh(average, wheel.teeth, sideband_count=8)
        amplitudes.append(found.mean_amplitude)
        # Sound gears: a modulation of some percent, and no tooth that stands out.
        assert np.max(np.abs(found.amplitude)) < 0.25
        assert 2 < gear_indicators(average, wheel.teeth).fm4 < 6
    # One mesh, so one amplitude, but for the few turns of the wheel in which the last bit of it is missing.
    assert amplitudes[0] == pytest.approx(amplitudes[1], rel=0.05)


def test_sidebands_of_a_measured_mesh_are_those_of_its_two_wheels(record_file):
    record = import_file(record_file("sq_gearbox/h30hz0.csv.gz"), "sq_gearbox")
    machine = load_machine("sq_gearbox")
    phase = track_speed(record.data, record.sample_rate_hz, machine).phase
    angle = to_angle(record.data[2].astype(float), phase, 256)
    orders, lines = angle.spectrum()
    near = (orders > 30) & (orders < 34)
    floor = np.median(lines[near])
    for order in (31.0, 31.2, 31.6, 32.4, 33.0):
        # Hann's line is four steps wide; a Rayleigh amplitude exceeds four medians once in 65,000.
        assert lines[near & (np.abs(orders - order) < 0.01)].max() > 4 * floor
    average = shaft_average(record.data[2], phase)
    assert average.spectrum()[1][32] == pytest.approx(lines[near].max(), rel=0.1)
