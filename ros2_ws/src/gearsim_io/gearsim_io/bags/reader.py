"""Reads bags with every checksum tested; whatever is wrong comes as one clear error."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from mcap.exceptions import EndOfFile, McapError
from mcap.reader import make_reader
from mcap.records import Channel, Footer, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader

from gearsim_io import cdr, definitions
from gearsim_io.bags.frames import foreign
from gearsim_io.bags.layout import A_BAG, BagError, TopicInfo, Totals, bag_files, parse_qos
from gearsim_io.errors import InputError

_MAGIC_BYTES = 8
_FOOTER_BYTES = 1 + 8 + 20
_BAD = (McapError, CRCValidationError, struct.error, ValueError, OverflowError, MemoryError, KeyError)


class BagMessage(NamedTuple):
    """One message of a bag; `t_ns` is the log time, `data` the message in CDR."""

    topic: str
    t_ns: int
    data: bytes
    type: str
    publish_ns: int = 0


@dataclass(slots=True)
class BagInfo:
    """What a bag holds; `problem` says in one sentence why it cannot be read to the end, empty if it can."""

    path: Path
    size_bytes: int = 0
    totals: Totals = field(default_factory=Totals)
    topics: dict[str, TopicInfo] = field(default_factory=dict)
    custom_data: dict[str, str] = field(default_factory=dict)
    problem: str = ""

    @property
    def seconds(self) -> float:
        """From the first to the last message."""
        return self.totals.duration_ns / 1e9

    def to_json(self) -> dict[str, Any]:
        """The information as a JSON object."""
        return {
            "path": str(self.path),
            "size_bytes": self.size_bytes,
            "sound": not self.problem,
            "problem": self.problem,
            "start_ns": self.totals.first_ns if self.totals.messages else None,
            "seconds": self.seconds,
            "messages": self.totals.messages,
            "topics": [
                {"name": topic.name, "type": topic.type, "messages": self.totals.counts.get(topic.name, 0)}
                for topic in self.topics.values()
            ],
            "custom_data": self.custom_data,
        }


def read_bag(path: Path | str, topics: tuple[str, ...] | None = None) -> Iterator[BagMessage]:
    """The messages of a bag in the order in which they were recorded.

    Parameters
    ----------
    path : Path or str
        The bag's folder, or one .mcap file.
    topics : tuple of str, optional
        Full names of the topics wanted; all by default.

    Raises
    ------
    InputError
        If there is no such bag, or it is damaged or cut off: at the place where that shows, after
        the sound messages before it.
    """
    scan = _Scan(BagInfo(Path(path)), topics)
    for file in bag_files(Path(path)):
        yield from scan.messages(file)


def info(path: Path | str) -> BagInfo:
    """What a bag holds; reads it to the end with every checksum tested.

    A damaged bag is no error here: what could be read is counted and `problem` says what is wrong.

    Raises
    ------
    InputError
        If there is no such bag.
    """
    found = BagInfo(Path(path))
    files = bag_files(found.path)
    found.size_bytes = sum(file.stat().st_size for file in files)
    scan = _Scan(found, None)
    try:
        for file in files:
            for message in scan.messages(file):
                found.totals.add(message.topic, message.t_ns)
    except InputError as error:
        found.problem = f"{error.value}; expected {error.expected}"
    return found


def topics_of(path: Path | str) -> dict[str, TopicInfo]:
    """The topics of a bag, by name."""
    found = BagInfo(Path(path))
    for file in bag_files(found.path):
        if not _topics_by_index(file, found):
            for _ in _Scan(found, ()).messages(file):
                pass
    return found.topics


def _topics_by_index(file: Path, found: BagInfo) -> bool:
    """Read the topics from the index at the file's end; False if there is none that can be read."""
    try:
        with open(file, "rb") as stream:
            summary = make_reader(stream).get_summary()
    except _BAD:
        return False  # damaged: the scan from the start finds out more
    if summary is None or not summary.channels:
        return False
    for channel in summary.channels.values():
        topic = topic_of(str(file), channel, summary.schemas)
        check_type(str(file), topic)
        found.topics.setdefault(topic.name, topic)
    return True


def decode(message: BagMessage) -> Any:
    """The message as an object of the pure (`rosbags`) classes.

    Raises
    ------
    InputError
        If the bytes are not a message of that type.
    """
    from rosbags.serde import SerdeError

    definitions.definition(message.type)  # teaches the store types of installed packages
    data = cdr.without_padding(message.data, message.type)
    try:
        return definitions.typestore().deserialize_cdr(data, message.type)
    except (SerdeError, AssertionError, IndexError) as error:
        raise InputError(
            f"topic {message.topic}", "", str(error), f"a message of type {message.type}"
        ) from None


class _Scan:
    """Goes through files and keeps what it learns in `info`."""

    def __init__(self, found: BagInfo, topics: tuple[str, ...] | None) -> None:
        self._info = found
        self._topics = topics

    def messages(self, file: Path) -> Iterator[BagMessage]:
        schemas: dict[int, Schema] = {}
        channels: dict[int, tuple[TopicInfo, bool]] = {}
        with open(file, "rb") as stream:
            try:
                for record in StreamReader(stream, validate_crcs=True).records:
                    if isinstance(record, Message):
                        topic, wanted = channels[record.channel_id]
                        if wanted:
                            yield BagMessage(
                                topic.name, record.log_time, record.data, topic.type, record.publish_time
                            )
                    else:
                        self._learn(file, record, schemas, channels)
            except InputError:
                raise
            except _BAD as error:
                if what := foreign(file):
                    raise InputError(str(file), "", what, A_BAG) from None
                expected = f"a sound bag; ./gearsim recover {self._info.path} saves what can be saved"
                place, size = stream.tell(), file.stat().st_size
                reason = "the file is cut off" if place >= size else _reason(error)
                raise InputError(str(file), f"byte {place}", reason, expected) from None

    def _learn(
        self,
        file: Path,
        record: McapRecord,
        schemas: dict[int, Schema],
        channels: dict[int, tuple[TopicInfo, bool]],
    ) -> None:
        if isinstance(record, Header) and record.profile not in ("ros2", ""):
            raise InputError(str(file), "profile", record.profile, "ros2")
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel) and record.id not in channels:
            topic = topic_of(str(file), record, schemas)
            check_type(str(file), topic)
            channels[record.id] = (topic, self._topics is None or topic.name in self._topics)
            self._info.topics.setdefault(topic.name, topic)
        elif isinstance(record, Metadata) and record.name != "rosbag2":
            self._info.custom_data.update(record.metadata)
        elif isinstance(record, Footer):
            _check_summary(file, record)


def topic_of(where: str, channel: Channel, schemas: dict[int, Schema]) -> TopicInfo:
    """A channel as the topic that it carries."""
    if channel.message_encoding != "cdr":
        raise InputError(where, channel.topic, f"encoding {channel.message_encoding}", "encoding cdr")
    schema = schemas.get(channel.schema_id)
    if schema is None:
        raise InputError(where, channel.topic, "no schema", "a schema of encoding ros2msg")
    return TopicInfo(
        name=channel.topic,
        type=schema.name,
        schema=schema.data.decode("utf-8", "replace"),
        type_hash=channel.metadata.get("topic_type_hash", ""),
        qos=parse_qos(channel.metadata.get("offered_qos_profiles", "")),
    )


def check_type(where: str, topic: TopicInfo) -> None:
    """A message type of ours must be the one that this program knows."""
    if not topic.type.startswith(f"{definitions.PACKAGE}/"):
        return
    if topic.type not in definitions.gearsim_texts():
        raise InputError(
            where, topic.name, topic.type, f"a type that this version of {definitions.PACKAGE} has"
        )
    known = definitions.definition(topic.type).type_hash
    if topic.type_hash and topic.type_hash != known:
        expected = f"{known}, as this version of {definitions.PACKAGE} has it"
        raise InputError(where, topic.name, f"{topic.type} with hash {topic.type_hash}", expected)


def _check_summary(file: Path, footer: Footer) -> None:
    """The index has a checksum of its own that the library does not test."""
    if footer.summary_crc == 0 or footer.summary_start == 0:
        return
    with open(file, "rb") as stream:
        stream.seek(footer.summary_start)
        data = stream.read()
    covered = data[: len(data) - _MAGIC_BYTES - 4]
    if zlib.crc32(covered) != footer.summary_crc:
        raise McapError("the checksum of the index does not fit")


def _reason(error: Exception) -> str:
    if isinstance(error, (EndOfFile, struct.error)):
        return "the file is cut off"
    if isinstance(error, CRCValidationError):
        return f"the checksum of a {type(error.record).__name__} does not fit"
    if isinstance(error, KeyError):
        return f"a message of channel {error}, which was never announced"
    return str(error) or type(error).__name__


__all__ = ["BagError", "BagInfo", "BagMessage", "decode", "info", "read_bag", "topics_of"]
