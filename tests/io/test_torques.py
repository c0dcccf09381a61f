"""Torque on its own topic: in bags and out of them, beside the accelerometers, and in the view."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from recordings import make_record, objects_of, write_bag

from gearsim_io import qos, rerun_export
from gearsim_io.bags import BagWriter, StreamWriter, read_bag, read_objects, read_record, topics_of
from gearsim_io.batches import SampleBatch, TorqueBatch
from gearsim_io.record import Torques
from gearsim_io.scene import look_through


@pytest.fixture
def record():
    plain = make_record(seconds=2.0)
    torque = 50 + np.random.default_rng(3).standard_normal((1, plain.sample_count)).astype(np.float32)
    return dataclasses.replace(plain, torques=Torques(("input_torque",), torque))


def _bag(path, batches):
    with BagWriter(path) as writer:
        stream = StreamWriter(writer)
        for batch in batches:
            stream.write(batch)
    return path


def test_torque_lies_on_its_own_topic_and_comes_back(tmp_path, record):
    bag = write_bag(tmp_path / "bag", record)
    topics = topics_of(bag)
    assert topics[qos.TORQUE.full_name].type == topics[qos.ACCEL.full_name].type
    kept = list(read_bag(bag, (qos.TORQUE.full_name,)))
    assert len(kept) == 16
    back = read_record(bag)
    assert back.data.tobytes() == record.data.tobytes()
    assert back.channels == record.channels
    assert back.unit == "m/s^2"
    assert back.torques.channels == ("input_torque",)
    np.testing.assert_array_equal(back.torques.data_nm, record.torques.data_nm)
    assert back.notes == {}


def test_objects_of_a_bag_tell_torques_from_samples(tmp_path, record):
    found = list(read_objects(write_bag(tmp_path / "bag", record)))
    torques = [batch for batch in found if isinstance(batch, TorqueBatch)]
    samples = [batch for batch in found if isinstance(batch, SampleBatch)]
    assert {batch.unit for batch in torques} == {"N*m"}
    assert {batch.unit for batch in samples} == {"m/s^2"}
    assert torques[3].first_sample == samples[3].first_sample == 1536


def test_the_torque_of_a_stretch_without_gaps(tmp_path, record):
    batches = [b for b in objects_of(record) if not (isinstance(b, SampleBatch) and b.first_sample == 2048)]
    back = read_record(_bag(tmp_path / "bag", batches))
    assert back.first_sample == 2560
    np.testing.assert_array_equal(back.torques.data_nm, record.torques.data_nm[:, 2560:])


def test_batches_of_another_size_are_cut_to_the_stretch(tmp_path, record):
    samples = [b for b in objects_of(record) if isinstance(b, SampleBatch) and b.first_sample != 2048]
    torques = [b for b in objects_of(record, 700) if isinstance(b, TorqueBatch)]
    back = read_record(_bag(tmp_path / "bag", samples + torques))
    assert back.first_sample == 2560
    np.testing.assert_array_equal(back.torques.data_nm, record.torques.data_nm[:, 2560:])


def test_a_torque_with_a_hole_is_left_out_and_noted(tmp_path, record):
    batches = [b for b in objects_of(record) if not (isinstance(b, TorqueBatch) and b.first_sample == 2048)]
    back = read_record(_bag(tmp_path / "bag", batches))
    assert back.torques is None
    assert back.notes["torque"] == "incomplete, not used"
    assert back.sample_count == record.sample_count


def test_a_topic_of_torques_can_be_chosen_by_name(tmp_path, record):
    back = read_record(write_bag(tmp_path / "bag", record), topic=qos.TORQUE.full_name)
    assert (back.channels, back.unit) == (("input_torque",), "N*m")
    np.testing.assert_array_equal(back.data, record.torques.data_nm)


def test_the_view_draws_the_torque_beside_the_load(tmp_path, record):
    bag = write_bag(tmp_path / "bag", record)
    overview = look_through(bag)
    assert overview.channels == record.channels
    assert overview.unit == "m/s^2"
    assert overview.lost_samples == 0
    assert "torque" in overview.focus().kinds
    out = tmp_path / "x.rrd"
    rerun_export.export(bag, out)
    content = out.read_bytes()
    assert b"/load/input_torque" in content
    assert b"/accel/input_torque" not in content
