"""Recorder, player and viewer as real processes over DDS."""

from __future__ import annotations

import signal
import subprocess
import time

import numpy as np
import pytest
from recordings import make_record, objects_of, write_bag

from gearsim_io import definitions, qos
from gearsim_io.bags import BagWriter, StreamWriter, info, read_bag, read_record, recover
from gearsim_io.batches import SampleBatch
from gearsim_io.machines import load_machine
from gearsim_io.messages import from_msg, ros_types, to_msg

pytestmark = pytest.mark.graph

RECORDER = "gearsim_io.nodes.recorder"
PLAYER = "gearsim_io.nodes.player"
VIEWER = "gearsim_io.nodes.viewer"
TOPICS = {"SampleBatch": qos.ACCEL, "TachoBatch": qos.TACHO, "EncoderBatch": qos.ENCODER}


class Source:
    """A rig made by hand inside the test process."""

    def __init__(self, domain):
        self.domain = domain
        self.node = domain.node("source")
        self.types = ros_types()
        self.publishers = {
            name: qos.create_publisher(self.node, topic)
            for name, topic in {**TOPICS, "MachineInfo": qos.MACHINE_INFO}.items()
        }

    def wait_for_subscribers(self):
        found = self.domain.spin(
            self.node, lambda: all(p.get_subscription_count() for p in self.publishers.values())
        )
        assert found, "nobody subscribes"
        time.sleep(0.3)  # they must also learn of these publishers

    def send(self, obj, t_ns=0):
        message = to_msg(obj, self.types, t_ns)
        self.publishers[type(message).__name__].publish(message)
        return message


def start_recorder(domain, bag, **parameters):
    recorder = domain.start_node(RECORDER, {"bag": str(bag), **parameters})
    recorder.wait_for("recording to")
    return recorder


def signals(bag):
    """Bytes of the rig's signals by topic, in order."""
    found = {}
    for message in read_bag(bag):
        if message.topic.startswith("/gearsim/"):
            found.setdefault(message.topic, []).append(message.data)
    return found


def test_what_is_sent_is_recorded(ros_domain, tmp_path):
    record = make_record(seconds=2.0)
    recorder = start_recorder(ros_domain, tmp_path / "bag", custom_data='{"scenario": "demo", "seed": 7}')
    source = Source(ros_domain)
    source.wait_for_subscribers()
    source.send(load_machine("unsw_parallel"), record.t0_ns)
    for batch in objects_of(record):
        source.send(batch)
        time.sleep(0.005)
    assert recorder.stop(signal.SIGINT) == 0
    assert "0 samples lost in 0 gaps" in recorder.output
    found = info(tmp_path / "bag")
    assert found.problem == ""
    assert found.totals.counts[qos.ACCEL.full_name] == 16
    assert (found.custom_data["scenario"], found.custom_data["seed"]) == ("demo", "7")
    back = read_record(tmp_path / "bag")
    assert back.data.tobytes() == record.data.tobytes()
    assert np.allclose(back.tachos[0].samples, record.tachos[0].samples)
    check_hashes(source.node, found)
    check_rosbags(tmp_path / "bag")


def check_hashes(node, found):
    """The hash in the bag is the one that the endpoints of DDS show."""
    for topic in (qos.ACCEL, qos.TACHO, qos.ENCODER, qos.MACHINE_INFO):
        (endpoint,) = node.get_publishers_info_by_topic(topic.full_name)
        assert str(endpoint.topic_type_hash) == found.topics[topic.full_name].type_hash, topic.name


def check_rosbags(path):
    """Another library reads and decodes all that rclpy serialised."""
    from rosbags.rosbag2 import Reader

    store = definitions.typestore()
    with Reader(path) as reader:
        for connection, _, raw in reader.messages():
            assert store.deserialize_cdr(raw, connection.msgtype) is not None


def test_batches_without_a_pulse_survive_every_way(ros_domain, tmp_path):
    """An empty list of doubles at a message's end is where serialisers differ."""
    record = make_record(seconds=1.0, shaft_hz=2.0)
    recorder = start_recorder(ros_domain, tmp_path / "bag")
    source = Source(ros_domain)
    source.wait_for_subscribers()
    for batch in objects_of(record, 128):
        source.send(batch)
        time.sleep(0.002)
    assert recorder.stop() == 0
    back = read_record(tmp_path / "bag")
    assert np.allclose(back.tachos[0].samples, record.tachos[0].samples)
    check_rosbags(tmp_path / "bag")
    # And the bytes as recorded mean the same to rclpy when they are played.
    node = ros_domain.node("listener")
    got = []
    qos.create_subscription(node, qos.TACHO, lambda msg: got.append(from_msg(msg)))
    parameters = {"bag": str(tmp_path / "bag"), "rate": 5.0, "wait_for": ["tacho"]}
    player = ros_domain.start_node(PLAYER, parameters)
    assert ros_domain.spin(node, lambda: len(got) == 32), f"{len(got)} of 32\n{player.output}"
    assert player.wait() == 0
    total = np.concatenate([batch.first_sample + batch.pulse_offsets for batch in got])
    assert np.allclose(total, record.tachos[0].samples)
    assert any(batch.pulse_offsets.size == 0 for batch in got)


def test_record_play_record_is_byte_identical(ros_domain, tmp_path):
    first = write_bag(tmp_path / "first", make_record(seconds=3.0, rate_hz=16384.0), size=512)
    recorder = start_recorder(ros_domain, tmp_path / "second")
    player = ros_domain.start_node(PLAYER, {"bag": str(first), "rate": 2.0, "wait_for": ["*"]})
    assert player.wait(30.0) == 0, player.output
    assert recorder.stop(signal.SIGTERM) == 0
    assert signals(tmp_path / "second") == signals(first)
    # Once more, from the recorder's own bag.
    recorder = start_recorder(ros_domain, tmp_path / "third")
    parameters = {"bag": str(tmp_path / "second"), "rate": 2.0, "wait_for": ["*"], "signals_only": True}
    player = ros_domain.start_node(PLAYER, parameters)
    assert player.wait(30.0) == 0, player.output
    assert recorder.stop() == 0
    assert signals(tmp_path / "third") == signals(first)
    kept = {name: topic.qos for name, topic in info(tmp_path / "third").topics.items()}
    assert kept[qos.MACHINE_INFO.full_name][0].latched
    assert not kept[qos.ACCEL.full_name][0].latched


def test_a_killed_recorder_loses_less_than_half_a_second(ros_domain, tmp_path):
    recorder = start_recorder(ros_domain, tmp_path / "bag")
    source = Source(ros_domain)
    source.wait_for_subscribers()
    rate_hz, size = 65536.0, 4096
    # So little that no piece of the file fills up by itself in the last second: the timer must flush.
    data = np.random.default_rng(0).standard_normal((1, size)).astype(np.float32)
    names = ("c0",)
    start_s = time.monotonic()
    sent = 0
    while time.monotonic() - start_s < 2.5:
        due = int((time.monotonic() - start_s) * rate_hz / size)
        while sent < due:
            source.send(SampleBatch(0, rate_hz, sent * size, names, "m/s^2", data.copy()))
            sent += 1
        time.sleep(0.005)
    recorder.send_signal(signal.SIGKILL)
    assert recorder.wait() == -signal.SIGKILL
    assert "cut off" in info(tmp_path / "bag").problem
    recover(tmp_path / "bag", tmp_path / "saved")
    saved = read_record(tmp_path / "saved")
    assert saved.first_sample == 0
    assert saved.notes == {}
    lost_s = (sent * size - saved.sample_count) / rate_hz
    assert lost_s < 0.5
    assert np.array_equal(saved.data[:, -size:], data)


def test_a_full_disk_ends_the_recorder_with_one_line(ros_domain, tmp_path):
    place = tmp_path / "small"
    place.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", str(place)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("this user may not mount a small file system")
    try:
        recorder = start_recorder(ros_domain, place / "bag")
        source = Source(ros_domain)
        source.wait_for_subscribers()
        data = np.ones((8, 4096), np.float32)
        names = tuple(f"c{k}" for k in range(8))
        k = 0
        while recorder.returncode is None and k < 400:
            source.send(SampleBatch(0, 65536.0, k * 4096, names, "m/s^2", data.copy()))
            k += 1
            time.sleep(0.02)
        assert recorder.wait() == 1
        assert "Traceback" not in recorder.output
        told = [line for line in recorder.lines if "No space left on device" in line]
        assert len(told) == 1
        assert "are kept and readable" in told[0]
        found = info(place / "bag")
        assert found.problem == ""
        assert found.totals.counts[qos.ACCEL.full_name] >= 2
    finally:
        subprocess.run(["umount", str(place)], check=True)


@pytest.mark.parametrize(
    ("module", "parameters", "words"),
    [
        (RECORDER, {}, "bag: got nothing, expected the folder of a new bag"),
        (RECORDER, {"bag": "."}, "a folder that exists already"),
        (RECORDER, {"bag": "new", "sync_period_s": 5.0}, "sync_period_s"),
        (
            RECORDER,
            {"bag": "new", "custom_data": "no json"},
            "custom_data: got no json, expected a JSON object",
        ),
        (PLAYER, {}, "bag: got nothing, expected the folder of a bag"),
        (PLAYER, {"bag": "missing"}, "missing: got nothing there"),
        (PLAYER, {"bag": "missing", "rate": 0.0}, "from 0.01 to 100"),
        (VIEWER, {}, "out, connect, window: got none, expected at least one"),
        (VIEWER, {"out": "picture.png"}, "the name of a new .rrd file"),
    ],
)
def test_bad_parameters_are_one_line(ros_domain, tmp_path, monkeypatch, module, parameters, words):
    monkeypatch.chdir(tmp_path)
    process = ros_domain.start_node(module, parameters)
    assert process.wait() == 2, process.output
    (line,) = [line for line in process.lines if line.strip()]
    assert words in line


def test_a_damaged_bag_plays_to_the_damage_and_says_so(ros_domain, tmp_path):
    bag = write_bag(tmp_path / "bag", make_record(seconds=2.0))
    file = bag / "bag_0.mcap"
    with open(file, "r+b") as stream:
        stream.truncate(int(0.6 * file.stat().st_size))
    player = ros_domain.start_node(PLAYER, {"bag": str(bag), "rate": 20.0})
    assert player.wait() == 2, player.output
    (line,) = [line for line in player.lines if line.startswith("player:")]
    assert "cut off" in line
    assert "./gearsim recover" in line
    assert "Traceback" not in player.output


def test_a_second_ctrl_c_at_once_does_no_harm(ros_domain, tmp_path):
    """From a terminal it comes twice: from the terminal and from the parent process."""
    recorder = start_recorder(ros_domain, tmp_path / "bag")
    source = Source(ros_domain)
    source.wait_for_subscribers()
    for batch in objects_of(make_record()):
        source.send(batch)
    recorder.send_signal(signal.SIGINT)
    time.sleep(0.05)
    recorder.send_signal(signal.SIGTERM)
    assert recorder.wait() == 0, recorder.output
    found = info(tmp_path / "bag")
    assert found.problem == ""
    assert found.totals.counts[qos.ACCEL.full_name] == 16, "what was under way is taken"


def test_another_type_on_a_topic_is_told(ros_domain, tmp_path):
    from std_msgs.msg import String

    recorder = start_recorder(ros_domain, tmp_path / "bag")
    node = ros_domain.node("stranger")
    node.create_publisher(String, qos.ACCEL.full_name, 10)
    line = recorder.wait_for("std_msgs/msg/String is there too")
    assert qos.ACCEL.full_name in line
    assert "expected gearsim_msgs/msg/SampleBatch alone" in line
    assert recorder.stop() == 0


def test_a_slow_subscriber_is_found_by_the_sample_index(ros_domain, tmp_path):
    """DDS calls it reliable and says nothing; the index tells."""
    from gearsim_io import cdr

    bag = tmp_path / "bag"
    with BagWriter(bag, sync_period_s=None) as writer:
        stream = StreamWriter(writer)
        for batch in make_record(seconds=30.0).batches(512):
            if isinstance(batch, SampleBatch):
                stream.write(batch)
    node = ros_domain.node("sleeper")
    counter = cdr.GapCounter()
    got = []

    def slow(data):
        got.append(counter.add("accel", data, qos.ACCEL.type))
        if len(got) == 3:
            time.sleep(2.5)

    few = qos.Topic(qos.ACCEL.name, qos.ACCEL.type, qos.Qos(depth=5))
    qos.create_subscription(node, few, slow, raw=True)
    player = ros_domain.start_node(PLAYER, {"bag": str(bag), "rate": 15.0, "wait_for": ["accel"]})
    ros_domain.spin(node, lambda: player.returncode is not None)
    assert player.wait() == 0
    assert counter.gaps >= 1
    assert counter.lost_samples > 0
    assert counter.lost_samples == (240 - len(got)) * 512, "every sample is either received or counted"


def test_the_recorder_reports_gaps_on_diagnostics(ros_domain, tmp_path):
    recorder = start_recorder(ros_domain, tmp_path / "bag")
    source = Source(ros_domain)
    statuses = []
    qos.create_subscription(source.node, qos.DIAGNOSTICS, lambda msg: statuses.extend(msg.status))
    source.wait_for_subscribers()
    samples = [batch for batch in objects_of(make_record()) if isinstance(batch, SampleBatch)]
    for batch in samples[:4] + samples[7:]:
        source.send(batch)
        time.sleep(0.01)

    def warned():
        return any(s.level == b"\x01" and "1536 samples were lost in 1 gaps" in s.message for s in statuses)

    assert ros_domain.spin(source.node, warned), [s.message for s in statuses]
    (status, *_) = [s for s in statuses if s.level == b"\x01"]
    assert status.name == "recorder: recording"
    assert status.hardware_id
    assert {pair.key: pair.value for pair in status.values}["lost_samples"] == "1536"
    assert recorder.stop() == 0
    assert "1536 samples are missing" in recorder.output


def test_the_player_sends_clock_and_obeys_pause_and_rate(ros_domain, tmp_path):
    from rcl_interfaces.srv import SetParameters
    from rclpy.parameter import Parameter

    record = make_record(seconds=4.0)
    bag = write_bag(tmp_path / "bag", record)
    node = ros_domain.node("listener")
    clocks, batches = [], []
    qos.create_subscription(
        node, qos.CLOCK, lambda msg: clocks.append(msg.clock.sec * 10**9 + msg.clock.nanosec)
    )
    qos.create_subscription(node, qos.ACCEL, lambda msg: batches.append((time.monotonic(), from_msg(msg))))
    machines = []
    parameters = {"bag": str(bag), "paused": True, "wait_for": ["accel"], "loop": True}
    player = ros_domain.start_node(PLAYER, parameters)
    player.wait_for("playing")
    client = node.create_client(SetParameters, "/gearsim/player/set_parameters")
    assert client.wait_for_service(10.0)
    ros_domain.spin(node, lambda: False, 0.5)
    assert batches == [], "paused"

    def set_parameter(name, value):
        request = SetParameters.Request(parameters=[Parameter(name, value=value).to_parameter_msg()])
        future = client.call_async(request)
        assert ros_domain.spin(node, future.done)
        return future.result().results[0]

    assert not set_parameter("rate", 1e6).successful, "out of range"
    assert set_parameter("rate", 4.0).successful
    assert set_parameter("paused", False).successful
    assert ros_domain.spin(node, lambda: len(batches) >= 40), player.output
    qos.create_subscription(node, qos.MACHINE_INFO, machines.append)
    assert ros_domain.spin(node, lambda: bool(machines)), "latched for those who come late"
    # Four bag seconds take one: the 32 batches of one round at 8 per bag second.
    first_round = [t for t, batch in batches[:32]]
    assert first_round[-1] - first_round[0] == pytest.approx(31 / 32, abs=0.25)
    indices = [batch.first_sample for _, batch in batches[:40]]
    assert indices == [512 * (k % 32) for k in range(40)], "a loop begins again with index 0"
    inside = [t for t in clocks if t]
    assert min(inside) >= record.t0_ns
    assert max(inside) <= record.t0_ns + 4.3 * 10**9
    assert player.stop() == 0


def test_the_viewer_fills_a_sound_recording(ros_domain, tmp_path):
    from gearsim_io.rerun_export import viewer_path

    bag = write_bag(tmp_path / "bag", make_record(seconds=2.0))
    viewer = ros_domain.start_node(VIEWER, {"out": str(tmp_path / "live.rrd")})
    viewer.wait_for("showing the rig")
    wait_for = ["accel", "tacho", "machine_info"]
    player = ros_domain.start_node(PLAYER, {"bag": str(bag), "rate": 4.0, "wait_for": wait_for})
    assert player.wait() == 0
    assert viewer.stop() == 0, viewer.output
    tool = [str(viewer_path()), "rrd"]
    subprocess.run([*tool, "verify", str(tmp_path / "live.rrd")], check=True, capture_output=True)
    done = subprocess.run(
        [*tool, "stats", str(tmp_path / "live.rrd")], check=True, capture_output=True, text=True
    )
    for entity in ("/accel/b3_x", "/accel/b3_y", "/speed/input", "/summary"):
        assert f"{entity}:" in done.stdout
