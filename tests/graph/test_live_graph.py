"""The whole graph as real processes: live, recorded, replayed, recorded again."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from gearsim_bringup.live import MONITORS, LiveRun, player, simulator
from gearsim_io import qos
from gearsim_io.bags import read_bag
from gearsim_io.errors import InputError

pytestmark = pytest.mark.graph
SECONDS = 5.0
SIGNALS = [topic.full_name for topic in (qos.ACCEL, qos.TACHO, qos.ENCODER, qos.MACHINE_INFO)]


def messages(bag, topic):
    return [message.data for message in read_bag(bag, (topic,))]


@pytest.fixture
def live(ros_domain, tmp_path):
    """A live run of the quick scenario: what the command line saw, and the bag."""
    assert ros_domain
    source = simulator("quick", end_after=SECONDS, rate=1.0, listeners=len(MONITORS) + 1)
    outcome = LiveRun(source, tmp_path / "log", tmp_path / "live").run()
    return outcome, tmp_path / "live"


def test_alarms_on_replay_equal_alarms_live_and_all_messages_are_the_same_bytes(live, tmp_path):
    outcome, bag = live
    alarms = messages(bag, qos.ALARM.full_name)
    assert len(alarms) == len(outcome.seen.alarms) > 0
    named = {(alarm.component, alarm.fault) for _, alarm in outcome.seen.alarms if alarm.source == "envelope"}
    assert named == {("bearing_3", "outer_race")}
    assert sum(len(data) for data in messages(bag, qos.ACCEL.full_name)) > 4 * 4 * SECONDS * 16384
    source = player(bag, rate=4.0, loop=False, listeners=len(MONITORS) + 1, signals_only=True)
    LiveRun(source, tmp_path / "log2", tmp_path / "again").run()
    for topic in SIGNALS:
        assert messages(tmp_path / "again", topic) == messages(bag, topic), topic
    # Which of two nodes speaks first at the same sample is the middleware's affair, what they say is not.
    assert sorted(messages(tmp_path / "again", qos.ALARM.full_name)) == sorted(alarms)


def test_run_ends_with_ctrl_c_and_leaves_a_sound_bag(ros_domain, tmp_path):
    bag = tmp_path / "bag"
    words = [sys.executable, "-m", "gearsim_bringup.cli", "run", "quick", "--record", str(bag)]
    process = subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ}, cwd=tmp_path
    )
    assert ros_domain
    assert process.stdout is not None
    for line in process.stdout:
        if "running at 10 Hz" in line:
            break
    time.sleep(2.0)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.strip() == "gearsim: interrupted"
    assert len(messages(bag, qos.ACCEL.full_name)) > 10


def test_record_ends_with_ctrl_c_and_leaves_a_sound_bag(ros_domain, tmp_path):
    assert ros_domain
    words = [sys.executable, "-m", "gearsim_bringup.cli", "record", "--out", "bag"]
    process = subprocess.Popen(
        words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, env={**os.environ}, cwd=tmp_path
    )
    assert process.stderr is not None
    for line in process.stderr:
        if "recording to" in line and "recorder" in line:  # the node itself, not yet the command
            break
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 130
    assert errors.splitlines()[-1] == "gearsim: interrupted"
    assert messages(tmp_path / "bag", qos.ACCEL.full_name) == []


def test_a_second_rig_in_the_same_domain_is_refused(ros_domain, tmp_path):
    first = ros_domain.start_node("gearsim_sim.nodes.simulator", {"scenario": "quick"})
    first.wait_for("scenario quick", timeout_s=200)  # it may have to compile first
    source = simulator("quick", end_after=20.0, rate=1.0, listeners=len(MONITORS) + 1)
    with pytest.raises(InputError, match="/gearsim/accel: publishers: got one already"):
        LiveRun(source, tmp_path / "log", tmp_path / "bag").run()
    assert not (tmp_path / "bag").exists()


def test_bad_parameters_of_a_node_are_passed_on_in_its_words(ros_domain, tmp_path):
    assert ros_domain
    source = simulator("no_such_scenario", end_after=1.0, rate=1.0, listeners=0)
    with pytest.raises(InputError, match="no_such_scenario"):
        LiveRun(source, tmp_path / "log").run()
