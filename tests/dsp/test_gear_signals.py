"""Averages and indicators on simulated gears, whose faults come out of teeth that roll on each other."""

from functools import lru_cache

import numpy as np
import pytest

from gearsim_dsp.speed import window_speed
from gearsim_dsp.synchronous.indicators import gear_indicators
from gearsim_dsp.synchronous.modulation import demodulate_mesh
from gearsim_dsp.synchronous.signals import difference_signal
from gearsim_dsp.synchronous.tsa import shaft_average
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

TEETH = 32
# From the first touch of a tooth to its last it turns by the contact ratio, 1.67 pitches, half of it before
# the middle of its contact. The pedestal then rings on: 4 ms, a pitch at 10 Hz and 32 teeth.
BEFORE, AFTER = 0.84, 0.84 + 1.3


@lru_cache
def average(kind="", component="", tooth=0, **params):
    """TSA of a pedestal over 25 turns of the rig at 10 Hz."""
    changes = {"seed": 11, "operating_point": {"speed": "10 Hz", "load": "100 N*m"}}
    if kind:
        given = {"tooth": tooth} if tooth else {}
        changes["faults"] = [{"kind": kind, "component": component, "params": given | params}]
    scenario = load_scenario("healthy", changes)
    record = to_record(scenario, 2.5)
    speed = window_speed(record.tachos, record.sample_count, record.sample_rate_hz, scenario.machine)
    assert speed.phase is not None
    return shaft_average(record.data[record.channels.index("b3_y")], speed.phase)


@lru_cache
def indicators(*fault):
    healthy = gear_indicators(average(), TEETH)
    return gear_indicators(average(*fault), TEETH, earlier_residual=[healthy.residual_variance] * 9)


@pytest.mark.parametrize(
    ("kind", "component", "tooth"),
    [
        ("gear_tooth_crack", "gears.pinion", 5),
        ("gear_tooth_spall", "gears.gear", 20),
        ("gear_tooth_spall", "gears.pinion", 9),
    ],
)
def test_the_bad_tooth_is_where_the_difference_signal_peaks(kind, component, tooth):
    bad = average(kind, component, tooth)
    rest = difference_signal(bad, [TEETH])
    middle = tooth - 0.5  # teeth count from 1, the middle of a tooth's contact is half a pitch on
    place = np.argmax(np.abs(rest)) / rest.size * TEETH
    assert middle - BEFORE < place < middle + AFTER
    # Other teeth: the surfaces' roughness and the noise, which a sound pair has as well.
    other = np.abs((np.arange(rest.size) / rest.size * TEETH - middle + 16) % 32 - 16) > 4
    sound = difference_signal(average(), [TEETH])
    assert np.std(rest[other]) < 3 * np.std(sound)


def test_one_bad_tooth_raises_fm4_and_sound_gears_do_not():
    sound = indicators()
    assert 2.5 < sound.fm4 < 4
    crack, spall = (
        indicators("gear_tooth_crack", "gears.pinion", 5),
        indicators("gear_tooth_spall", "gears.gear", 20),
    )
    for bad in (crack, spall):
        assert bad.fm4 > 12
        assert bad.m6a > 10 * sound.m6a
        assert bad.na4 > 5 * sound.na4
        assert bad.energy_ratio > 1.2 * sound.energy_ratio
    assert spall.residual_variance > 10 * crack.residual_variance


def test_wear_raises_the_level_of_all_teeth_and_eccentricity_the_sidebands():
    sound, worn = indicators(), indicators("gear_wear", "gears.pinion")
    assert worn.energy_ratio > 2 * sound.energy_ratio
    assert worn.na4 > 3 * sound.na4
    assert worn.fm4 < 8
    bent = indicators("gear_eccentricity", "gears.gear")
    assert bent.sideband_level > 1.5 * sound.sideband_level
    assert bent.fm4 < 4


def test_a_spalled_tooth_turns_the_phase_of_the_mesh_for_a_moment():
    swing = [
        np.ptp(demodulate_mesh(a, TEETH).phase_rad)
        for a in (average(), average("gear_tooth_spall", "gears.gear", 20))
    ]
    assert swing[1] > 4 * swing[0]
