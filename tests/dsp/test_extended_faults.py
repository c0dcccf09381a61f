"""Extended rough faults of the simulated rig: slices of the spectral correlation as in thesis 5.7.

The simulator lets balls roll over a rough zone; what cyclic frequency that gives comes out of the contact.
"""

from dataclasses import replace

import numpy as np
import pytest

from gearsim_dsp.cyclic.correlation import cyclic_spectrum
from gearsim_dsp.cyclic.envelopes_of_coherence import enhanced_envelope_spectrum
from gearsim_dsp.cyclic.slices import gain_db, slices_before_and_after
from gearsim_dsp.kinematics import fault_families
from gearsim_dsp.separation.random_separation import drs
from gearsim_sim.scenario import FaultSpec, load_scenario
from gearsim_sim.simulation import to_record

SECONDS = 6.0
SHAFT_HZ = 10.0
SLIP = 0.01
LOW_HZ = (100.0, 5000.0)  # where gears mask
STEP_HZ = 64.0


@pytest.fixture(scope="module")
def rig():
    """Channel b3_y of a sound bearing, of a rough inner and of a rough outer race (one row), all slipping."""
    base = load_scenario("extended_roughness").with_events([])
    (rough,) = base.faults
    slip = FaultSpec(kind="cage_slip", component="bearing_3", params={"slip": SLIP})
    outer = replace(rough, params={**rough.params, "race": "outer", "row": 1})
    signals = {}
    for name, faults in {"sound": (slip,), "inner": (rough, slip), "outer": (outer, slip)}.items():
        record = to_record(replace(base, faults=faults), SECONDS)
        signals[name] = record.data[record.channels.index("b3_y")].astype(np.float64)
    orders = {f.fault: f.order for f in fault_families(base.machine) if f.component == "bearing_3"}
    return signals, base.sample_rate_hz, orders["outer_race"] * SHAFT_HZ


def random_part(x):
    """DRS with blocks of a quarter of a second, 31 ms apart: longer than any resonance of the rig rings."""
    return drs(x, 2048, 16_384)[1]


@pytest.mark.parametrize("race", ["inner", "outer"])
def test_removal_of_gears_uncovers_an_extended_fault(rig, race):
    signals, rate, bpfo = rig
    alpha = SHAFT_HZ if race == "inner" else bpfo * (1 - SLIP)
    sound, ill = (
        slices_before_and_after(signals[name], rate, [0.0, alpha], STEP_HZ, random_part)
        for name in ("sound", race)
    )
    # the mesh is nearly all of the vibration, and hides what the rough zone adds
    assert sound.removed_share > 0.99
    assert gain_db(ill.before, sound.before, 0, *LOW_HZ) < 2.0
    # without it the fault shows in the power and, further above what chance gives, at its cyclic frequency
    assert gain_db(ill.after, sound.after, 0, *LOW_HZ) > 6.0
    assert gain_db(ill.after, sound.after, 1, *LOW_HZ) > gain_db(ill.after, sound.after, 0, *LOW_HZ) + 3.0
    low = (ill.after.frequency_hz >= LOW_HZ[0]) & (ill.after.frequency_hz < LOW_HZ[1])
    assert np.mean(ill.after.squared_coherence()[1, low]) > 20 / ill.after.averages
    assert np.mean(sound.after.squared_coherence()[1, low]) < 3 / sound.after.averages


def test_the_enhanced_envelope_names_the_race(rig):
    """Inner: the shaft's speed; outer: the ball pass frequency of the slipping cage; sound: neither."""
    signals, rate, bpfo = rig
    found = {}
    for name, x in signals.items():
        spectrum = cyclic_spectrum(random_part(x), rate, 256.0, 300.0).coherence_map()
        found[name] = enhanced_envelope_spectrum(spectrum, (512.0, 6000.0))
    assert found["inner"].line(SHAFT_HZ).false_alarm < 1e-6
    comb = found["outer"].comb(bpfo, 0.02)
    assert comb.found == pytest.approx(bpfo * (1 - SLIP), rel=1e-3)
    assert comb.snr_db > 15
    assert found["sound"].comb(bpfo, 0.02).false_alarm > 1e-3
    assert found["sound"].line(SHAFT_HZ).false_alarm > 1e-3


def test_without_slip_an_outer_race_repeats_and_is_taken_for_a_gear(rig):
    """Each ball meets the same bumps at the same angle: periodic, hence removed with the mesh.

    It is why bearings must slip in a simulation for their faults to be random, and a limit of the method.
    """
    signals, rate, bpfo = rig
    base = load_scenario("extended_roughness").with_events([])
    (rough,) = base.faults
    outer = replace(rough, params={**rough.params, "race": "outer", "row": 1})
    record = to_record(replace(base, faults=(outer,)), SECONDS)
    x = record.data[record.channels.index("b3_y")].astype(np.float64)
    spectrum = cyclic_spectrum(random_part(x), rate, 256.0, 300.0).coherence_map()
    firm = enhanced_envelope_spectrum(spectrum, (512.0, 6000.0)).comb(bpfo, 0.02)
    slipping = cyclic_spectrum(random_part(signals["outer"]), rate, 256.0, 300.0).coherence_map()
    loose = enhanced_envelope_spectrum(slipping, (512.0, 6000.0)).comb(bpfo, 0.02)
    assert firm.modulation < 0.1 * loose.modulation
