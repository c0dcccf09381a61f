"""The trend node and the alarm services as processes."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from feeder import Rig
from rig_stream import machine, record

from gearsim_dsp.results import Alarm, Features, FeatureValue
from gearsim_io import qos
from gearsim_io.messages import from_msg

pytestmark = pytest.mark.graph

TREND = "gearsim_dsp.nodes.trend"
ENVELOPE = "gearsim_dsp.nodes.envelope"


class Indicators(Rig):
    """A source of indicators."""

    def __init__(self, domain):
        super().__init__(domain)
        self.features = qos.create_publisher(self.node, qos.FEATURES)
        self.alarm = qos.create_publisher(self.node, qos.ALARM)
        self.rng = np.random.default_rng(1)
        self.window = 0

    def ready(self):
        self.until(lambda: self.features.get_subscription_count() >= 1)
        self.nameplate()
        self.hear(qos.DIAGNOSTICS)

    def send_windows(self, count, rms=None):
        for _ in range(count):
            k, self.window = self.window, self.window + 1
            value = 2.0 * math.exp(0.03 * self.rng.standard_normal()) if rms is None else rms
            values = (FeatureValue("rms", "", value, "m/s^2"), FeatureValue("kurtosis", "", 3.0, "1"))
            made = Features(
                k * 500_000_000,
                "test_rig",
                "kurtosis",
                "b3",
                k * 4096,
                16384,
                8192.0,
                0.0,
                4096.0,
                10.0,
                "tacho",
                values,
            )
            self.features.publish(self.to_msg(made, self.types))
            if k % 20 == 19:
                self.domain.spin(self.node, lambda: False, 0.05)

    def call(self, kind, name, **fields):
        import gearsim_msgs.srv

        service = getattr(gearsim_msgs.srv, kind)
        client = self.node.create_client(service, name)
        self.until(client.service_is_ready)
        future = client.call_async(service.Request(**fields))
        self.until(future.done)
        return future.result()


@pytest.fixture
def rig(ros_domain):
    return Indicators(ros_domain)


def clean_end(process):
    assert process.stop() == 0, process.output
    assert "Traceback" not in process.output


def test_it_learns_stores_judges_and_remembers_what_it_learnt(rig, tmp_path):
    settings = {"baseline_dir": str(tmp_path), "learn_s": 30.0}
    node = rig.domain.start_node(TREND, settings)
    rig.ready()
    alarms, trends = rig.hear(qos.ALARM), rig.hear(qos.TRENDS)
    rig.send_windows(40)
    rig.until(lambda: "learning" in rig.status("trend: baseline")[1])
    assert rig.status("trend: alarms")[0] == 3  # STALE: nothing can be judged yet
    rig.send_windows(40)
    rig.until(lambda: rig.status("trend: baseline")[1] == "learnt from 30 s")
    stored = tmp_path / "test_rig.trend.json"
    rig.until(stored.exists)
    rig.send_windows(20)
    rig.until(lambda: rig.status("trend: alarms")[:2] == (0, "no alarm"))
    rig.until(lambda: trends)
    assert {value.name for value in trends[-1].values} == {"rms", "kurtosis"}
    clean_end(node)
    # another process judges from the first window by what was stored
    node = rig.domain.start_node(TREND, settings | {"latch": "all"})
    rig.until(lambda: rig.features.get_subscription_count() >= 1)
    rig.nameplate()
    rig.until(lambda: rig.status("trend: machine")[1] == "test_rig")
    rig.send_windows(12, rms=9.0)
    rig.until(lambda: alarms)
    assert alarms[0].level == 2
    assert alarms[0].reason.startswith("b3: rms 4.5 times as high, 9 m/s^2 where the healthy machine has 2")
    rig.until(lambda: rig.status("trend: alarms")[0] == 2)
    # gone, but latched
    rig.send_windows(30)
    rig.until(lambda: not alarms[-1].present)
    assert alarms[-1].level == 2
    answer = rig.call("AcknowledgeAlarm", "trend/acknowledge_alarm", alarm_id="nonsense", by="Ada")
    assert not answer.success
    assert "alarm_id: got nonsense, expected one of trend/machine/unknown/kurtosis/b3" in answer.message
    answer = rig.call("AcknowledgeAlarm", "trend/acknowledge_alarm", by="Ada")
    assert (answer.success, list(answer.alarm_ids)) == (True, [alarms[0].alarm_id])
    rig.until(lambda: alarms[-1].level == 0)
    assert "acknowledged by Ada, its cause has gone" in alarms[-1].reason
    # learning anew, and giving it up when another node sees a fault
    answer = rig.call("LearnBaseline", "trend/learn_baseline", seconds=20.0)
    assert (answer.success, answer.message) == (True, "baseline: learning 0 of 20 s")
    rig.send_windows(10)
    other = replace(from_msg(alarms[0], Alarm), source="envelope", reason="outer race of bearing_3: loud")
    rig.alarm.publish(rig.to_msg(other, rig.types))
    rig.until(lambda: any("learning was given up" in line for line in node.lines))
    rig.send_windows(60)
    rig.until(lambda: rig.status("trend: baseline")[1] == "learnt from 30 s")  # the old one still counts
    assert not rig.call("LearnBaseline", "trend/learn_baseline", seconds=-1.0).success
    clean_end(node)


def test_a_stored_baseline_that_cannot_be_read_is_told_and_not_overwritten(rig, tmp_path):
    stored = tmp_path / "test_rig.trend.json"
    stored.write_text("{")
    node = rig.domain.start_node(TREND, {"baseline_dir": str(tmp_path), "learn_s": 5.0})
    rig.ready()
    rig.send_windows(40)
    rig.until(lambda: rig.status("trend: baseline")[0] == 1)
    assert "a stored baseline" in rig.status("trend: baseline")[1]
    assert stored.read_text() == "{"
    clean_end(node)


def test_a_change_of_level_is_on_diagnostics_at_once(ros_domain):
    """A quarter of a second later on the average if the node's timer brought it; here it comes at once."""
    rig = Rig(ros_domain)
    node = rig.domain.start_node(ENVELOPE)
    alarms, late = [], []
    shown = {"level": 0, "s": 0.0}

    def look(array):
        for status in array.status:
            if status.name == "envelope: alarms" and status.level[0] != shown["level"]:
                shown.update(level=status.level[0], s=time.monotonic())

    qos.create_subscription(rig.node, qos.ALARM, lambda m: alarms.append((m.level, time.monotonic())))
    qos.create_subscription(rig.node, qos.DIAGNOSTICS, look)
    rig.connected()
    rig.nameplate()
    batches = list(record(seconds=12.0, fault_at_s=0.0, amplitude=2.0).batches(512))
    stretches = [batches[:96], *(batches[k : k + 48] for k in range(96, 288, 48))]

    def told(level):
        rig.until(lambda: alarms and alarms[-1][0] == level and shown["level"] == level)
        late.append(shown["s"] - alarms[-1][1])

    for stretch in stretches:  # each raises the alarm anew
        rig.play(stretch)
        told(2)
        reset(rig)
        told(0)
    assert len(late) == 10
    assert np.median(late) < 0.1
    clean_end(node)


def reset(rig):
    from gearsim_msgs.srv import ResetAlarm

    client = rig.node.create_client(ResetAlarm, "envelope/reset_alarm")
    rig.until(client.service_is_ready)
    future = client.call_async(ResetAlarm.Request())
    rig.until(future.done)
    assert future.result().success


def test_the_gear_node_learns_judges_and_tells_what_stands_out(ros_domain, tmp_path):
    from test_gear_monitor import MACHINE, RATE_HZ
    from test_gear_monitor import record as gear_record

    rig = Rig(ros_domain)
    settings = {"baseline_dir": str(tmp_path), "learn_s": 15.0, "window_s": 1.0, "hop_s": 0.5}
    node = rig.domain.start_node("gearsim_dsp.nodes.gear", settings)
    alarms, features = rig.hear(qos.ALARM), rig.hear(qos.FEATURES)
    rig.hear(qos.DIAGNOSTICS)
    rig.connected()
    rig.nameplate(MACHINE)
    assert RATE_HZ == 8192.0  # that of the feeder's pace
    rig.play(gear_record(24.0, fault_at_s=20.0).batches(1024))
    rig.until(lambda: alarms)
    assert (alarms[0].source, alarms[0].component) == ("gear", "gears.pinion")
    assert "one tooth stands out" in alarms[0].reason
    assert {f.source for f in features} == {"gear"}
    assert (tmp_path / "gear_rig.gear.json").exists()
    rig.until(lambda: rig.status("gear: baseline")[1] == "learnt from 15 s")
    clean_end(node)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"latch": "sometimes"}, "latch: got sometimes, expected one of none, error, all"),
        ({"learn_s": 0.0}, "learn_s: got 0.0"),
    ],
)
def test_bad_parameters_end_the_node_with_one_line_and_status_2(ros_domain, parameters, words):
    node = ros_domain.start_node(TREND, parameters)
    assert node.wait() == 2
    assert words in node.output
    assert machine().name == "test_rig"
