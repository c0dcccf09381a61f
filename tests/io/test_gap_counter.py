"""Gaps are counted from serialised batches by their sample index."""

from __future__ import annotations

import pytest
from recordings import make_record, objects_of

from gearsim_io import cdr, definitions
from gearsim_io.batches import SampleBatch, TachoBatch
from gearsim_io.messages import pure_types, to_msg

NAMES = {SampleBatch: cdr.SAMPLE_BATCH, TachoBatch: cdr.TACHO_BATCH}


def raw(batch):
    name = NAMES.get(type(batch), cdr.ANGLE_BATCHES[1])
    return bytes(definitions.typestore().serialize_cdr(to_msg(batch, pure_types()), name)), name


def count(batches):
    counter = cdr.GapCounter()
    missing = [counter.add("/t", *raw(batch)) for batch in batches]
    return counter, missing


def test_a_whole_stream_has_no_gap():
    """Samples, tacho and encoder interleave on their own indices."""
    counter = cdr.GapCounter()
    for batch in objects_of(make_record()):
        data, name = raw(batch)
        assert counter.add(f"/{name}", data, name) == 0
    assert (counter.gaps, counter.lost_samples, counter.restarts) == (0, 0, 0)


def test_what_is_missing_is_counted():
    batches = [b for b in objects_of(make_record()) if isinstance(b, SampleBatch)]
    counter, missing = count(batches[:3] + batches[5:8] + batches[9:])
    assert (counter.gaps, counter.lost_samples) == (2, 3 * 512)
    assert [m for m in missing if m] == [1024, 512]


def test_a_restart_is_no_gap():
    batches = [b for b in objects_of(make_record()) if isinstance(b, SampleBatch)]
    counter, _ = count(batches + batches)
    assert (counter.gaps, counter.restarts) == (0, 1)


def test_each_shaft_counts_for_itself():
    record = make_record()
    one = [b for b in objects_of(record) if isinstance(b, TachoBatch)]
    other = [
        TachoBatch(
            b.t0_ns, b.sample_rate_hz, b.first_sample, b.sample_count, "output", 1.0, 0, b.pulse_offsets
        )
        for b in one
    ]
    both = [batch for pair in zip(one, other, strict=True) for batch in pair]
    assert count(both)[0].gaps == 0
    assert count([b for b in both if not (b.shaft == "output" and b.first_sample == 1024)])[0].gaps == 1


@pytest.mark.parametrize("data", [b"", b"\x00\x01\x00\x00", b"\x00\x01\x00\x00" + b"\xff" * 40])
def test_nonsense_is_no_batch(data):
    for name in cdr.BATCHES:
        assert cdr.position(data, name) is None
        assert cdr.without_padding(data, name) == data
