"""The diagnostic nodes as processes, fed over DDS with a synthetic bearing."""

from __future__ import annotations

import signal
import sys
import time
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from gearsim_io import qos

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "dsp"))
from feeder import Rig
from rig_stream import machine, record

pytestmark = pytest.mark.graph

ENVELOPE = "gearsim_dsp.nodes.envelope"
KURTOSIS = "gearsim_dsp.nodes.kurtosis"
FAULT_AT_S = 4.0


@cache
def faulty():
    return record(seconds=10.0, fault_at_s=FAULT_AT_S)


@pytest.fixture
def rig(ros_domain):
    return Rig(ros_domain)


def clean_end(process, number=signal.SIGINT):
    assert process.stop(number) == 0, process.output
    assert "Traceback" not in process.output


def plain(message):
    from gearsim_dsp.results import Alarm
    from gearsim_io.messages import from_msg

    return from_msg(message, Alarm)


def test_a_node_that_must_be_heard_takes_no_samples_before(rig):
    """Else an alarm may come before the middleware has connected its listener, and is lost."""
    rig.domain.start_node(ENVELOPE, {"alarm_listeners": 1})
    rig.hear(qos.DIAGNOSTICS)
    rig.until(lambda: rig.status("envelope: machine")[0] is not None)
    assert not rig.domain.spin(rig.node, lambda: rig.node.count_subscribers("/gearsim/accel"), 2.0)
    rig.hear(qos.ALARM)
    assert rig.domain.spin(rig.node, lambda: rig.node.count_subscribers("/gearsim/accel"), 10.0)


def test_a_fault_is_told_by_both_nodes_exactly_as_offline(rig):
    from gearsim_dsp.alarms import AlarmSettings
    from gearsim_dsp.streams.envelope_monitor import EnvelopeMonitor
    from gearsim_dsp.streams.kurtosis_monitor import KurtosisMonitor
    from gearsim_dsp.streams.report import AlarmedMonitor

    nodes = [rig.domain.start_node(ENVELOPE), rig.domain.start_node(KURTOSIS)]
    alarms, features, spectra = rig.hear(qos.ALARM), rig.hear(qos.FEATURES), rig.hear(qos.SPECTRUM)
    rig.hear(qos.DIAGNOSTICS)
    rig.connected(2)
    rig.nameplate()
    batches = list(faulty().batches(512))
    rig.play(batches)
    rig.until(lambda: {a.source for a in alarms} == {"envelope", "kurtosis"})
    rig.until(lambda: len(features) >= 17 * 2 + 17 * 4)
    rig.until(lambda: rig.status("envelope: alarms")[0] == 2)
    for make, source in ((EnvelopeMonitor, "envelope"), (KurtosisMonitor, "kurtosis")):
        offline = AlarmedMonitor(make(machine()), AlarmSettings())
        expected = [alarm for batch in batches for o in offline.push(batch) for alarm in o.alarms]
        assert repr([plain(a) for a in alarms if a.source == source]) == repr(expected)
    first = next(a for a in alarms if a.source == "envelope")
    assert (first.component, first.fault, first.channel) == ("bearing_3", "outer_race", "b3")
    assert first.header.stamp.sec + first.header.stamp.nanosec * 1e-9 < FAULT_AT_S + 3.0
    assert first.found_frequency == pytest.approx(48.9, rel=0.003)
    assert "outer race of bearing_3: 48.9 Hz" in first.reason
    assert {f.channel for f in features} == {"b1", "b3"}
    assert all(s.source == "envelope" and len(s.values) > 100 and s.markers for s in spectra)
    seen = dict(rig.node.get_topic_names_and_types())
    for name in ("features", "spectrum", "alarm", "envelope/alarm_state", "kurtosis/alarm_state"):
        assert f"/gearsim/{name}" in seen
    # a latecomer is told the state at once
    late = rig.domain.node("latecomer")
    states = []
    qos.create_subscription(late, qos.ALARM_STATE.of("envelope"), states.append)
    assert rig.domain.spin(late, lambda: states, 5.0)
    assert states[0].level == 2
    assert [a.component for a in states[0].active] == ["bearing_3"]
    clean_end(nodes[0])
    clean_end(nodes[1], signal.SIGTERM)


def test_without_nameplate_it_says_so_and_goes_on_when_it_comes(rig):
    node = rig.domain.start_node(ENVELOPE, {"patience_s": 0.5})
    rig.hear(qos.DIAGNOSTICS)
    states = rig.hear(qos.ALARM_STATE.of("envelope"))
    alarms = rig.hear(qos.ALARM)
    rig.connected()
    rig.play(faulty().batches(512))
    rig.until(lambda: rig.status("envelope: machine")[0] == 1)
    assert "no nameplate on machine_info" in rig.status("envelope: machine")[1]
    rig.until(lambda: states and states[-1].stale and "no nameplate" in states[-1].note)
    assert alarms == []
    rig.nameplate()
    rig.until(lambda: alarms)
    assert alarms[0].component == "bearing_3"
    rig.until(lambda: rig.status("envelope: machine")[0] == 0)
    rig.until(lambda: not states[-1].stale or "no samples" in states[-1].note)
    rig.until(lambda: rig.status("envelope: stream")[2].get("windows") == "17")
    # another machine: what was said of the old one is taken back
    rig.nameplate(replace(machine(), name="other_rig"))
    rig.until(lambda: rig.status("envelope: machine")[1] == "other_rig")
    rig.send(next(iter(faulty().batches(512))))
    rig.until(lambda: alarms[-1].level == 0 and states[-1].level == 0)
    assert alarms[-1].reason == "another nameplate came"
    # an impossible nameplate is refused and the node goes on with the one it has
    broken = replace(machine().bearings[0], element_diameter_m=1.0)
    rig.nameplate(replace(machine(), name="broken_rig", bearings=(broken,)))
    rig.until(lambda: rig.status("envelope: machine")[0] == 2)
    assert "nameplate refused" in rig.status("envelope: machine")[1]
    clean_end(node)


def test_bad_messages_are_told_in_one_line_and_the_stream_goes_on(rig):
    from std_msgs.msg import String

    node = rig.domain.start_node(ENVELOPE)
    rig.hear(qos.DIAGNOSTICS)
    alarms = rig.hear(qos.ALARM)
    rig.connected()
    rig.nameplate()
    stranger = rig.domain.node("stranger")  # one participant cannot have two types on a topic
    wrong = stranger.create_publisher(String, qos.TACHO.name, 10)
    batches = list(faulty().batches(512))
    rig.play(batches[:20])
    # not finite
    data = batches[20].data.copy()
    data[0, 7] = np.nan
    rig.send(replace(batches[20], data=data))
    rig.send(batches[21])
    # the wrong number of values for the channels
    message = rig.to_msg(batches[22], rig.types)
    message.channel_names = [*message.channel_names, "b9"]
    rig.out[qos.ACCEL.name].publish(message)
    rig.play(batches[22:40])
    # a gap of two batches (samples and tacho)
    rig.play(batches[44:])
    rig.until(lambda: alarms and alarms[0].component == "bearing_3")
    rig.until(lambda: rig.status("envelope: stream")[2].get("gaps") == "1")
    level, _, values = rig.status("envelope: stream")
    assert level == 1
    assert (values["lost samples"], values["refused messages"], values["batches not finite"]) == (
        "1024",
        "1",
        "1",
    )
    rig.until(lambda: any("/gearsim/stranger" in line for line in node.lines))
    for words in (
        "samples that are not finite on b1 (sample 5120)",
        "message on accel refused: SampleBatch: data: got 1024 values, expected 3 channels x 512 samples",
        "1024 samples lost before sample 11264",
        "tacho: /gearsim/stranger sends std_msgs/msg/String, expected gearsim_msgs/msg/TachoBatch",
    ):
        assert len([line for line in node.lines if words in line]) == 1, node.output
    assert wrong.get_subscription_count() == 0
    clean_end(node, signal.SIGTERM)


def test_silence_makes_the_state_stale_and_a_new_start_of_the_source_takes_alarms_back(rig):
    node = rig.domain.start_node(ENVELOPE, {"stale_after_s": 1.0})
    rig.hear(qos.DIAGNOSTICS)
    states, alarms = rig.hear(qos.ALARM_STATE.of("envelope")), rig.hear(qos.ALARM)
    rig.connected()
    rig.nameplate()
    rig.play(faulty().batches(512))
    rig.until(lambda: rig.status("envelope: stream")[0] == 3)
    rig.until(lambda: states[-1].stale)
    assert "no samples for" in states[-1].note
    assert states[-1].level == 2  # what was known stays known
    rig.play(record(seconds=4.0, seed=5).batches(512))
    rig.until(lambda: alarms[-1].level == 0)
    assert alarms[-1].reason == "the stream began again"
    rig.until(lambda: states[-1].level == 0 and not states[-1].active)
    rig.until(lambda: rig.status("envelope: stream")[2].get("restarts") == "1")
    clean_end(node)


def test_a_node_that_cannot_keep_up_says_so_and_stays_within_its_memory(rig):
    settings = {"queue_s": 0.5, "hop_s": 0.02, "window_s": 2.0}
    node = rig.domain.start_node(ENVELOPE, settings)
    rig.hear(qos.DIAGNOSTICS)
    rig.connected()
    rig.nameplate()
    rig.play(faulty().batches(512), times_real=25.0)
    rig.until(lambda: int(rig.status("envelope: stream")[2].get("batches dropped for lack of time", 0)) > 0)
    rig.until(lambda: int(rig.status("envelope: stream")[2].get("gaps", 0)) > 0)
    rig.until(lambda: any("cannot keep up" in line for line in node.lines))
    assert float(rig.status("envelope: stream")[2]["signal waiting [s]"]) <= 0.6
    clean_end(node, signal.SIGTERM)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        (
            {"window_s": 500.0},
            "window_s: got 500.0, expected a number with a point, such as 2.0, from 0.05 to 60",
        ),
        ({"window_s": "long"}, "window_s: got 'long', expected a number with a point"),
        ({"hop_s": 5.0}, "hop_s: got 5.0, expected at most window_s = 2 s"),
        ({"band_low_hz": 900.0, "band_high_hz": 100.0}, "band_hz: got (900.0, 100.0)"),
    ],
)
def test_bad_parameters_end_the_node_with_one_line_and_status_2(ros_domain, parameters, words):
    node = ros_domain.start_node(ENVELOPE, parameters)
    assert node.wait() == 2
    assert words in node.output
    assert len([line for line in node.lines if line.strip()]) == 1


def test_ctrl_c_before_anything_arrived_is_clean(rig):
    node = rig.domain.start_node(KURTOSIS)
    rig.connected()
    clean_end(node)


@pytest.mark.parametrize("after_s", [0.4, 0.8])
def test_ctrl_c_while_it_is_still_starting_leaves_no_traceback(ros_domain, after_s):
    node = ros_domain.start_node(ENVELOPE)
    time.sleep(after_s)
    assert node.stop() in (0, -signal.SIGINT)
    assert "Traceback" not in node.output
