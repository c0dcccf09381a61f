"""Transmission error from the encoders of the simulated rig: its mesh, and the kick of a damaged tooth.

The simulator knows nothing of a transmission error: it passes the lines of two discs on shafts that swing.
"""

import numpy as np
import pytest

from gearsim_dsp.angle.encoder import encoder_phase, transmission_error
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import to_record

TEETH = 32


def _turn(*faults):
    """One turn of the transmission error, averaged over four, in rad, from edge 0 of the driving encoder."""
    changes = {"seed": 3, "operating_point": {"speed": "5 Hz", "load": "50 N*m"}, "faults": list(faults)}
    record = to_record(load_scenario("healthy", changes), 1.6)
    driving, driven = (encoder_phase(edges, record.sample_count) for edges in record.encoders)
    lines = record.encoders[0].lines_per_revolution
    found = transmission_error(driving, driven, TEETH, TEETH, samples_per_turn=lines).signal
    skip = round(-found.first_turn * lines) % lines + 3 * lines  # the start settles
    turns = found.values[skip:]
    return turns[: turns.size // lines * lines].reshape(-1, lines)


@pytest.fixture(scope="module")
def healthy():
    return _turn()


def test_the_mesh_repeats_in_every_turn(healthy):
    mean = healthy.mean(axis=0)
    lines = np.abs(np.fft.rfft(mean))
    strongest = np.argsort(lines[2:])[::-1] + 2
    assert strongest[0] == TEETH
    assert np.std(healthy - mean) < 1e-3 * np.std(mean)


@pytest.mark.parametrize("kind", ["gear_tooth_spall", "gear_tooth_crack"])
def test_one_damaged_tooth_kicks_once_in_a_turn(healthy, kind):
    faulty = _turn({"kind": kind, "component": "gears.pinion"})
    change = faulty.mean(axis=0) - healthy.mean(axis=0)
    change -= np.median(change)
    width = change.size // TEETH
    power = (change[: width * TEETH] ** 2).reshape(TEETH, width).sum(axis=1)
    ringing = np.roll(power / power.sum(), 3 - int(np.argmax(power)))
    # A kick, and the swing of the shafts that dies away over a third of a turn.
    assert ringing[:14].sum() > 0.8
    assert ringing[16:].sum() < 0.1
    assert np.std(change) > 10 * np.std(healthy - healthy.mean(axis=0))
