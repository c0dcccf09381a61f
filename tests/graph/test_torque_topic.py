"""Torque over DDS: on its own topic, the same bits as offline, beside the other signals."""

import numpy as np
import pytest

from gearsim_io import qos
from gearsim_io.batches import SampleBatch, TachoBatch, TorqueBatch
from gearsim_io.messages import from_msg
from gearsim_sim.scenario import load_scenario
from gearsim_sim.simulation import simulate

pytestmark = pytest.mark.graph

SCENARIO = """
machine: unsw_parallel
sample_rate: 16384 Hz
oversampling: 8
batch_samples: 1024
operating_point: {speed: 10 Hz, load: 50 N*m}
sensors:
  accelerometers: {channels: [b3_y]}
  tachos: {jitter: 20 us, missing: 0.1, pulses: 20}
  torques: {shafts: [input]}
"""


def test_torque_and_faulty_pulses_go_out_as_offline(ros_domain, tmp_path):
    path = tmp_path / "torque.yaml"
    path.write_text(SCENARIO)
    node, got = ros_domain.node("listener"), {qos.ACCEL: [], qos.TACHO: [], qos.TORQUE: []}
    for topic, batches in got.items():
        qos.create_subscription(node, topic, lambda msg, batches=batches: batches.append(from_msg(msg)))
    parameters = {"scenario": str(path), "end_after": 0.5, "wait_for_subscribers": 1, "t0_ns": 10**18}
    process = ros_domain.start_node("gearsim_sim.nodes.simulator", parameters)
    assert ros_domain.spin(node, lambda: process.returncode is not None, 120.0)
    ros_domain.spin(node, lambda: len(got[qos.TORQUE]) == 8, 2.0)
    assert process.wait() == 0, process.output
    offline = list(simulate(load_scenario(path), 0.5, 10**18))
    for topic, kind, array in (
        (qos.ACCEL, SampleBatch, "data"),
        (qos.TORQUE, TorqueBatch, "data"),
        (qos.TACHO, TachoBatch, "pulse_offsets"),
    ):
        own = [batch for batch in offline if isinstance(batch, kind)]
        assert len(got[topic]) == len(own) > 0
        for live, made in zip(got[topic], own, strict=True):
            assert live.first_sample == made.first_sample
            np.testing.assert_array_equal(getattr(live, array), getattr(made, array))
    assert got[qos.TORQUE][0].unit == "N*m"
    assert got[qos.TORQUE][0].channels == ("input_torque",)
