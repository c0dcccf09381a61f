"""All diagnostic nodes in one live graph, with the exporter beside them and everything recorded."""

from __future__ import annotations

import socket
import threading
import urllib.request

import pytest

from gearsim_bringup.live import LiveRun, simulator
from gearsim_bringup.monitoring.choice import ALL_MONITORS, Choice
from gearsim_io import qos
from gearsim_io.bags import read_bag

pytestmark = pytest.mark.graph


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_all_nodes_judge_one_rig_and_what_they_say_is_recorded_and_served(ros_domain, tmp_path):
    assert ros_domain
    port, pages, over = free_port(), [], threading.Event()
    choice = Choice(ALL_MONITORS, "error", ("127.0.0.1", port), baselines=str(tmp_path / "baselines"))

    def scrape():
        while not over.wait(0.5):
            try:
                with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=5) as answer:
                    pages.append(answer.read().decode())
            except OSError:
                continue

    source = simulator("quick", end_after=9.0, rate=1.0, listeners=choice.listeners + 1)
    run = LiveRun(source, tmp_path / "log", tmp_path / "bag", choice=choice)
    watcher = threading.Thread(target=scrape, daemon=True)
    try:
        outcome = run.run(on_start=lambda _: watcher.start())
    finally:
        over.set()
    assert {alarm.source for _, alarm in outcome.seen.alarms} >= {"envelope"}
    topics = {message.topic for message in read_bag(tmp_path / "bag")}
    assert {qos.TRENDS.full_name, qos.FEATURES.full_name} <= topics
    assert {qos.ALARM_STATE.of(name).full_name for name in ALL_MONITORS} <= topics
    told = "\n".join(pages)
    for name in ALL_MONITORS:
        assert f'gearsim_diagnostic_level{{hardware_id="unsw_parallel",name="{name}: alarms"}}' in told
    assert 'gearsim_alarm_level{alarm="envelope/bearing_3/outer_race"' in told
    assert 'source="gear"' in told
