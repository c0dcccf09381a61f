"""What the exporter tells Prometheus, and the payloads for MQTT."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import pytest
from example_results import alarm, features, trend_value, trends
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from gearsim_bringup.monitoring.metrics import RigMetrics
from gearsim_bringup.monitoring.mqtt_messages import messages_of, segment
from gearsim_dsp.results import AlarmState, Level

ALARM = alarm(reason='outer race of bearing_3: 48.8 Hz, "loud"\n')
FEATURES = features()
ROW = trend_value()
TRENDS = trends(ROW)


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def metrics(clock):
    return RigMetrics(clock, forget_s=60.0)


def scrape(metrics):
    """{name: {labels as a frozenset: value}} as Prometheus would read it."""
    registry = CollectorRegistry()
    registry.register(metrics)
    found = {}
    for family in text_string_to_metric_families(generate_latest(registry).decode()):
        for sample in family.samples:
            found.setdefault(sample.name, {})[frozenset(sample.labels.items())] = sample.value
    return found


def only(found, name):
    (value,) = found[name].values()
    return value


def labels(found, name):
    return [dict(key) for key in found[name]]


def test_indicators_trends_and_speed(metrics):
    metrics.features(FEATURES)
    metrics.trends(TRENDS)
    found = scrape(metrics)
    assert only(found, "gearsim_feature") == 3.5
    assert labels(found, "gearsim_feature") == [
        {
            "machine": "rig",
            "source": "kurtosis",
            "channel": "b3_y",
            "component": "",
            "name": "rms",
            "unit": "m/s^2",
        }
    ]
    assert only(found, "gearsim_speed_hertz") == 10.0
    for name, value in (("expected", 2.0), ("limit", 4.0), ("deviation", 6.0), ("hours_to_limit", 1.0)):
        assert only(found, f"gearsim_trend_{name}") == value
    assert only(found, "gearsim_trend_slope_per_hour") == 0.5
    assert sum(found["gearsim_messages_total"].values()) == 2


def test_an_alarm_from_its_rise_to_its_end(metrics):
    metrics.alarm(ALARM)
    metrics.alarm_state(AlarmState(6, "rig", "envelope", Level.ERROR, False, "", 1, (ALARM,)))
    found = scrape(metrics)
    assert only(found, "gearsim_alarm_level") == 2
    assert only(found, "gearsim_alarm_present") == 1
    assert only(found, "gearsim_alarm_acknowledged") == 0
    assert labels(found, "gearsim_alarm_reason")[0]["reason"] == ALARM.reason
    assert only(found, "gearsim_alarm_state_level") == 2
    metrics.alarm(replace(ALARM, acknowledged=True, channel="b3_x"))  # one alarm stays one series
    found = scrape(metrics)
    assert only(found, "gearsim_alarm_acknowledged") == 1
    assert labels(found, "gearsim_alarm_level")[0]["channel"] == "b3_x"
    metrics.alarm(replace(ALARM, level=Level.OK, present=False))
    metrics.alarm_state(AlarmState(8, "rig", "envelope", Level.OK, True, "no samples", 1))
    found = scrape(metrics)
    assert only(found, "gearsim_alarm_level") == 0
    assert only(found, "gearsim_alarm_state_stale") == 1
    assert {tuple(sorted(dict(k).items())): v for k, v in found["gearsim_alarm_changes_total"].items()} == {
        (("level", "ERROR"), ("source", "envelope")): 2,
        (("level", "OK"), ("source", "envelope")): 1,
    }


def test_a_latecomer_learns_of_alarms_from_the_state_and_of_their_end_too(metrics):
    metrics.alarm_state(AlarmState(6, "rig", "envelope", Level.ERROR, False, "", 1, (ALARM,)))
    assert only(scrape(metrics), "gearsim_alarm_level") == 2
    metrics.alarm_state(AlarmState(7, "rig", "kurtosis", Level.OK, False, "", 1))
    assert only(scrape(metrics), "gearsim_alarm_level") == 2
    metrics.alarm_state(AlarmState(7, "rig", "envelope", Level.OK, False, "", 1))
    assert "gearsim_alarm_level" not in scrape(metrics)


def test_what_is_not_heard_of_any_more_is_dropped_but_alarms_stay(metrics, clock):
    metrics.features(FEATURES)
    metrics.trends(TRENDS)
    metrics.diagnostics({("envelope: alarms", "rig"): 2})
    metrics.alarm(ALARM)
    clock.now_s += 59.0
    assert only(scrape(metrics), "gearsim_feature") == 3.5
    clock.now_s += 2.0
    found = scrape(metrics)
    for name in ("gearsim_feature", "gearsim_speed_hertz", "gearsim_trend_limit", "gearsim_diagnostic_level"):
        assert name not in found
    assert only(found, "gearsim_alarm_level") == 2


def test_a_node_that_has_come_to_know_its_machine_is_one_node(metrics):
    metrics.alarm_state(AlarmState(0, "", "envelope", Level.OK, True, "no window judged yet", 0))
    metrics.alarm_state(AlarmState(0, "", "kurtosis", Level.OK, True, "no window judged yet", 0))
    metrics.diagnostics({("envelope: alarms", "gearsim"): 3})
    metrics.alarm_state(AlarmState(6, "rig", "envelope", Level.OK, False, "", 1))
    metrics.diagnostics({("envelope: alarms", "rig"): 0})
    found = scrape(metrics)
    stale = {(row["machine"], row["source"]) for row in labels(found, "gearsim_alarm_state_stale")}
    assert stale == {("rig", "envelope"), ("", "kurtosis")}
    assert labels(found, "gearsim_diagnostic_level") == [{"name": "envelope: alarms", "hardware_id": "rig"}]


def test_memory_is_bounded_and_what_is_left_out_is_counted(metrics):
    for k in range(RigMetrics.MOST_SERIES + 10):
        metrics.features(replace(FEATURES, channel=f"c{k}"))
        metrics.alarm(replace(ALARM, alarm_id=f"envelope/x/{k}"))
    found = scrape(metrics)
    assert len(found["gearsim_feature"]) == RigMetrics.MOST_SERIES
    assert len(found["gearsim_alarm_level"]) == RigMetrics.MOST_SERIES
    assert only(found, "gearsim_series_left_out_total") == 20


def test_messages_for_a_broker():
    told = messages_of("plant/hall_2", FEATURES)
    assert (told.topic, told.qos, told.retain) == ("plant/hall_2/rig/features/kurtosis/b3_y", 0, False)
    assert json.loads(told.payload)["values"] == [
        {"name": "rms", "component": "", "value": 3.5, "unit": "m/s^2"}
    ]
    told = messages_of("gearsim", replace(ALARM, found_order=math.nan))
    assert (told.topic, told.qos, told.retain) == ("gearsim/rig/alarm/envelope/bearing_3/outer_race", 1, True)
    content = json.loads(told.payload)
    assert (content["level"], content["found_order"], content["reason"]) == ("ERROR", None, ALARM.reason)
    told = messages_of("gearsim", AlarmState(6, "rig", "envelope", Level.OK, False, "", 1, (ALARM,)))
    assert (told.topic, told.retain) == ("gearsim/rig/state/envelope", True)
    assert json.loads(told.payload)["active"][0]["alarm_id"] == ALARM.alarm_id
    told = messages_of("gearsim", replace(TRENDS, values=(replace(ROW, hours_to_limit=math.inf),)))
    assert told.topic == "gearsim/rig/trends/trend"
    assert json.loads(told.payload)["values"][0]["hours_to_limit"] is None


def test_names_become_levels_of_topics_that_brokers_accept():
    assert segment("b3_y") == "b3_y"
    assert segment("a/b+c#d\x00e") == "a_b_c_d_e"
    assert segment("$SYS") == "SYS"
    assert segment("") == "_"
    assert len(segment("x" * 10_000)) <= 200
