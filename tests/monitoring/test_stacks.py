"""Real programs on the other side: Prometheus scrapes, promtool checks, a broker passes messages on."""

from __future__ import annotations

import json
import queue
import re
import socket
import subprocess
import sys
import time
import urllib.parse
from dataclasses import replace
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "graph"))
from debian import program, wait_for_http
from feeder import Rig
from test_metrics import ALARM, FEATURES, TRENDS

from gearsim_bringup.monitoring.files import FILES, read_file, write_files
from gearsim_dsp.results import AlarmState, Level
from gearsim_io import qos

pytestmark = pytest.mark.graph

EXPORTER = "gearsim_bringup.monitoring.nodes.exporter"
MQTT = "gearsim_bringup.monitoring.nodes.mqtt"
PROMETHEUS = ("prometheus",)
MOSQUITTO = ("mosquitto", "libmosquitto1", "libcjson1", "libdlt2", "libwrap0")


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Source(Rig):
    """Publishes results as the judging nodes would."""

    def __init__(self, domain):
        super().__init__(domain)
        topics = (qos.FEATURES, qos.TRENDS, qos.ALARM, qos.ALARM_STATE.of("envelope"))
        self.results = {topic.name: qos.create_publisher(self.node, topic) for topic in topics}
        self.hear(qos.DIAGNOSTICS)

    def ready(self):
        self.until(lambda: all(pub.get_subscription_count() for pub in self.results.values()))

    def tell(self, topic, result):
        self.results[topic.name].publish(self.to_msg(result, self.types))

    def tell_all(self, level=Level.ERROR):
        alarm = replace(ALARM, level=level)
        self.tell(qos.FEATURES, FEATURES)
        self.tell(qos.TRENDS, TRENDS)
        self.tell(qos.ALARM, alarm)
        active = (alarm,) if level > Level.OK else ()
        self.tell(
            qos.ALARM_STATE.of("envelope"), AlarmState(6, "rig", "envelope", level, False, "", 1, active)
        )


@pytest.fixture
def source(ros_domain):
    return Source(ros_domain)


def clean_end(process):
    assert process.stop() == 0, process.output
    assert "Traceback" not in process.output


# Prometheus


@pytest.fixture
def prometheus(tmp_path, ros_domain):
    """`start(exporter's port)` runs a real Prometheus with the shipped settings and gives its address."""
    binary, env = program("prometheus", PROMETHEUS)

    def start(port):
        write_files(tmp_path / "shipped")
        settings = tmp_path / "shipped" / "prometheus.yml"
        text = settings.read_text().replace("127.0.0.1:9812", f"127.0.0.1:{port}")
        settings.write_text(text.replace("_interval: 2s", "_interval: 200ms"))
        web = f"127.0.0.1:{free_port()}"
        ros_domain.env.update(env | {"ROS_DOMAIN_ID": ros_domain.env["ROS_DOMAIN_ID"]})
        ros_domain.start(
            str(binary),
            f"--config.file={settings}",
            f"--storage.tsdb.path={tmp_path / 'data'}",
            f"--web.listen-address={web}",
            name="prometheus",
        )
        wait_for_http(f"http://{web}/-/ready")
        return f"http://{web}"

    return start


def query(address, expression):
    url = f"{address}/api/v1/query?{urllib.parse.urlencode({'query': expression})}"
    answer = json.loads(wait_for_http(url, 5.0))
    assert answer["status"] == "success"
    return answer["data"]["result"]


def test_a_real_prometheus_scrapes_and_its_alert_fires_and_ends(source, prometheus):
    port = free_port()
    node = source.domain.start_node(EXPORTER, {"port": port})
    node.wait_for(f"metrics at http://127.0.0.1:{port}/metrics")
    source.ready()
    source.tell_all()
    address = prometheus(port)

    def value(expression):
        rows = query(address, expression)
        return float(rows[0]["value"][1]) if rows else None

    source.until(lambda: value('gearsim_feature{name="rms", channel="b3_y"}') == 3.5)
    assert value("gearsim_alarm_level") == 2
    assert value("gearsim_trend_hours_to_limit") == 1.0
    assert value('up{job="gearsim"}') == 1

    def firing():
        answer = json.loads(wait_for_http(f"{address}/api/v1/alerts", 5.0))
        return {a["labels"]["alertname"]: a for a in answer["data"]["alerts"] if a["state"] == "firing"}

    source.until(lambda: "GearsimFaultError" in firing())
    alert = firing()["GearsimFaultError"]
    assert alert["annotations"]["summary"] == "rig: outer_race bearing_3"
    assert ALARM.reason.strip() in alert["annotations"]["description"]
    source.tell_all(Level.OK)
    source.until(lambda: "GearsimFaultError" not in firing())
    # every expression of the dashboard is understood, and all but those of rare events find something
    empty = set()
    for expression in expressions():
        if not query(address, expression):
            empty.add(expression)
    assert len(empty) <= 1, empty  # the table of alarms: there is none now
    clean_end(node)


def expressions():
    """All expressions of the dashboard, with its variables filled in."""
    board = json.loads(read_file("grafana_dashboard.json"))
    found = [target["expr"] for panel in board["panels"] for target in panel["targets"]]
    found += [entry["expr"] for entry in board["annotations"]["list"]]
    return [re.sub(r"\$(machine|source|channel|name)\b", ".*", text) for text in found]


def test_the_exporter_listens_where_it_was_told_and_nowhere_else(source):
    node = source.domain.start_node(EXPORTER, {"port": 0})
    line = node.wait_for("metrics at http://127.0.0.1:")
    url = line.split("metrics at ")[1].strip()
    assert "gearsim_series_left_out_total 0.0" in wait_for_http(url)
    port = int(url.rsplit(":", 1)[1].split("/")[0])
    others = [a[4][0] for a in socket.getaddrinfo(socket.gethostname(), port, socket.AF_INET)]
    for other in {a for a in others if not a.startswith("127.")}:
        with pytest.raises(OSError, match=r"refused|unreachable|timed out"):
            socket.create_connection((other, port), 2.0)
    taken = source.domain.start_node(EXPORTER, {"port": port})
    assert taken.wait() == 2
    assert f"host, port: got 127.0.0.1:{port}, expected an address that can be listened on" in taken.output
    clean_end(node)


def test_promtool_accepts_the_rules_and_they_do_what_they_say(tmp_path):
    _, env = program("prometheus", PROMETHEUS)
    promtool, env = program("promtool", PROMETHEUS)
    write_files(tmp_path)
    stem = 'machine="rig", source="envelope", component="b", fault="f", channel="c", alarm="a"'

    def series(name, values, labels=stem):
        return {"series": f"{name}{{{labels}}}", "values": values}

    def expect(at, rule, *labels):
        found = [{"exp_labels": dict(one)} for one in labels]
        return {"eval_time": at, "alertname": rule, "exp_alerts": found}

    alarm = {
        "machine": "rig",
        "source": "envelope",
        "component": "b",
        "fault": "f",
        "channel": "c",
        "alarm": "a",
    }
    node = {"machine": "rig", "source": "gear"}
    content = {
        "rule_files": ["alerts.yml"],
        "evaluation_interval": "10s",
        "tests": [
            {
                "interval": "10s",
                "input_series": [
                    series("gearsim_alarm_level", "0 1 2 2 2 0"),
                    series("gearsim_alarm_acknowledged", "0 0 0 0 1 0"),
                    series("gearsim_alarm_present", "0 1 1 1 1 0"),
                    series("gearsim_alarm_state_stale", "1x13 0x30", 'machine="rig", source="gear"'),
                    series("gearsim_diagnostic_level", "2x4", 'name="envelope: stream", hardware_id="rig"'),
                    series("gearsim_diagnostic_level", "2x4", 'name="envelope: alarms", hardware_id="rig"'),
                    series("up", "0x4", 'job="gearsim", instance="here"'),
                ],
                "alert_rule_test": [
                    expect("0s", "GearsimFaultError"),
                    expect("10s", "GearsimFaultWarning", alarm | {"severity": "warning"}),
                    expect("20s", "GearsimFaultError", alarm | {"severity": "critical"}),
                    expect("40s", "GearsimFaultError"),  # acknowledged
                    expect("60s", "GearsimNotJudging"),  # not yet for two minutes
                    expect("130s", "GearsimNotJudging", node | {"severity": "warning"}),
                    expect("200s", "GearsimNotJudging"),
                    expect(
                        "20s",
                        "GearsimNodeError",
                        {"name": "envelope: stream", "hardware_id": "rig", "severity": "critical"},
                    ),
                    expect(
                        "30s",
                        "GearsimExporterDown",
                        {"job": "gearsim", "instance": "here", "severity": "critical"},
                    ),
                ],
            }
        ],
    }
    for test in content["tests"][0]["alert_rule_test"]:
        for alert in test["exp_alerts"]:
            alert["exp_annotations"] = annotations(test["alertname"], alert["exp_labels"])
    (tmp_path / "test.yml").write_text(json.dumps(content))
    for words in (
        ["check", "rules", "alerts.yml"],
        ["check", "config", "prometheus.yml"],
        ["test", "rules", "test.yml"],
    ):
        done = subprocess.run(
            [promtool, *words], cwd=tmp_path, env=env, capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr


def annotations(rule, labels):
    """What the rules' templates make of these labels where no reason is known."""
    if rule.startswith("GearsimFault"):
        return {"summary": "rig: f b", "description": " (seen by envelope on c)"}
    return {
        "GearsimNotJudging": {"summary": "rig: gear cannot judge (no samples, no nameplate, or no baseline)"},
        "GearsimNodeError": {"summary": f"{labels.get('name')} reports an error on /diagnostics"},
        "GearsimExporterDown": {"summary": "The exporter of the rig does not answer at here"},
    }[rule]


def test_the_dashboard_uses_only_metrics_that_there_are():
    from prometheus_client import CollectorRegistry, generate_latest

    from gearsim_bringup.monitoring.metrics import RigMetrics

    metrics = RigMetrics(time.monotonic)
    registry = CollectorRegistry()
    registry.register(metrics)
    known = set(re.findall(r"^# TYPE (\w+)", generate_latest(registry).decode(), re.MULTILINE))
    text = read_file("grafana_dashboard.json") + read_file("alerts.yml")
    used = set(re.findall(r"gearsim_[a-z_]+", text))
    assert used
    assert used <= known, used - known
    board = json.loads(read_file("grafana_dashboard.json"))
    assert len({panel["id"] for panel in board["panels"]}) == len(board["panels"]) >= 8
    assert set(FILES) >= {
        "alerts.yml",
        "prometheus.yml",
        "grafana_dashboard.json",
        "diagnostic_aggregator.yaml",
    }


# MQTT


@pytest.fixture
def broker(tmp_path, ros_domain):
    """`start()` runs a real mosquitto on loopback; `start.port` is where."""
    binary, env = program("mosquitto", MOSQUITTO)
    port = free_port()
    settings = tmp_path / "mosquitto.conf"
    settings.write_text(f"listener {port} 127.0.0.1\nallow_anonymous true\nuser root\n")

    class Start:
        def __init__(self):
            self.port = port

        def __call__(self):
            kept = dict(ros_domain.env)
            ros_domain.env.update({"LD_LIBRARY_PATH": env.get("LD_LIBRARY_PATH", "")})
            process = ros_domain.start(str(binary), "-c", str(settings), name="mosquitto")
            ros_domain.env.clear()
            ros_domain.env.update(kept)
            deadline = time.monotonic() + 20
            while True:
                try:
                    socket.create_connection(("127.0.0.1", port), 1.0).close()
                    return process
                except OSError:
                    assert time.monotonic() < deadline, process.output
                    time.sleep(0.1)

    return Start()


class Reader:
    """A client of the broker that keeps what it gets."""

    def __init__(self, port, topic="gearsim/#"):
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        self.got: queue.Queue[tuple[str, str, bool]] = queue.Queue()
        self.client = Client(CallbackAPIVersion.VERSION2)
        self.client.on_connect = lambda client, *_: client.subscribe(topic, 1)
        self.client.on_message = lambda _c, _d, m: self.got.put((m.topic, m.payload.decode(), m.retain))
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()

    def all(self, source, count):
        """At least `count` topics with their latest payload."""
        found = {}

        def enough():
            while not self.got.empty():
                topic, payload, retain = self.got.get_nowait()
                found[topic] = (payload, retain)
            return len(found) >= count

        source.until(enough)
        return found

    def close(self):
        self.client.disconnect()
        self.client.loop_stop()


def test_a_real_broker_gets_features_and_alarms_and_keeps_the_latest_of_each_alarm(source, broker):
    broker()
    node = source.domain.start_node(MQTT, {"port": broker.port})
    node.wait_for(f"broker 127.0.0.1:{broker.port}: connected")
    source.ready()
    reader = Reader(broker.port)
    reader.all(source, 1)  # the status: subscribed
    source.tell_all()
    found = reader.all(source, 4)
    assert json.loads(found["gearsim/rig/features/kurtosis/b3_y"][0])["values"][0]["value"] == 3.5
    alarm = json.loads(found["gearsim/rig/alarm/envelope/bearing_3/outer_race"][0])
    assert (alarm["level"], alarm["reason"]) == ("ERROR", ALARM.reason)
    assert json.loads(found["gearsim/rig/trends/trend"][0])["values"][0]["direction"] == "rising"
    reader.close()
    # who comes later gets what is kept: states, not figures
    late = Reader(broker.port)
    found = late.all(source, 3)
    assert {topic: retain for topic, (_, retain) in found.items()} == {
        "gearsim/status": True,
        "gearsim/rig/alarm/envelope/bearing_3/outer_race": True,
        "gearsim/rig/state/envelope": True,
    }
    source.until(lambda: source.status("mqtt: broker")[:2] == (0, f"127.0.0.1:{broker.port}: connected"))
    # when it dies the broker says so; when it ends it says so itself
    node.kill()
    source.until(lambda: late.got.qsize() > 0)
    assert late.all(source, 1)["gearsim/status"][0] == "offline"
    node = source.domain.start_node(MQTT, {"port": broker.port})
    source.until(lambda: late.got.qsize() > 0)
    assert late.all(source, 1)["gearsim/status"][0] == "online"
    clean_end(node)
    source.until(lambda: late.got.qsize() > 0)
    assert late.all(source, 1)["gearsim/status"][0] == "offline"
    late.close()


def test_alarms_wait_for_a_broker_that_comes_later(source, broker):
    node = source.domain.start_node(MQTT, {"port": broker.port})
    node.wait_for("nobody answers there")
    source.ready()
    source.until(lambda: source.status("mqtt: broker")[0] == 1)
    source.tell_all()
    source.until(
        lambda: source.status("mqtt: broker")[2].get("messages dropped") == "2"
    )  # the two without qos
    broker()
    reader = Reader(broker.port)
    found = reader.all(source, 3)
    assert "gearsim/rig/alarm/envelope/bearing_3/outer_race" in found
    reader.close()
    clean_end(node)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"prefix": "a/#"}, "prefix: got a/#, expected levels with '/' between"),
        ({"username": "u", "password_file": "/nowhere"}, "password_file: got /nowhere"),
        ({"tls": True, "ca_file": "/nowhere"}, "ca_file: got /nowhere"),
    ],
)
def test_bad_parameters_of_the_mqtt_node_end_it_with_one_line(ros_domain, parameters, words):
    node = ros_domain.start_node(MQTT, parameters)
    assert node.wait() == 2
    assert words in node.output
