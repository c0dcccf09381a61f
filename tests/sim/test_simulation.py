"""The rig around the physics: batches, chunk invariance, events and truth, with a model in closed form."""

import dataclasses

import numpy as np
import pytest
from rig_double import LOOKAHEAD, RigDouble

from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.errors import InputError
from gearsim_io.messages import message_name, pure_types, to_msg
from gearsim_sim.events import FaultSpec
from gearsim_sim.scenario import load_scenario
from gearsim_sim.sensors.rows import Encoder
from gearsim_sim.simulation import Simulation, simulate, to_record

RATE = 16384.0
BATCH = 500

SCENARIO = """
machine: unsw_parallel
seed: 5
sample_rate: 16384 Hz
batch_samples: 500
operating_point: {speed: 10 Hz, load: 50 N*m}
sensors:
  accelerometers:
    channels: [b1_y, b3_y]
    each: {b3_y: {delay: 100 us, bandwidth: 3 kHz}}
timeline:
  - {at: 0.1 s, inject: {kind: outer_race_spall, component: bearing_3, ramp: 0.05 s, id: spall}}
  - {at: 0.2 s, set: {speed: 12 Hz}}
  - {at: 0.3 s, clear: {id: spall, ramp: 0.1 s}}
"""


@pytest.fixture
def scenario(tmp_path):
    path = tmp_path / "rig.yaml"
    path.write_text(SCENARIO)
    return load_scenario(path)


def _fields(batch):
    return {
        field.name: value.tobytes() if isinstance(value := getattr(batch, field.name), np.ndarray) else value
        for field in dataclasses.fields(batch)
    }


def assert_same(left, right):
    assert len(left) == len(right)
    for a, b in zip(left, right, strict=True):
        assert type(a) is type(b)
        assert _fields(a) == _fields(b)


def _in_portions(scenario, portions):
    simulation = Simulation(scenario, 7, RigDouble(RATE))
    batches = [batch for n in portions for batch in simulation.advance(n)]
    return batches + simulation.finish()


def test_batches_of_a_run(scenario):
    batches = list(simulate(scenario, 1.0, t0_ns=10**18, model=RigDouble(RATE)))
    kinds = [type(batch) for batch in batches[:5]]
    assert kinds == [SampleBatch, TachoBatch, TachoBatch, EncoderBatch, EncoderBatch]
    assert len(batches) == 5 * 33
    expected = 0
    for batch in batches[::5]:
        assert batch.first_sample == expected
        assert batch.t0_ns == 10**18 + round(expected * 1e9 / RATE)
        expected = batch.end_sample
    assert expected == 16384
    assert [batch.sample_count for batch in batches[::5]] == [500] * 32 + [384]
    assert batches[0].channels == ("b1_y", "b3_y")
    assert batches[0].frame_id == "unsw_parallel"
    for batch in batches:
        assert batch.sample_count == batches[5 * (batch.first_sample // 500)].sample_count


def test_any_portions_give_the_same_bits(scenario):
    whole = list(simulate(scenario, 5500 / RATE, 7, RigDouble(RATE)))
    rng = np.random.default_rng(11)
    cuts = np.sort(rng.choice(np.arange(1, 5500), 60, replace=False))
    portions = np.diff([0, *cuts, 5500])
    assert_same(_in_portions(scenario, portions), whole)
    assert_same(_in_portions(scenario, [1] * 501 + [4999]), whole)
    assert_same(_in_portions(scenario, [5500]), whole)


def test_batches_come_as_soon_as_they_can(scenario):
    simulation = Simulation(scenario, 0, RigDouble(RATE))
    assert simulation.advance(499) == []
    assert [b.first_sample for b in simulation.advance(1)] == [0] * 5
    assert [b.first_sample for b in simulation.advance(1001)] == [500] * 5 + [1000] * 5
    assert simulation.samples_sent == 1500
    assert simulation.finish()[0].sample_count == 1
    with pytest.raises(RuntimeError):
        simulation.advance(1)


def test_batch_size_does_not_change_the_samples(scenario):
    small = dataclasses.replace(scenario, batch_samples=37)
    a = to_record(scenario, 0.2, model=RigDouble(RATE))
    b = to_record(small, 0.2, model=RigDouble(RATE))
    np.testing.assert_array_equal(a.data, b.data)
    for left, right in zip((*a.tachos, *a.encoders), (*b.tachos, *b.encoders), strict=True):
        np.testing.assert_allclose(left.samples, right.samples, rtol=0, atol=1e-11)


def test_a_record_is_the_stream(scenario):
    record = to_record(scenario, 0.5, t0_ns=7, model=RigDouble(RATE))
    assert record.sample_count == 8192
    again = list(record.batches(BATCH))
    live = list(simulate(scenario, 0.5, 7, RigDouble(RATE)))
    assert len(again) == len(live)
    for a, b in zip(again, live, strict=True):
        assert type(a) is type(b)
        assert a.first_sample == b.first_sample
        if isinstance(a, SampleBatch):
            np.testing.assert_array_equal(a.data, b.data)
        elif isinstance(a, TachoBatch):
            assert a.first_pulse == b.first_pulse
            np.testing.assert_allclose(a.pulse_offsets, b.pulse_offsets, atol=1e-11)
        else:
            assert a.first_edge == b.first_edge
            np.testing.assert_allclose(a.edge_offsets, b.edge_offsets, atol=1e-11)


def test_tacho_and_encoder_tell_the_true_angle(scenario):
    double = RigDouble(RATE)
    record = to_record(scenario, 1.0, model=double)
    for number, shaft in enumerate(("input", "output")):
        tacho = record.tachos[number]
        assert tacho.shaft == shaft
        # The output shaft starts a little past its mark, so its first pulse ends the first turn.
        turns = number + np.arange(tacho.samples.size)
        np.testing.assert_allclose(double.angle_turns(tacho.samples, number), turns, rtol=0, atol=1e-8)
        assert turns[-1] == 9
        encoder = record.encoders[number]
        edges = encoder.first_edge + np.arange(encoder.samples.size)
        assert encoder.samples.size == pytest.approx(9000, abs=100)
        np.testing.assert_allclose(
            double.angle_turns(encoder.samples, number), edges / 900, rtol=0, atol=1e-8
        )


def test_events_of_the_timeline_come_at_their_sample(scenario):
    ideal = dataclasses.replace(scenario, sensors=load_ideal(scenario))
    record = to_record(ideal, 0.5, model=RigDouble(RATE))
    k = np.arange(record.sample_count)
    clean = np.sin(0.1 * k)
    steps = np.flatnonzero(np.abs(np.diff(record.data[0] - clean)) > 1) + 1
    assert steps.tolist() == [round(0.1 * RATE), round(0.2 * RATE), round(0.3 * RATE)]


def load_ideal(scenario):
    rows = tuple(
        dataclasses.replace(
            row,
            full_scale=None,
            bandwidth_hz=None,
            noise_density=None,
            adc_bits=None,
            delay_s=0.0,
            mounting=None,
            mains=None,
            dropouts=None,
        )
        for row in scenario.sensors.accelerometers
    )
    return dataclasses.replace(scenario.sensors, accelerometers=rows)


def test_a_live_injection_says_its_sample_and_can_be_replayed(scenario):
    scenario = dataclasses.replace(scenario, sensors=load_ideal(scenario))
    live = Simulation(scenario, 0, RigDouble(RATE))
    batches = live.advance(1234)
    sample = live.inject(FaultSpec("inner_race_spall", "bearing_2", {"width_m": 1e-3}), ramp_s=0.0)
    assert sample == 1234 + 1 + LOOKAHEAD  # one sample ahead for the edges, and the filter's look-ahead
    batches += live.advance(3000)
    change = live.set_operating_point(speed_hz=9.0)
    batches += live.advance(4000)
    batches += live.finish()
    truth = live.truth()
    assert [event.at_sample for event in truth.events][1] > 0
    assert {sample, change} < {event.at_sample for event in truth.events}
    seconds = (1234 + 3000 + 4000) / RATE
    replayed = list(simulate(scenario.with_events(truth.events), seconds, 0, RigDouble(RATE)))
    assert_same(replayed, batches)
    stream = np.concatenate([b.data[0] for b in batches if isinstance(b, SampleBatch)])
    jump = np.abs(np.diff(stream - np.sin(0.1 * np.arange(stream.size))))
    assert jump[sample - 1] == pytest.approx(5.0, abs=0.01)


def test_truth_follows_the_stream(scenario):
    simulation = Simulation(scenario, 1000, RigDouble(RATE))
    start = simulation.truth()
    assert (start.sample, start.t0_ns, start.speed_hz, start.faults) == (0, 1000, 10.0, ())
    at = [round(0.1 * RATE), round(0.2 * RATE), round(0.3 * RATE) + round(0.1 * RATE)]
    truths = simulation.truths(0, 10_000)
    assert [truth.sample for truth in truths] == at
    assert truths[0].t0_ns == 1000 + round(at[0] * 1e9 / RATE)
    assert [f.fault_id for f in truths[0].faults] == ["spall"]
    assert truths[0].faults[0].since_sample == at[0]
    assert (truths[1].speed_hz, truths[1].load_nm) == (12.0, 50.0)
    assert truths[1].faults == truths[0].faults
    assert truths[2].faults == ()  # the ramp of the clearing is over
    assert simulation.truth(at[2] - 1).faults != ()
    assert simulation.truth(at[0] - 1).faults == ()
    simulation.advance(2000)
    assert simulation.truth().sample == at[0]


def test_faults_from_the_start_and_injected_again(scenario):
    fault = FaultSpec("outer_race_spall", "bearing_1")
    start = dataclasses.replace(scenario, faults=(fault,), events=())
    simulation = Simulation(start, 0, RigDouble(RATE))
    simulation.advance(1000)
    again = simulation.inject(dataclasses.replace(fault, severity=1.5))
    simulation.advance(1000)
    cleared = simulation.clear("", ramp_s=0.0)
    end = cleared + round(0.01 * RATE)  # no fault ends faster
    begin, grown, gone = (simulation.truth(sample) for sample in (0, again, end))
    assert simulation.truth(end - 1).faults
    assert [f.parameters["severity"] for f in begin.faults + grown.faults] == [1.0, 1.5]
    assert grown.faults[0].since_sample == 0  # it is still the same fault
    assert gone.faults == ()


def test_truth_becomes_the_message(scenario):
    simulation = Simulation(scenario, 1000, RigDouble(RATE))
    truth = simulation.truths(0, 10_000)[0]
    assert message_name(truth) == "GroundTruth"
    msg = to_msg(truth, pure_types())
    assert (msg.sample, msg.seed, msg.speed, msg.load) == (truth.sample, 5, 10.0, 50.0)
    assert msg.faults[0].fault_id == "spall"
    assert msg.header.frame_id == "unsw_parallel"


def test_mistakes_are_told_before_the_stream_begins(scenario):
    row = dataclasses.replace(scenario.sensors.accelerometers[0], site="roof")
    sensors = dataclasses.replace(scenario.sensors, accelerometers=(row,))
    with pytest.raises(InputError, match="site: got roof, expected one of b1_y, b3_y"):
        Simulation(dataclasses.replace(scenario, sensors=sensors), 0, RigDouble(RATE))

    class Refuses(RigDouble):
        def inject(self, fault, *_):
            raise InputError("fault", "component", fault.component, "one of bearing_9")

    at_s = scenario.events[0].at_sample / RATE
    with pytest.raises(
        InputError, match=rf"rig.yaml: timeline, at {at_s:g} s: fault: component: got bearing_3"
    ):
        Simulation(scenario, 0, Refuses(RATE))


def test_the_model_is_asked_in_moderate_portions(scenario):
    double = RigDouble(RATE)
    list(simulate(scenario, 1.0, model=double))
    assert max(double.calls) <= BATCH + 32


SENSORS = """
sensors:
  accelerometers:
    channels: [b1_y, b3_y, slant]
    sampling: {oversampling: 4, antialias: none}
    all: {mounting: {resonance: 20 kHz, q: 20}, mains: {amplitude: 0.2 m/s^2}, dropouts: {rate: 5 Hz}}
    each: {slant: {site: {b1_y: 0.6, b3_y: 0.8}, delay: 100 us}}
  tachos: {jitter: 50 us, missing: 0.1, each: {output: {jitter: 0 s}}}
  encoders: {mark_error: 0.02, clock: 1 MHz}
  torques: {shafts: [input]}
timeline:
  - {at: 0.1 s, inject: {kind: outer_race_spall, component: bearing_3, ramp: 0.05 s, id: spall}}
"""


def _faulty(tmp_path):
    path = tmp_path / "faulty.yaml"
    start = SCENARIO[: SCENARIO.index("sensors:")]
    path.write_text(start + SENSORS)
    return load_scenario(path)


class FastDouble(RigDouble):
    """At four times the rate, with a torque."""

    def __init__(self):
        super().__init__(4 * RATE)

    def advance(self, n, events=()):
        output = super().advance(n, events)
        k = np.arange(output.first_sample, output.first_sample + n)
        return dataclasses.replace(output, signals={"input_torque": 50 + np.sin(0.001 * k)})


def test_sensors_that_work_faster_than_the_samples_come(tmp_path):
    scenario = _faulty(tmp_path)
    whole = list(simulate(scenario, 3300 / RATE, 7, FastDouble()))
    kinds = [SampleBatch, TachoBatch, TachoBatch, EncoderBatch, EncoderBatch, TorqueBatch]
    assert [type(batch) for batch in whole[:6]] == kinds
    simulation = Simulation(scenario, 7, FastDouble())
    portions = [1, 2, 3, 499, 501, 1294, 1000]
    again = [batch for n in portions for batch in simulation.advance(n)] + simulation.finish()
    assert_same(again, whole)
    assert [batch.channels for batch in whole[:6:5]] == [("b1_y", "b3_y", "slant"), ("input_torque",)]


def test_angles_keep_their_time_when_sensors_work_faster(tmp_path):
    scenario = _faulty(tmp_path)
    clean = dataclasses.replace(
        scenario.sensors, encoders=tuple(Encoder(row.shaft) for row in scenario.sensors.encoders)
    )
    double = FastDouble()
    record = to_record(dataclasses.replace(scenario, sensors=clean), 0.5, model=double)
    for number, encoder in enumerate(record.encoders):
        edges = encoder.first_edge + np.arange(encoder.samples.size)
        angle = double.angle_turns(4 * encoder.samples, number)
        np.testing.assert_allclose(angle, edges / 900, rtol=0, atol=1e-8)


def test_a_record_holds_the_torque_and_gives_its_batches(tmp_path):
    scenario = _faulty(tmp_path)
    record = to_record(scenario, 0.5, model=FastDouble())
    assert record.torques is not None
    assert record.torques.data_nm.shape == (1, 8192)
    # the gain error, offset and noise of the chain, and the delay of its 1 kHz roll-off
    exact = 50 + np.sin(0.004 * np.arange(8192))
    np.testing.assert_allclose(record.torques.data_nm[0][200:], exact[200:], atol=0.5)
    batches = [batch for batch in record.batches(BATCH) if isinstance(batch, TorqueBatch)]
    live = [batch for batch in simulate(scenario, 0.5, 0, FastDouble()) if isinstance(batch, TorqueBatch)]
    assert_same(batches, live)


def test_events_keep_their_sample_when_sensors_work_faster(tmp_path):
    scenario = _faulty(tmp_path)
    ideal = dataclasses.replace(scenario, sensors=load_ideal(scenario))
    live = Simulation(ideal, 0, FastDouble())
    batches = live.advance(3000)
    sample = live.inject(FaultSpec("inner_race_spall", "bearing_2", {"width_m": 1e-3}), ramp_s=0.0)
    batches += live.advance(3000) + live.finish()
    stream = np.concatenate([b.data[0] for b in batches if isinstance(b, SampleBatch)])
    steps = np.flatnonzero(np.abs(np.diff(stream - np.sin(0.1 * 4 * np.arange(stream.size)))) > 1) + 1
    assert steps.tolist() == [round(0.1 * RATE), sample]
    events = ideal.with_events(live.truth().events)
    assert_same(list(simulate(events, 6000 / RATE, 0, FastDouble())), batches)


def test_sensor_mistakes_name_the_scenario(tmp_path):
    scenario = _faulty(tmp_path)
    with pytest.raises(
        InputError, match=r"faulty\.yaml: sensors\.torques: shafts: got input_torque, expected no"
    ):
        Simulation(scenario, 0, RigDouble(4 * RATE))
    fast = dataclasses.replace(scenario, sample_rate_hz=500_000.0)
    with pytest.raises(InputError, match=r"sampling\.oversampling: got 4, expected at most 2"):
        Simulation(fast)
