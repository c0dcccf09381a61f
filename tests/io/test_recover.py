"""Recovery: of any damage what is sound is saved, unchanged and in order, and the rest is told."""

from __future__ import annotations

import contextlib
import os
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from recordings import flip_byte, make_record, write_bag

from gearsim_io.bags import BagWriter, StreamWriter, info, read_bag, recover
from gearsim_io.bags.frames import MAGIC, pieces
from gearsim_io.errors import InputError


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp("bags") / "good", make_record(seconds=3.0))


@pytest.fixture(scope="module")
def original(bag):
    return list(read_bag(bag))


def damaged(bag, tmp_path, change):
    folder = tmp_path / "damaged"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.rmtree(tmp_path / "saved", ignore_errors=True)
    shutil.copytree(bag, folder)
    change(folder / f"{bag.name}_0.mcap")
    return folder


def save(folder, tmp_path):
    report = recover(folder, tmp_path / "saved")
    assert info(tmp_path / "saved").problem == ""
    saved = list(read_bag(tmp_path / "saved"))
    assert len(saved) == report.messages
    return saved, report


def check_subset(saved, original):
    """Nothing changed, nothing twice, nothing out of order."""
    places = []
    start = 0
    for message in saved:
        start = original.index(message, start) + 1
        places.append(start)
    return len(original) - len(places)


def test_a_sound_bag_stays_what_it_is(bag, original, tmp_path):
    saved, report = save(bag, tmp_path)
    assert saved == original
    assert report.losses == []
    assert "nothing was lost" in report.summary()
    assert info(tmp_path / "saved").custom_data["scenario"] == "test"
    assert info(tmp_path / "saved").topics == info(bag).topics


def chunks_of(bag):
    data = (bag / f"{bag.name}_0.mcap").read_bytes()
    return [piece for piece in pieces(data) if piece.opcode == Opcode.CHUNK], len(data)


def test_a_flipped_byte_in_a_piece_costs_that_piece(bag, original, tmp_path):
    chunks, _ = chunks_of(bag)
    assert len(chunks) >= 10
    victim = chunks[4]
    folder = damaged(bag, tmp_path, lambda file: flip_byte(file, (victim.start + victim.end) // 2))
    saved, report = save(folder, tmp_path)
    lost = check_subset(saved, original)
    assert 0 < lost < len(original) / 5
    assert report.lost_messages == lost
    assert f"{lost} messages" in report.summary()
    assert "checksum" in report.summary()


def test_a_damaged_index_costs_nothing(bag, original, tmp_path):
    chunks, size = chunks_of(bag)
    for place in (chunks[3].end + 3, chunks[3].end + 30, size - 30, size - 200):
        folder = damaged(bag, tmp_path, lambda file, place=place: flip_byte(file, place))
        with pytest.raises(InputError):
            list(read_bag(folder))
        saved, _ = save(folder, tmp_path)
        assert saved == original, place


def test_a_damaged_length_costs_nothing_or_one_piece(bag, original, tmp_path):
    """The length of a chunk decides where the next record begins; wrong, it must not cost the rest."""
    chunks, _ = chunks_of(bag)
    for byte in range(1, 9):
        folder = damaged(bag, tmp_path, lambda file, byte=byte: flip_byte(file, chunks[5].start + byte))
        saved, _ = save(folder, tmp_path)
        assert check_subset(saved, original) == 0, byte
    folder = damaged(bag, tmp_path, lambda file: flip_byte(file, chunks[5].start))  # no chunk any more
    saved, report = save(folder, tmp_path)
    assert 0 < check_subset(saved, original) < len(original) / 5
    assert report.skipped_bytes > 0


def test_a_damaged_length_of_an_index_costs_nothing(bag, original, tmp_path):
    """It leads into the middle of a later chunk, and must not take the chunks between along."""
    data = (bag / "good_0.mcap").read_bytes()
    found = list(pieces(data))
    number = next(k for k, piece in enumerate(found) if piece.opcode == Opcode.MESSAGE_INDEX and k > 20)
    for mask in (0x20, 0x40, 0x80):  # 8, 16 and 32 kB further on
        folder = damaged(bag, tmp_path, lambda file, m=mask: flip_byte(file, found[number].start + 2, m))
        saved, _ = save(folder, tmp_path)
        assert saved == original, mask


def test_the_first_piece_may_be_damaged_too(bag, original, tmp_path):
    """It announces the topics; the index at the end does so again."""
    chunks, _ = chunks_of(bag)
    folder = damaged(bag, tmp_path, lambda file: flip_byte(file, chunks[0].start + 100))
    saved, _ = save(folder, tmp_path)
    assert check_subset(saved, original) < len(original) / 5


@pytest.mark.parametrize("share", np.linspace(0.1, 0.999, 12))
def test_a_cut_off_bag_keeps_every_message_before_the_cut(bag, original, tmp_path, share):
    content = (bag / "good_0.mcap").read_bytes()
    place = int(share * len(content))
    whole, at = 0, 0
    for message in original:
        at = content.index(message.data, at) + len(message.data)
        whole += at <= place
    folder = damaged(bag, tmp_path, lambda file: os.truncate(file, place))
    saved, report = save(folder, tmp_path)
    assert saved == original[:whole]
    assert f"cut off at byte {place}" in report.summary()


@given(st.data())
@settings(max_examples=40, deadline=None)
def test_any_damage_leaves_only_true_messages(bag, original, tmp_path_factory, data):
    """Several flipped bytes, a cut, a hole of zeros: nothing false ever comes out."""
    tmp_path = tmp_path_factory.mktemp("any")
    size = (bag / "good_0.mcap").stat().st_size

    def change(file):
        for _ in range(data.draw(st.integers(0, 4))):
            flip_byte(file, data.draw(st.integers(0, size - 1)), data.draw(st.integers(1, 255)))
        if data.draw(st.booleans()):
            os.truncate(file, data.draw(st.integers(size // 2, size)))
        if data.draw(st.booleans()):
            with open(file, "r+b") as stream:
                stream.seek(data.draw(st.integers(0, size - 1)))
                stream.write(bytes(data.draw(st.integers(1, 5000))))

    folder = damaged(bag, tmp_path, change)
    with contextlib.suppress(InputError):  # nothing could be saved
        saved, report = save(folder, tmp_path)
        if report.unverified == 0:
            check_subset(saved, original)


def test_what_the_tail_holds_is_called_unverified(bag, original, tmp_path):
    chunks, _ = chunks_of(bag)
    place = chunks[-1].end - 200
    folder = damaged(bag, tmp_path, lambda file: os.truncate(file, place))
    saved, report = save(folder, tmp_path)
    assert report.unverified > 0
    assert saved == original[: len(saved)]
    assert "without its checksum" in report.summary()


def test_a_writer_that_never_closed(tmp_path):
    writer = BagWriter(tmp_path / "open", sync_period_s=0.2)
    stream = StreamWriter(writer)
    for batch in make_record(seconds=2.0).batches(512):
        stream.write(batch)
    shutil.copytree(tmp_path / "open", tmp_path / "as_killed")
    saved, _ = save(tmp_path / "as_killed", tmp_path)
    assert len(saved) >= 0.85 * 48
    writer.close()


@pytest.mark.parametrize("content", [b"", MAGIC, MAGIC + b"\x01", b"\x00" * 5000, b"no bag at all" * 100])
def test_nothing_to_save(tmp_path, content):
    file = tmp_path / "x.mcap"
    file.write_bytes(content)
    with pytest.raises(InputError, match="no whole message in it"):
        recover(file, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_is_no_bag_is_told_as_that_and_not_sent_to_recovery(tmp_path):
    file = tmp_path / "x.mcap"
    file.write_text("time,acceleration\n" * 100)
    for read in (lambda: list(read_bag(file)), lambda: recover(file, tmp_path / "out")):
        with pytest.raises(InputError, match=r"no MCAP file \(its magic bytes are b'time,acc'\)") as caught:
            read()
        assert "./gearsim recover" not in str(caught.value)
    assert info(file).problem.startswith("no MCAP file")


def test_a_bag_whose_first_bytes_are_damaged_is_one_all_the_same(bag, original, tmp_path):
    def spoil(file):
        file.write_bytes(b"spoiled!" + file.read_bytes()[8:])

    folder = damaged(bag, tmp_path, spoil)
    with pytest.raises(InputError, match=r"\./gearsim recover"):
        list(read_bag(folder))
    saved, _ = save(folder, tmp_path)
    assert saved == original


def test_the_new_bag_must_be_new(bag, tmp_path):
    (tmp_path / "out").mkdir()
    with pytest.raises(InputError, match="a folder that exists already"):
        recover(bag, tmp_path / "out")
    with pytest.raises(InputError, match="nothing there"):
        recover(tmp_path / "none", tmp_path / "new")
