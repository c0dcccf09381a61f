"""Bags: written here, read by others and by us; damage is found, a full disk costs little."""

from __future__ import annotations

import errno
import hashlib
import io
import os
import shutil
import signal
import subprocess
import sys
import textwrap

import numpy as np
import pytest
from recordings import flip_byte, make_record, write_bag
from ruamel.yaml import YAML

from gearsim_io import definitions, qos
from gearsim_io.bags import (
    BagError,
    BagWriter,
    StreamWriter,
    decode,
    info,
    read_bag,
    read_machine,
    read_objects,
    topics_of,
)
from gearsim_io.errors import InputError
from gearsim_io.machines import load_machine
from gearsim_io.messages import pure_types, to_msg

ACCEL, TACHO, ENCODER = "/gearsim/accel", "/gearsim/tacho", "/gearsim/encoder"
MACHINE = "/gearsim/machine_info"


@pytest.fixture(scope="module")
def record():
    return make_record()


@pytest.fixture(scope="module")
def bag(record, tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp("bags") / "good", record)


def mcap_of(bag):
    return bag / f"{bag.name}_0.mcap"


def copy(bag, tmp_path):
    target = tmp_path / "copy"
    shutil.copytree(bag, target)
    return target, target / f"{bag.name}_0.mcap"


def test_what_was_written_comes_back_bit_by_bit(bag, record):
    batches = [b for b in read_objects(bag) if not hasattr(b, "bearings")]
    expected = list(record.batches(512))
    assert len(batches) == len(expected)
    for got, want in zip(batches, expected, strict=True):
        assert type(got) is type(want)
        assert got.first_sample == want.first_sample
        assert got.t0_ns == want.t0_ns
        values = {"SampleBatch": "data", "TachoBatch": "pulse_offsets", "EncoderBatch": "edge_offsets"}
        name = values[type(got).__name__]
        assert getattr(got, name).tobytes() == getattr(want, name).tobytes()
    assert read_machine(bag).bearings == load_machine("unsw_parallel").bearings


def test_rosbags_reads_it(bag, record):
    from rosbags.rosbag2 import Reader

    store = definitions.typestore()
    with Reader(bag) as reader:
        counts = {connection.topic: connection.msgcount for connection in reader.connections}
        assert counts == {ACCEL: 16, TACHO: 16, ENCODER: 16, MACHINE: 1}
        assert reader.message_count == 49
        blocks = []
        for connection, _, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            if connection.topic == ACCEL:
                blocks.append(message.data.reshape(2, -1))
        for connection in reader.connections:
            assert connection.digest == definitions.definition(connection.msgtype).type_hash
            latched = connection.ext.offered_qos_profiles[0].durability.name == "TRANSIENT_LOCAL"
            assert latched == (connection.topic == MACHINE)
    assert np.array_equal(np.concatenate(blocks, axis=1), record.data)


def test_mcap_ros2_support_reads_it(bag, record):
    """Foxglove's decoder takes the types from the schemas in the file alone."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with open(mcap_of(bag), "rb") as stream:
        reader = make_reader(stream, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        blocks, seen = [], set()
        for _, channel, _, message in reader.iter_decoded_messages():
            seen.add(channel.topic)
            if channel.topic == ACCEL:
                assert list(message.channel_names) == ["b3_x", "b3_y"]
                blocks.append(np.asarray(message.data, dtype=np.float32).reshape(2, -1))
        assert seen == {ACCEL, TACHO, ENCODER, MACHINE}
    assert np.array_equal(np.concatenate(blocks, axis=1), record.data)


def test_layout_of_rosbag2(bag):
    from mcap.reader import make_reader

    content = YAML(typ="safe").load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["version"] == 9
    assert content["storage_identifier"] == "mcap"
    assert content["relative_file_paths"] == ["good_0.mcap"]
    assert content["message_count"] == 49
    assert content["files"][0]["message_count"] == 49
    assert content["custom_data"] == {"scenario": "test", "seed": "1"}
    topic = next(t for t in content["topics_with_message_count"] if t["topic_metadata"]["name"] == MACHINE)
    profile = topic["topic_metadata"]["offered_qos_profiles"][0]
    assert profile["durability"] == "transient_local"
    assert profile["deadline"] == {"sec": 9223372036, "nsec": 854775807}
    with open(mcap_of(bag), "rb") as stream:
        reader = make_reader(stream)
        records = {m.name: m.metadata for m in reader.iter_metadata()}
        summary = reader.get_summary()
    inside = YAML(typ="safe").load(records["rosbag2"]["serialized_metadata"])
    assert inside["rosbag2_bagfile_information"] == content
    assert records["gearsim_io"] == {"scenario": "test", "seed": "1"}
    for channel in summary.channels.values():
        assert channel.message_encoding == "cdr"
        schema = summary.schemas[channel.schema_id]
        assert schema.encoding == "ros2msg"
        assert channel.metadata["topic_type_hash"] == definitions.definition(schema.name).type_hash
        inside_channel = YAML(typ="safe").load(channel.metadata["offered_qos_profiles"])
        listed = next(
            t["topic_metadata"]["offered_qos_profiles"]
            for t in content["topics_with_message_count"]
            if t["topic_metadata"]["name"] == channel.topic
        )
        assert inside_channel == listed, "rosbags reads nothing if these differ"


def test_we_read_what_rosbags_writes(tmp_path, record):
    """A bag by another hand, compressed and without our metadata."""
    from rosbags.rosbag2 import Writer
    from rosbags.rosbag2.enums import CompressionFormat, CompressionMode, StoragePlugin

    store = definitions.typestore()
    writer = Writer(tmp_path / "foreign", version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection(ACCEL, qos.ACCEL.type, typestore=store)
        for batch in record.batches(512):
            if hasattr(batch, "data"):
                message = to_msg(batch, pure_types())
                writer.write(connection, batch.t0_ns, store.serialize_cdr(message, qos.ACCEL.type))
    data = np.concatenate([b.data for b in read_objects(tmp_path / "foreign")], axis=1)
    assert np.array_equal(data, record.data)
    assert info(tmp_path / "foreign").problem == ""


def test_info_tells_what_is_there(bag):
    found = info(bag)
    assert found.problem == ""
    assert found.totals.counts == {ACCEL: 16, TACHO: 16, ENCODER: 16, MACHINE: 1}
    assert found.seconds == pytest.approx(2.0)
    assert found.custom_data == {"scenario": "test", "seed": "1"}
    assert found.to_json()["sound"] is True
    assert topics_of(bag).keys() == found.topics.keys()


def test_only_the_wanted_topics(bag):
    assert {m.topic for m in read_bag(bag, (TACHO,))} == {TACHO}


def test_a_taken_folder_is_refused_and_left_alone(bag):
    before = hashlib.sha256(mcap_of(bag).read_bytes()).hexdigest()
    with pytest.raises(InputError, match="a folder that exists already, expected the name of a new bag"):
        BagWriter(bag)
    assert hashlib.sha256(mcap_of(bag).read_bytes()).hexdigest() == before


def test_a_place_that_cannot_be_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="a place for a new bag"):
        BagWriter(tmp_path / "file" / "bag")


def test_one_topic_has_one_type(tmp_path):
    with BagWriter(tmp_path / "b") as writer:
        writer.add(qos.ACCEL)
        writer.add(qos.ACCEL)
        with pytest.raises(InputError, match="SampleBatch, as before"):
            writer.add_topic(ACCEL, qos.TACHO.type, (qos.WAVEFORM,))


def read_until_error(path):
    """What could be read, and the error that ended it."""
    got = []
    try:
        for message in read_bag(path):
            got.append(message)
    except InputError as error:
        return got, str(error)
    return got, ""


def test_flipped_bytes_are_found_wherever_they_are(bag, tmp_path):
    """A reader that trusts the file would hand out wrong samples."""
    size = mcap_of(bag).stat().st_size
    places = {0, 9, size - 1, size - 20, *(int(p) for p in np.random.default_rng(5).integers(0, size, 60))}
    original = list(read_bag(bag))
    for place in sorted(places):
        folder, file = copy(bag, tmp_path)
        flip_byte(file, place)
        got, error = read_until_error(folder)
        if error:
            assert str(file) in error, place
            assert "recover" in error or "profile" in error or "topic" in error, error
        else:
            # A header's free text (the library's name) has no checksum of its own and no meaning.
            assert got == original, place
            assert place < 60, place
        shutil.rmtree(folder)


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 0.999])
def test_cut_off_bags_give_what_is_before_and_one_line(bag, tmp_path, share):
    folder, file = copy(bag, tmp_path)
    os.truncate(file, int(share * file.stat().st_size))
    original = list(read_bag(bag))
    got, error = read_until_error(folder)
    assert got == original[: len(got)]
    assert "cut off" in error
    assert "./gearsim recover" in error
    assert "\n" not in error
    found = info(folder)
    assert "cut off" in found.problem
    assert found.totals.messages == len(got)


def nothing(path):
    assert not path.exists()


def an_sqlite_bag(path):
    path.mkdir()
    (path / "x.db3").write_bytes(b"SQLite")


def another_file(path):
    path.mkdir()
    (path / "x_0.mcap").write_text("no mcap here")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (nothing, "nothing there"),
        (lambda path: path.mkdir(), "an empty folder"),
        (an_sqlite_bag, "x.db3"),
        (lambda path: path.write_text("hello"), "a nameless file"),
        (another_file, "magic"),
    ],
)
def test_things_that_are_no_bag(tmp_path, make, words):
    path = tmp_path / "thing"
    make(path)
    with pytest.raises(InputError) as caught:
        list(read_bag(path))
    assert words in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_missing_or_broken_metadata_file_does_not_matter(bag, tmp_path):
    folder, _ = copy(bag, tmp_path)
    (folder / "metadata.yaml").write_text("nonsense: [")
    assert len(list(read_bag(folder))) == 49
    (folder / "metadata.yaml").unlink()
    assert len(list(read_bag(folder))) == 49


def foreign_type(tmp_path, type_name, type_hash, schema="float64 x\n"):
    """A bag whose channel says a type that is not ours."""
    from mcap.writer import Writer

    folder = tmp_path / "foreign"
    folder.mkdir()
    with open(folder / "foreign_0.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start("ros2", "test")
        number = writer.register_schema(type_name, "ros2msg", schema.encode())
        channel = writer.register_channel(ACCEL, "cdr", number, {"topic_type_hash": type_hash})
        writer.add_message(channel, 1, b"\x00\x01\x00\x00" + bytes(8), 1)
        writer.finish()
    return folder


def test_wrong_types_on_a_topic_are_told(tmp_path):
    folder = foreign_type(tmp_path, "gearsim_msgs/msg/SampleBatch", "RIHS01_" + "0" * 64)
    with pytest.raises(InputError, match=r"/gearsim/accel.*RIHS01_0000.*expected RIHS01_9374"):
        list(read_bag(folder))
    shutil.rmtree(folder)
    folder = foreign_type(tmp_path, "gearsim_msgs/msg/Gone", "")
    with pytest.raises(InputError, match="a type that this version of gearsim_msgs has"):
        list(read_bag(folder))


def test_bytes_that_are_no_message_are_told(tmp_path):
    folder = foreign_type(tmp_path, "gearsim_msgs/msg/SampleBatch", "")
    (message,) = read_bag(folder)
    with pytest.raises(
        InputError, match=r"topic /gearsim/accel.*a message of type gearsim_msgs/msg/SampleBatch"
    ):
        decode(message)


class FullDisk(io.FileIO):
    """A file on a disk with room for so many bytes."""

    def __init__(self, path, room):
        super().__init__(path, "wb")
        self.room = room

    def write(self, data):
        if self.tell() + len(data) > self.room:
            part = max(0, self.room - self.tell())
            if part:
                super().write(bytes(data)[:part])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data)


@pytest.mark.parametrize("room", [30_000, 41_234, 64_000])
def test_a_full_disk_costs_only_the_last_piece(tmp_path, monkeypatch, record, room):
    import builtins

    real = builtins.open
    monkeypatch.setattr(
        builtins,
        "open",
        lambda path, mode="r", *args, **more: (
            io.BufferedWriter(FullDisk(path, room))
            if str(path).endswith("full_0.mcap") and mode == "wb"
            else real(path, mode, *args, **more)
        ),
    )
    with pytest.raises(BagError) as caught:
        write_bag(tmp_path / "full", record)
    monkeypatch.undo()
    assert "No space left on device" in str(caught.value)
    assert "are kept and readable" in str(caught.value)
    check_prefix(tmp_path / "full", record, str(caught.value))


def check_prefix(path, record, told):
    """Everything up to the last flush is there, and others can read it."""
    from rosbags.rosbag2 import Reader

    found = info(path)
    assert found.problem == ""
    kept = found.totals.messages
    assert f"{kept} messages are kept" in told
    data = np.concatenate([b.data for b in read_objects(path) if hasattr(b, "data")], axis=1)
    assert data.shape[1] >= 512
    assert np.array_equal(data, record.data[:, : data.shape[1]])
    with Reader(path) as reader:
        assert sum(1 for _ in reader.messages()) == kept


def test_a_really_full_disk(tmp_path):
    """A small file system of its own, where that is allowed."""
    place = tmp_path / "small"
    place.mkdir()
    mount = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=128k", "tmpfs", str(place)], capture_output=True, check=False
    )
    if mount.returncode:
        pytest.skip("this user may not mount a small file system")
    try:
        big = make_record(seconds=20.0)
        with pytest.raises(BagError, match="No space left on device") as caught:
            write_bag(place / "bag", big)
        check_prefix(place / "bag", big, str(caught.value))
    finally:
        subprocess.run(["umount", str(place)], check=True)


def run_python(code, *arguments, check=True):
    """Run code in a process of its own that can import these tests' helpers."""
    here = os.path.dirname(os.path.dirname(__file__))
    head = f"import pathlib, sys\nsys.path.insert(0, {here!r})\nbag = pathlib.Path(sys.argv[1])\n"
    command = [sys.executable, "-c", head + textwrap.dedent(code), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=check)


def test_a_limit_on_file_size_counts_as_full(tmp_path):
    """EFBIG in a real process: one line, no traceback, a sound bag."""
    code = """
        import resource, signal
        from recordings import make_record, write_bag
        from gearsim_io.bags import BagError
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, 50_000))
        try:
            write_bag(bag, make_record())
        except BagError as error:
            print(error)
    """
    told = run_python(code, tmp_path / "bag").stdout
    assert "File too large" in told
    check_prefix(tmp_path / "bag", make_record(), told)


class Stop(KeyboardInterrupt):
    """Ctrl-C, told from a real one."""


def write_some(path, batches):
    with BagWriter(path) as writer:
        stream = StreamWriter(writer)
        for batch in batches:
            stream.write(batch)
        raise Stop


def test_ctrl_c_in_the_middle_leaves_a_sound_bag(tmp_path, record):
    with pytest.raises(Stop):
        write_some(tmp_path / "bag", list(record.batches(512))[:10])
    assert info(tmp_path / "bag").problem == ""
    assert info(tmp_path / "bag").totals.messages == 10


def test_ctrl_c_inside_the_writer_leaves_a_sound_bag(tmp_path, record, monkeypatch):
    real = os.fsync
    calls = []

    def interrupted(number):
        calls.append(number)
        if len(calls) == 4:
            raise KeyboardInterrupt
        real(number)

    monkeypatch.setattr("gearsim_io.bags.writer.os.fsync", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_bag(tmp_path / "bag", record)
    monkeypatch.undo()
    found = info(tmp_path / "bag")
    assert found.problem == ""
    assert 0 < found.totals.messages < 49


def test_a_closed_bag_takes_nothing(tmp_path):
    with BagWriter(tmp_path / "bag") as writer:
        writer.add(qos.ACCEL)
    with pytest.raises(BagError, match="is closed"):
        writer.write(ACCEL, 0, b"")


def test_killed_writer_loses_less_than_a_period(tmp_path):
    """SIGKILL at any time: all up to the last flush can be saved, by the messages' own time."""
    code = """
        import os, signal
        from recordings import make_record
        from gearsim_io.bags import BagWriter, StreamWriter
        stream = StreamWriter(BagWriter(bag, sync_period_s=0.2))
        for batch in make_record(seconds=8.0).batches(128):
            stream.write(batch)
            if batch.first_sample >= 7.0 * 4096:
                os.kill(os.getpid(), signal.SIGKILL)
    """
    done = run_python(code, tmp_path / "bag", check=False)
    assert done.returncode == -signal.SIGKILL
    found = info(tmp_path / "bag")
    assert "cut off" in found.problem
    lost_s = 7.0 - found.seconds
    assert 0.0 <= lost_s < 0.25 + 128 / 4096
