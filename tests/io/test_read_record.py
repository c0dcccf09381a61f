"""From a bag to one record: gaps, restarts and incomplete angle signals are seen, never glossed over."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from recordings import make_record, objects_of, write_bag

from gearsim_io import definitions, qos
from gearsim_io.bags import BagWriter, StreamWriter, read_record
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch
from gearsim_io.errors import InputError
from gearsim_io.messages import pure_types, to_msg


@pytest.fixture
def record():
    return make_record(seconds=2.0)


def bag_of(path, batches):
    with BagWriter(path) as writer:
        stream = StreamWriter(writer)
        for batch in batches:
            stream.write(batch)
    return path


def same_angle(got, want, first=0, end=None):
    end = np.inf if end is None else end
    inside = want.samples[(want.samples >= first) & (want.samples < end)] - first
    assert np.allclose(got.samples, inside, rtol=0, atol=1e-9)


def test_a_whole_record_comes_back(tmp_path, record):
    back = read_record(write_bag(tmp_path / "bag", record))
    assert back.data.tobytes() == record.data.tobytes()
    assert (back.sample_rate_hz, back.channels, back.unit) == (4096.0, record.channels, "m/s^2")
    assert (back.t0_ns, back.first_sample, back.machine) == (record.t0_ns, 0, "unsw_parallel")
    same_angle(back.tachos[0], record.tachos[0])
    same_angle(back.encoders[0], record.encoders[0])
    assert back.encoders[0].first_edge == record.encoders[0].first_edge
    assert back.notes == {}


@pytest.mark.parametrize("size", [512, 100, 8192])
def test_batch_size_does_not_matter(tmp_path, record, size):
    back = read_record(write_bag(tmp_path / "bag", record, size=size))
    assert back.data.tobytes() == record.data.tobytes()
    same_angle(back.tachos[0], record.tachos[0])


def test_a_gap_leaves_the_longest_stretch(tmp_path, record):
    batches = [b for b in objects_of(record) if not (isinstance(b, SampleBatch) and b.first_sample == 2048)]
    back = read_record(bag_of(tmp_path / "bag", batches))
    assert back.first_sample == 2560
    assert np.array_equal(back.data, record.data[:, 2560:])
    assert "1 gaps" in back.notes["gaps"]
    assert back.t0_ns == record.t0_ns + round(2560 / 4096 * 1e9)
    same_angle(back.tachos[0], record.tachos[0], first=2560)
    same_angle(back.encoders[0], record.encoders[0], first=2560)
    skipped = np.count_nonzero(record.encoders[0].samples < 2560)
    assert back.encoders[0].first_edge == record.encoders[0].first_edge + skipped


@pytest.mark.parametrize("kind", [TachoBatch, EncoderBatch])
def test_an_angle_signal_with_a_hole_is_not_used(tmp_path, record, kind):
    batches = [b for b in objects_of(record) if not (isinstance(b, kind) and b.first_sample == 1024)]
    back = read_record(bag_of(tmp_path / "bag", batches))
    assert back.data.shape == record.data.shape
    assert len(back.tachos) == (0 if kind is TachoBatch else 1)
    assert len(back.encoders) == (0 if kind is EncoderBatch else 1)
    assert back.notes["angle signal of input"] == "incomplete, not used"


def test_pulses_that_were_dropped_are_found_by_their_number(tmp_path, record):
    def drop(batch):
        if isinstance(batch, TachoBatch) and batch.first_sample == 1024:
            return dataclasses.replace(batch, pulse_offsets=batch.pulse_offsets[:0])
        return batch

    back = read_record(bag_of(tmp_path / "bag", map(drop, objects_of(record))))
    assert back.tachos == ()


def test_a_replay_in_a_loop_is_one_record(tmp_path, record):
    """Indices begin again; the angle signals of both rounds must not be mixed."""
    back = read_record(bag_of(tmp_path / "bag", objects_of(record) * 2))
    assert back.data.tobytes() == record.data.tobytes()
    same_angle(back.tachos[0], record.tachos[0])
    assert "1 gaps" in back.notes["gaps"]


def test_another_run_after_a_restart_is_kept_apart(tmp_path, record):
    other = make_record(seconds=3.0, seed=2, shaft_hz=7.0, t0_ns=record.t0_ns + 60 * 10**9)
    for k, runs in enumerate(((record, other), (other, record))):
        back = read_record(bag_of(tmp_path / f"bag{k}", [b for run in runs for b in objects_of(run)]))
        assert back.data.tobytes() == other.data.tobytes()
        same_angle(back.tachos[0], other.tachos[0])


def test_several_streams_need_a_choice(tmp_path, record):
    path = tmp_path / "bag"
    with BagWriter(path) as writer:
        for name in ("/a/accel", "/b/accel"):
            writer.add_topic(name, qos.ACCEL.type, (qos.WAVEFORM,))
            for batch in objects_of(record):
                if isinstance(batch, SampleBatch):
                    message = to_msg(batch, pure_types())
                    raw = definitions.typestore().serialize_cdr(message, qos.ACCEL.type)
                    writer.write(name, batch.t0_ns, bytes(raw))
    with pytest.raises(InputError, match=r"/a/accel, /b/accel.*exactly one"):
        read_record(path)
    assert read_record(path, topic="/b/accel").sample_count == record.sample_count
    with pytest.raises(InputError, match="topic: got /c"):
        read_record(path, topic="/c")


def test_a_stream_that_changes_is_refused(tmp_path, record):
    batches = objects_of(record)
    last = next(b for b in reversed(batches) if isinstance(b, SampleBatch))
    changed = [
        (dataclasses.replace(last, sample_rate_hz=8192.0), "sample_rate_hz: got 8192 Hz, expected 4096.0"),
        (dataclasses.replace(last, channels=("x", "y")), "channels"),
        (dataclasses.replace(last, unit="g"), "unit: got g, expected m/s^2"),
    ]
    for k, (batch, words) in enumerate(changed):
        path = bag_of(tmp_path / f"bag{k}", [b for b in batches if b is not last] + [batch])
        with pytest.raises(InputError) as caught:
            read_record(path)
        assert words in str(caught.value)


def test_a_bag_without_samples_is_told(tmp_path, record):
    tachos = [b for b in objects_of(record) if isinstance(b, TachoBatch)]
    with pytest.raises(InputError, match="topics of type SampleBatch: got none"):
        read_record(bag_of(tmp_path / "bag", tachos))
