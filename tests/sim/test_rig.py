"""The whole rig with the real physics: shipped scenarios run, and portions change no bit."""

import dataclasses

import numpy as np
import pytest

from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_sim.events import FaultSpec
from gearsim_sim.scenario import load_scenario, scenario_names
from gearsim_sim.simulation import Simulation, simulate, to_record


def _bits(batches):
    for batch in batches:
        for field in dataclasses.fields(batch):
            value = getattr(batch, field.name)
            yield value.tobytes() if isinstance(value, np.ndarray) else value


@pytest.mark.parametrize("name", scenario_names())
def test_shipped_scenarios_run(name):
    scenario = load_scenario(name)
    simulation = Simulation(scenario)
    batches = simulation.advance(scenario.batch_samples)
    sensors = scenario.sensors
    kinds = [SampleBatch, *[TachoBatch] * len(sensors.tachos), *[EncoderBatch] * len(sensors.encoders)]
    assert [type(b) for b in batches] == kinds + [TorqueBatch] * bool(sensors.torques)
    assert np.all(batches[0].data.std(axis=1) > 0)
    assert batches[0].channels == tuple(channel.name for channel in simulation.machine.channels)
    assert len(simulation.truth().faults) == len(scenario.faults)


def test_portions_change_no_bit_and_a_live_run_is_replayed():
    scenario = load_scenario("quick", {"sample_rate": "20 kHz", "oversampling": 4, "batch_samples": 777})
    live = Simulation(scenario, 5)
    batches = live.advance(2000)
    live.inject(FaultSpec("inner_race_spall", "bearing_2", {"width_m": 1e-3}, fault_id="x"), ramp_s=0.02)
    for n in (1, 2, 3, 5, 8, 13, 700, 777, 778, 1500):
        batches += live.advance(n)
    live.set_operating_point(speed_hz=11.0, ramp_s=0.1)
    batches += live.advance(3000)
    live.clear("x", ramp_s=0.0)
    batches += live.advance(211)
    batches += live.finish()
    total = 2000 + 1 + 2 + 3 + 5 + 8 + 13 + 700 + 777 + 778 + 1500 + 3000 + 211
    again = list(simulate(scenario.with_events(live.truth().events), total / 20_000, 5))
    assert list(_bits(again)) == list(_bits(batches))
    healthy = list(simulate(scenario, total / 20_000, 5))
    assert list(_bits(healthy)) != list(_bits(batches))  # and something did happen


def _upper_lines(sampling):
    """Spectrum from 3 kHz to 0.44 of the sample rate, with a spall on bearing_3."""
    accelerometers = {"chain": "ideal", "channels": ["b1_y", "b3_y"], "sampling": sampling}
    spall = {"kind": "outer_race_spall", "component": "bearing_3", "params": {"width_m": "0.8 mm"}}
    changes = {"oversampling": 8, "timeline": [], "faults": [spall]}
    changes["sensors"] = {"accelerometers": accelerometers}
    data = to_record(load_scenario("quick", changes), 1.0).data.astype(float)
    return np.fft.rfft(data * np.hanning(data.shape[1]))[:, 3000 : round(0.44 * 16_384)]


def _size(lines):
    return np.sqrt(np.mean(np.abs(lines) ** 2, axis=1))


def test_a_delta_sigma_converter_shows_what_the_model_gives_and_a_bare_one_folds():
    """The same steps of integration, decimated by the model at once or by the converter in a second stage."""
    model = _upper_lines({})
    converter = _upper_lines({"oversampling": 2})
    bare = _upper_lines({"oversampling": 2, "antialias": "none"})
    # Both filters reject 80 dB at least; what could fold is no larger than what lies in the band.
    assert np.all(_size(converter - model) < 1e-4 * _size(model))
    # The kinks of the contact reach beyond half the rate: -35 dB of the band at the faulty bearing.
    assert -45 < 20 * np.log10(_size(bare - model) / _size(model))[1] < -25


def test_the_torque_is_the_load_and_swings_with_the_mesh():
    changes = {"sensors": {"torques": {"chain": "ideal", "shafts": ["input", "output"]}}}
    record = to_record(load_scenario("quick", changes), 1.0)
    assert record.torques is not None
    assert record.torques.channels == ("input_torque", "output_torque")
    # The load of 50 N m goes through both couplings (1:1); the settling after the start is over.
    np.testing.assert_allclose(record.torques.data_nm.mean(axis=1), 50.0, rtol=0.01)
    assert np.all(record.torques.data_nm.std(axis=1) > 1e-3)


def test_tacho_and_encoder_agree_and_follow_the_speed():
    record = to_record(load_scenario("quick", {"operating_point": {"speed": "12 Hz", "load": "50 N*m"}}), 1.0)
    for tacho, encoder in zip(record.tachos, record.encoders, strict=True):
        edges = encoder.first_edge + np.arange(encoder.samples.size)
        zero = encoder.samples[edges % 900 == 0]
        np.testing.assert_allclose(zero, tacho.samples, rtol=0, atol=1e-9)
        rate = np.diff(tacho.samples).mean()
        assert record.sample_rate_hz / rate == pytest.approx(12.0, rel=2e-3)
        # Torsional vibration is there, and is small against a line of the encoder's turn.
        steady = np.polyval(np.polyfit(encoder.samples, edges, 1), encoder.samples)
        assert 1e-4 < np.abs(edges - steady).max() < 20


def test_what_the_machine_cannot_do_names_the_scenario(tmp_path):
    path = tmp_path / "bad.yaml"
    path.write_text(
        "operating_point: {speed: 10 Hz, load: 50 N*m}\n"
        "faults: [{kind: outer_race_spall, component: bearing_7}]\n"
    )
    with pytest.raises(InputError, match=r"bad\.yaml: .*component: got bearing_7, expected one of bearing_1"):
        Simulation(load_scenario(path))
    path.write_text(
        "operating_point: {speed: 10 Hz, load: 50 N*m}\nparameters: {shafts.bending_stiffness: 1 N/m}\n"
    )
    with pytest.raises(InputError, match=r"bad\.yaml: parameters: got .*that the model can be solved with"):
        Simulation(load_scenario(path))
    path.write_text("operating_point: {speed: 400 Hz, load: 50 N*m}\n")
    with pytest.raises(InputError, match=r"bad\.yaml: .*speed.*400"):
        Simulation(load_scenario(path))
    path.write_text(
        "operating_point: {speed: 10 Hz, load: 50 N*m}\ntimeline: [{at: 1 s, clear: {id: ghost}}]\n"
    )
    with pytest.raises(InputError, match=r"bad\.yaml: timeline, at 1 s: .*ghost"):
        Simulation(load_scenario(path))
