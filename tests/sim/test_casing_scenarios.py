"""The shipped casing under the gearbox: scenarios from YAML, fault frequencies, aliasing, start."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import butter, hilbert, sosfiltfilt

from gearsim_io.errors import InputError
from gearsim_sim.bench import casing_alias_db
from gearsim_sim.models import MODELS
from gearsim_sim.params.casing_gearbox import load_casing_gearbox_params
from gearsim_sim.scenario import load_scenario, parse_scenario
from gearsim_sim.simulation import to_record

BPFO_HZ, BPFI_HZ = 48.9, 71.1  # Koyo 1205 at 10 Hz (thesis 5.5)
BAND_HZ = (500.0, 2000.0)  # within that of the reduced casing


def envelope_spectrum(scenario, channel, seconds=3.0):
    """Squared envelope of a band of one channel: frequencies and amplitudes."""
    record = to_record(scenario, seconds)
    x = record.data[list(record.channels).index(channel)].astype(float)
    rate = record.sample_rate_hz
    band = sosfiltfilt(butter(4, BAND_HZ, "bandpass", fs=rate, output="sos"), x)
    squared = np.abs(hilbert(band)) ** 2
    window = np.hanning(squared.size)
    spectrum = np.abs(np.fft.rfft(window * (squared - squared.mean()))) / window.sum() * 2
    return np.fft.rfftfreq(squared.size, 1 / rate), spectrum


def line(frequencies, spectrum, at_hz):
    return spectrum[np.abs(frequencies - at_hz) < 0.8].max()


@pytest.mark.parametrize(("name", "at_hz"), [("casing_outer", BPFO_HZ), ("casing_inner", BPFI_HZ)])
@pytest.mark.parametrize("channel", ["b3_y", "side"])
def test_fault_frequencies_come_through_the_casing(name, at_hz, channel):
    faulty = load_scenario(name)
    healthy = dataclasses.replace(faulty, faults=())
    frequencies, with_it = envelope_spectrum(faulty, channel)
    _, without = envelope_spectrum(healthy, channel)
    ours = line(frequencies, with_it, at_hz)
    assert ours > 5 * line(frequencies, without, at_hz)
    assert ours > 10 * np.median(with_it[(frequencies > 20) & (frequencies < 200)])
    if name == "casing_inner":  # the pit turns through the load zone
        for side in (at_hz - 10, at_hz + 10):
            assert line(frequencies, with_it, side) > 3 * line(frequencies, without, side)


def test_scenarios_put_out_what_they_look_at_and_nothing_else():
    scenario = load_scenario("casing_healthy")
    output = MODELS[scenario.model](scenario).advance(64)
    assert set(output.site_names) == {"b1_y", "b3_y", "b3_top_y", "side_output_x", "floor_y"}
    assert scenario.model == "cb146"
    assert load_scenario("casing_outer").model == "cb182"


@pytest.mark.parametrize("finite", [False, True])
def test_little_is_folded_back(finite):
    params = load_casing_gearbox_params(finite=finite)
    assert casing_alias_db(params, 4) <= -70
    assert casing_alias_db(params, 8) <= -80


def test_a_casing_of_ones_own_is_found_from_the_scenario(tmp_path):
    content = {
        "model": "cb146",
        "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
        "parameters": {"casing.reduced": "nowhere.npz"},
    }
    with pytest.raises(InputError, match="no such file"):
        MODELS["cb146"](parse_scenario(content, tmp_path / "mine.yaml"))
    with pytest.raises(InputError, match="section with a reduced casing"):
        load_casing_gearbox_params(_without_casing(tmp_path))


def _without_casing(folder):
    import gearsim_io.machines

    text = (Path(gearsim_io.machines.__file__).parent / "machines" / "unsw_parallel.yaml").read_text()
    path = folder / "bare.yaml"
    path.write_text(text[: text.index("  casing:")])
    return path


def test_structure_at_a_site_that_is_not_there_is_refused():
    content = {
        "model": "cb146",
        "operating_point": {"speed": "10 Hz", "load": "50 N*m"},
        "structure": {
            "resonances": [{"site": "lid_y", "mass": "1 kg", "frequency": "1 kHz", "damping_ratio": 0.02}]
        },
    }
    with pytest.raises(InputError, match=r"got lid_y, expected one of b1_x, .*, side_output_x"):
        MODELS["cb146"](parse_scenario(content, Path("mine.yaml")))
