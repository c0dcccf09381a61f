"""Saves what can be saved of a bag that was killed, cut off or damaged."""

from __future__ import annotations

import mmap
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Message, MessageIndex, Metadata, Schema

from gearsim_io.bags.frames import BAD, MAGIC, Data, Piece, body, chunk_span_ns, foreign, inner, pieces
from gearsim_io.bags.layout import A_BAG, TopicInfo, bag_files
from gearsim_io.bags.reader import check_type, topic_of
from gearsim_io.bags.writer import BagWriter
from gearsim_io.errors import InputError


@dataclass(slots=True)
class Recovery:
    """What was saved and what was not."""

    out: Path
    messages: int = 0
    unverified: int = 0
    seconds: float = 0.0
    lost_messages: int = 0
    skipped_bytes: int = 0
    losses: list[str] = field(default_factory=list)

    def summary(self) -> str:
        """One line for people."""
        text = f"{self.out}: {self.messages} messages over {self.seconds:.3f} s saved"
        if self.unverified:
            text += f" ({self.unverified} of them from a piece without its checksum)"
        return text + "; " + ("; ".join(self.losses) or "nothing was lost")


def recover(path: Path | str, out: Path | str) -> Recovery:
    """Copy every sound message of a bag into a new, sound bag.

    Parameters
    ----------
    path : Path or str
        The damaged bag's folder, or one .mcap file.
    out : Path or str
        Folder of the new bag; must not exist.

    Returns
    -------
    Recovery
        Counts and, in words, what was lost and where.

    Raises
    ------
    InputError
        If there is no such bag, it holds no whole message, or `out` exists.
    BagError
        If the new bag cannot be written to the end.
    """
    files = bag_files(Path(path))
    if all(map(foreign, files)):
        raise InputError(str(path), "", f"no whole message in it: {foreign(files[0])}", A_BAG)
    found = [_Salvage(file) for file in files]
    if not any(salvage.has_messages() for salvage in found):
        raise InputError(str(path), "", "no whole message in it", "a bag with something to save")
    custom = {key: value for salvage in found for key, value in salvage.custom_data.items()}
    report = Recovery(Path(out))
    with BagWriter(out, {**custom, "recovered_from": str(path)}, sync_period_s=None) as writer:
        for salvage in found:
            salvage.copy(writer, report)
        report.messages = writer.totals.messages
        report.seconds = writer.totals.duration_ns / 1e9
    return report


class _Salvage:
    """One file: first its topics, wherever they are told, then its messages."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self.custom_data: dict[str, str] = {}
        self.topics: dict[int, TopicInfo] = {}
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._data: Data = _map(file)
        self._pieces = list(pieces(self._data))
        for piece in self._pieces:
            try:
                self._learn(piece)
            except BAD:
                continue  # what is lost by that is told where the messages are copied
        for number, channel in self._channels.items():
            if channel.schema_id in self._schemas:
                topic = topic_of(str(file), channel, self._schemas)
                check_type(str(file), topic)
                self.topics[number] = topic

    def _learn(self, piece: Piece) -> None:
        """Schemas and channels stand in the first chunks and again in the index at the end."""
        if piece.opcode == Opcode.CHUNK:
            for opcode, content in inner(self._data, piece):
                self._learn_record(opcode, ReadDataStream(BytesIO(content)))
        elif piece.whole:
            self._learn_record(piece.opcode, body(self._data, piece))

    def _learn_record(self, opcode: int, stream: ReadDataStream) -> None:
        if opcode == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas.setdefault(schema.id, schema)
        elif opcode == Opcode.CHANNEL:
            channel = Channel.read(stream)
            self._channels.setdefault(channel.id, channel)
        elif opcode == Opcode.METADATA:
            record = Metadata.read(stream)
            if record.name != "rosbag2":
                self.custom_data.update(record.metadata)

    def _messages(self, piece: Piece) -> Iterator[Message]:
        """The messages of a chunk, or the one that stands alone."""
        if piece.opcode == Opcode.CHUNK:
            records = inner(self._data, piece)
        elif piece.opcode == Opcode.MESSAGE and piece.whole:
            records = iter([(int(Opcode.MESSAGE), body(self._data, piece).read(piece.end - piece.start))])
        else:
            return
        for opcode, content in records:
            if opcode == Opcode.MESSAGE:
                message = Message.read(ReadDataStream(BytesIO(content)), len(content))
                if message.channel_id in self.topics:
                    yield message

    def has_messages(self) -> bool:
        """Whether there is anything to save."""
        return any(True for piece in self._pieces for _ in self._messages(piece))

    def copy(self, writer: BagWriter, report: Recovery) -> None:
        """Write all sound messages and note what is missing."""
        for topic in self.topics.values():
            writer.add_info(topic)
        for number, piece in enumerate(self._pieces):
            taken = 0
            for message in self._messages(piece):
                topic_name = self.topics[message.channel_id].name
                writer.write(topic_name, message.log_time, message.data, message.publish_time)
                taken += 1
            if piece.opcode == Opcode.CHUNK and not piece.sound:
                self._note_chunk(number, piece, taken, report)
            elif not piece.whole:
                self._note_bytes(piece, report)
        if self._data[-len(MAGIC) :] != MAGIC:
            report.losses.append(f"{self.file.name} was cut off at byte {len(self._data)}")

    def _note_chunk(self, number: int, piece: Piece, taken: int, report: Recovery) -> None:
        if not piece.whole:
            report.unverified += taken
            report.losses.append(
                f"the piece at byte {piece.start} has no end, {taken} messages of it are saved"
            )
            return
        lost = self._indexed_messages(number)
        report.lost_messages += lost
        report.skipped_bytes += piece.end - piece.start
        first_ns, last_ns = chunk_span_ns(self._data, piece)
        report.losses.append(
            f"{lost} messages of {max(0, last_ns - first_ns) / 1e9:.3f} s from time {first_ns / 1e9:.3f} s "
            f"on are lost (the checksum at byte {piece.start} does not fit)"
        )

    def _indexed_messages(self, number: int) -> int:
        """How many messages the index behind a chunk counts."""
        count = 0
        for piece in self._pieces[number + 1 :]:
            if piece.opcode != Opcode.MESSAGE_INDEX or not piece.whole:
                break
            count += len(MessageIndex.read(body(self._data, piece)).records)
        return count

    def _note_bytes(self, piece: Piece, report: Recovery) -> None:
        size = piece.end - piece.start
        report.skipped_bytes += size
        report.losses.append(f"{size} bytes from byte {piece.start} on make no sense and were skipped")


def _map(file: Path) -> Data:
    if file.stat().st_size == 0:
        return b""
    with open(file, "rb") as stream:
        return mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ)


__all__ = ["Recovery", "recover"]
