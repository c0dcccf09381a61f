"""The twin node as a process: it learns, stores, and tells what its model misses anew."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
from feeder import Rig

from gearsim_io import qos

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "twin"))
from live_rig import machine, stream

pytestmark = pytest.mark.graph

TWIN = "gearsim_twin.nodes.twin"
_COMPILED_S = 240.0  # the integrator, on a busy computer where it never was
SETTINGS = {"window_s": 1.0, "hop_s": 0.5, "learn_s": 12.0}


def connected(rig):
    rig.until(lambda: all(out.get_subscription_count() for out in rig.out.values()), _COMPILED_S)


@pytest.fixture
def rig(ros_domain):
    return Rig(ros_domain)


def test_it_learns_the_standing_discrepancy_and_tells_a_new_one(rig, tmp_path):
    node = rig.domain.start_node(TWIN, {**SETTINGS, "model": "bearing2", "baseline_dir": str(tmp_path)})
    diagnostics = rig.hear(qos.DIAGNOSTICS)
    features, alarms = rig.hear(qos.FEATURES), rig.hear(qos.ALARM)
    connected(rig)
    rig.nameplate(machine())
    rig.until(lambda: rig.status("twin: machine")[1] == "mfpt")
    rig.play(stream(24.0, 5, fault_at_s=20.0).batches(4096), times_real=3.0)
    stored = tmp_path / "mfpt.twin.json"
    rig.until(stored.exists)
    rig.until(lambda: any("BPFO of test_bearing" in alarm.reason for alarm in alarms))
    assert {alarm.source for alarm in alarms} == {"twin"}
    assert min(alarm.header.stamp.sec + 1e-9 * alarm.header.stamp.nanosec for alarm in alarms) > 20.0
    assert {each.source for each in features} == {"twin"}
    names = {value.name for each in features for value in each.values}
    assert {"psd_residual_rms", "envelope_residual_rms", "envelope_residual"} <= names
    rig.until(lambda: rig.status("twin: alarms")[0] == 2)
    assert rig.status("twin: baseline")[1] == "learnt from 12 s"
    assert diagnostics
    assert node.stop() == 0, node.output
    assert "Traceback" not in node.output


def test_bad_models_are_told_in_one_line(rig):
    for values, words in (
        ({}, "model: got nothing, expected a scenario"),
        ({"model": "nonsense"}, "got nonsense"),
    ):
        node = rig.domain.start_node(TWIN, values)
        assert node.wait(_COMPILED_S) == 2, node.output
        assert words in node.output.strip().splitlines()[-1]
    node = rig.domain.start_node(TWIN, {"model": "lpm34"})
    rig.hear(qos.DIAGNOSTICS)
    connected(rig)
    rig.nameplate(machine())
    rig.until(lambda: "nameplate refused" in rig.status("twin: machine")[1])
    assert "a model that describes mfpt" in rig.status("twin: machine")[1]
    assert node.stop() == 0, node.output
