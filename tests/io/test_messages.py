"""Messages both ways, in both families of classes; each family is the other's judge, byte by byte."""

from __future__ import annotations

import dataclasses
import math
import subprocess
import sys

import numpy as np
import pytest
from example_results import alarm, features, spectrum, trend_value, trends
from hypothesis import given, settings
from hypothesis import strategies as st

from gearsim_dsp import results
from gearsim_io import cdr, definitions
from gearsim_io.batches import EncoderBatch, SampleBatch, TachoBatch
from gearsim_io.errors import InputError
from gearsim_io.health import Level
from gearsim_io.machines import load_machine
from gearsim_io.messages import from_msg, message_name, pure_types, to_msg

TEXT = st.text(
    st.characters(codec="utf-8", exclude_characters="\x00", exclude_categories=("Cs",)), max_size=9
)
T_NS = st.integers(0, 2**31 * 10**9 - 1)
INDEX = st.integers(0, 2**63)
RATE = st.floats(1e-3, 1e7)


@st.composite
def sample_batches(draw):
    names = draw(st.lists(TEXT, min_size=1, max_size=5, unique=True))
    count = draw(st.integers(1, 20))
    size = 4 * len(names) * count
    raw = draw(st.binary(min_size=size, max_size=size))  # any bits, NaN with payload included
    data = np.frombuffer(raw, dtype=np.float32).reshape(len(names), count).copy()
    return SampleBatch(draw(T_NS), draw(RATE), draw(INDEX), tuple(names), draw(TEXT), data, draw(TEXT))


@st.composite
def offsets(draw, count):
    chosen = draw(st.lists(st.floats(0, count, exclude_max=True), max_size=6, unique=True))
    return np.sort(np.asarray(chosen, dtype=np.float64))


@st.composite
def angle_batches(draw):
    count = draw(st.integers(1, 5000))
    common = (draw(T_NS), draw(RATE), draw(INDEX), count, draw(TEXT))
    if draw(st.booleans()):
        return TachoBatch(*common, draw(st.floats(0.1, 60)), draw(INDEX), draw(offsets(count)), draw(TEXT))
    lines, first = draw(st.integers(1, 2**31)), draw(st.integers(-(2**62), 2**62))
    return EncoderBatch(*common, lines, first, draw(offsets(count)), draw(TEXT))


def equal(one, two):
    """Field by field and bit by bit, NaN equal to NaN."""
    assert type(one) is type(two)
    for spec in dataclasses.fields(one):
        a, b = getattr(one, spec.name), getattr(two, spec.name)
        if isinstance(a, np.ndarray):
            assert a.dtype == b.dtype
            assert a.shape == b.shape
            assert a.tobytes() == b.tobytes(), spec.name
        else:
            assert a == b or (isinstance(a, float) and math.isnan(a) and math.isnan(b)), spec.name


@given(sample_batches() | angle_batches())
@settings(max_examples=150, deadline=None)
def test_batches_survive_bit_by_bit_without_ros(batch):
    message = to_msg(batch, pure_types())
    name = definitions.PACKAGE + "/msg/" + message_name(batch)
    raw = bytes(definitions.typestore().serialize_cdr(message, name))
    equal(from_msg(definitions.typestore().deserialize_cdr(raw, name)), batch)
    place = cdr.position(raw, name)
    assert place is not None
    count = batch.data.shape[1] if isinstance(batch, SampleBatch) else batch.sample_count
    shaft = "" if isinstance(batch, SampleBatch) else batch.shaft
    assert place == (batch.sample_rate_hz, batch.first_sample, count, shaft)


@given(sample_batches() | angle_batches())
@settings(max_examples=60, deadline=None)
def test_rclpy_and_the_pure_classes_agree(batch):
    serialization = pytest.importorskip("rclpy.serialization", reason="ROS 2 is not installed")
    from gearsim_io.messages import ros_types

    name = definitions.PACKAGE + "/msg/" + message_name(batch)
    ours = to_msg(batch, ros_types())
    raw = cdr.without_padding(bytes(serialization.serialize_message(ours)), name)
    equal(from_msg(definitions.typestore().deserialize_cdr(raw, name)), batch)
    pure = bytes(definitions.typestore().serialize_cdr(to_msg(batch, pure_types()), name))
    equal(from_msg(serialization.deserialize_message(pure, type(ours))), batch)


# No field as it is by default, so that one that is left out is noticed.
ALARM = alarm(present=False, acknowledged=True, acknowledged_by="Ada")
OBJECTS = [
    ALARM,
    trends(trend_value(), trend_value(channel="b3_x")),
    results.AlarmState(6, "rig", "envelope", Level.ERROR, False, "", 131071, (ALARM, ALARM)),
    features(),
    spectrum(),
]


def families():
    yield "rosbags", pure_types()
    try:
        from gearsim_io.messages import ros_types

        yield "rclpy", ros_types()
    except ImportError:
        return


@pytest.mark.parametrize("obj", OBJECTS, ids=lambda obj: type(obj).__name__)
def test_results_mirror_their_messages(obj):
    for family, types in families():
        message = to_msg(obj, types)
        assert message.header.frame_id == "rig", family
        equal(from_msg(message, type(obj)), obj)


def test_every_field_of_a_result_reaches_its_message():
    """A renamed field would be left out silently, were it not looked for here."""
    message = to_msg(ALARM, pure_types())
    assert (message.found_frequency, message.value, message.threshold) == (48.8, 30.0, 12.0)
    assert (message.level, message.previous_level, message.sample) == (2, 0, 131071)
    incomplete = dataclasses.make_dataclass("Alarm", [("t_ns", int), ("frame_id", str)])(1, "x")
    with pytest.raises(InputError, match="Alarm: alarm_id"):
        to_msg(incomplete, pure_types())


def test_nameplates_survive():
    for name in ("unsw_parallel", "unsw_planetary", "mfpt", "wt_hss", "sq_gearbox"):
        machine = load_machine(name)
        bare = dataclasses.replace(machine, sources={})
        for family, types in families():
            message = to_msg(machine, types, 9)
            back = from_msg(message)
            assert repr(back) == repr(bare), family
            assert back == from_msg(message), "equal nameplates must compare equal, NaN or not"


def bad(short, **fields):
    message = to_msg(
        SampleBatch(0, 1000.0, 0, ("a", "b"), "1", np.zeros((2, 3), np.float32))
        if short == "SampleBatch"
        else TachoBatch(0, 1000.0, 0, 10, "s", 1.0, 0, np.array([1.0, 2.0])),
        pure_types(),
    )
    for name, value in fields.items():
        setattr(message, name, value)
    return message


@pytest.mark.parametrize(
    ("message", "words"),
    [
        (bad("SampleBatch", samples_per_channel=4), "data: got 6 values, expected 2 channels x 4 samples"),
        (bad("SampleBatch", channel_names=["a", "a"]), "channels"),
        (bad("SampleBatch", channel_names=[], samples_per_channel=0, data=np.zeros(0, "f4")), "channels"),
        (bad("SampleBatch", sample_rate=float("nan")), "sample_rate: got nan"),
        (bad("SampleBatch", sample_rate=0.0), "sample_rate"),
        (bad("TachoBatch", pulse_offsets=np.array([2.0, 1.0])), "pulse_offsets"),
        (bad("TachoBatch", pulse_offsets=np.array([1.0, 10.0])), r"within [0, 10)"),
        (bad("TachoBatch", pulse_offsets=np.array([float("nan")])), "pulse_offsets"),
        (bad("TachoBatch", pulses_per_revolution=0.0), "pulses_per_revolution"),
        (bad("TachoBatch", sample_count=0), "sample_count"),
    ],
)
def test_messages_that_contradict_themselves_are_refused(message, words):
    with pytest.raises(InputError) as caught:
        from_msg(message)
    assert words in str(caught.value)


def test_unknown_messages_are_named():
    with pytest.raises(InputError, match="SampleBatch, TachoBatch"):
        from_msg(pure_types().Header(stamp=pure_types().Time(sec=0, nanosec=0), frame_id=""))


def test_without_ros():
    """All but the nodes works where rclpy cannot be imported."""
    code = """
import sys
for name in ("rclpy", "gearsim_msgs", "std_msgs"):
    sys.modules[name] = None
import gearsim_io.bags, gearsim_io.importers, gearsim_io.scene, gearsim_io.rerun_export, gearsim_io.playback
from gearsim_io.machines import load_machine
from gearsim_io.messages import from_msg, pure_types, to_msg
print(from_msg(to_msg(load_machine("mfpt"), pure_types(), 0)).name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "mfpt"
