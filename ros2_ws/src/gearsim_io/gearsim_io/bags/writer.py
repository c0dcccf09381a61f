"""Writes a bag from serialised messages, so that a killed writer or a full disk costs little."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import BinaryIO

from mcap.writer import CompressionType, IndexType, Writer

from gearsim_io.bags.layout import METADATA, BagError, TopicInfo, Totals, dump_yaml, metadata
from gearsim_io.errors import InputError
from gearsim_io.qos import Qos, Topic

LIBRARY = "gearsim_io"
_CHUNK_BYTES = 1 << 20
_NANOSECONDS = 1e9


class BagWriter:
    """A bag being written.

    Parameters
    ----------
    path : Path or str
        The bag's folder; it must not exist yet.
    custom_data : mapping of str to str
        Where the recording comes from, such as scenario, seed, version; kept in the bag from the start.
    sync_period_s : float or None
        What was written is flushed to the disk whenever the messages' log time has moved on this much,
        measured from the last time. None: only `sync()` and full chunks (1 MiB) do.

    Raises
    ------
    InputError
        If the folder exists or cannot be made.
    """

    def __init__(
        self,
        path: Path | str,
        custom_data: Mapping[str, str] | None = None,
        sync_period_s: float | None = 0.2,
    ) -> None:
        self.path = Path(path)
        self.topics: dict[str, TopicInfo] = {}
        self.totals = Totals()
        self.custom_data = dict(custom_data or {})
        self._sync_period_ns = None if sync_period_s is None else round(sync_period_s * _NANOSECONDS)
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        self._last_sync_ns: int | None = None
        self._closed = False
        self._safe_totals = Totals()
        self._file = self._create()
        self._safe_bytes = 0
        self._writer = Writer(
            self._file, chunk_size=_CHUNK_BYTES, compression=CompressionType.NONE, enable_data_crcs=True
        )
        with self._failing_cleanly():
            self._writer.start(profile="ros2", library=LIBRARY)
            if self.custom_data:
                self._writer.add_metadata(LIBRARY, self.custom_data)
            self._write_metadata_file()
            self._flush()

    def _create(self) -> BinaryIO:
        try:
            self.path.mkdir(parents=True)
            return open(self.path / f"{self.path.name}_0.mcap", "wb")
        except FileExistsError:
            raise InputError(
                str(self.path), "", "a folder that exists already", "the name of a new bag"
            ) from None
        except OSError as error:
            raise InputError(str(self.path), "", error.strerror, "a place for a new bag") from None

    @property
    def file(self) -> Path:
        """The .mcap file."""
        return self.path / f"{self.path.name}_0.mcap"

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None:
            self.close()
        else:
            with contextlib.suppress(BagError):
                self.close()

    def add(self, topic: Topic) -> None:
        """Announce one of the rig's topics under its full name; a second time does nothing."""
        self.add_topic(topic.full_name, topic.type, (topic.qos,))

    def add_topic(self, name: str, type_name: str, qos: Sequence[Qos]) -> None:
        """Announce a topic; a second time does nothing.

        Raises
        ------
        InputError
            If the type is not known here, or the topic has another type already.
        """
        self.add_info(TopicInfo.of(name, type_name, qos))

    def add_info(self, topic: TopicInfo) -> None:
        """Announce a topic with its schema given; a second time does nothing."""
        before = self.topics.get(topic.name)
        if before is not None:
            if before.type != topic.type:
                raise InputError(str(self.path), topic.name, topic.type, f"{before.type}, as before")
            return
        with self._failing_cleanly():
            if topic.type not in self._schemas:
                self._schemas[topic.type] = self._writer.register_schema(
                    topic.type, "ros2msg", topic.schema.encode()
                )
            self._channels[topic.name] = self._writer.register_channel(
                topic.name, "cdr", self._schemas[topic.type], topic.channel_metadata()
            )
            self.topics[topic.name] = topic
            self._write_metadata_file()

    def write(self, topic: str, t_ns: int, data: bytes, publish_ns: int | None = None) -> None:
        """Add one message.

        Parameters
        ----------
        topic : str
            Full name, announced before.
        t_ns : int
            Log time: when it was received (live) or belongs (offline).
        data : bytes
            The message in CDR, kept as it is.
        publish_ns : int, optional
            When it was published; `t_ns` if not known.

        Raises
        ------
        BagError
            If the disk is full or failing. The bag has then been closed, and is sound up to there.
        """
        channel = self._channels[topic]
        with self._failing_cleanly():
            sequence = self.totals.counts.get(topic, 0)
            self._writer.add_message(
                channel, t_ns, data, t_ns if publish_ns is None else publish_ns, sequence
            )
            self.totals.add(topic, t_ns)
            if self._last_sync_ns is None or t_ns < self._last_sync_ns:
                self._last_sync_ns = t_ns
            elif self._sync_period_ns is not None and t_ns - self._last_sync_ns >= self._sync_period_ns:
                self._sync(t_ns)

    def sync(self) -> None:
        """Bring everything written so far onto the disk (for a timer, where messages may stay away)."""
        if not self._closed:
            with self._failing_cleanly():
                self._sync(self._last_sync_ns)

    def _sync(self, t_ns: int | None) -> None:
        if self.totals.messages != self._safe_totals.messages:
            self._flush()
        self._last_sync_ns = t_ns

    def _flush(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        os.fsync(self._file.fileno())
        self._safe_bytes = self._file.tell()
        self._safe_totals = _copy(self.totals)

    def close(self) -> None:
        """Write the index and the final `metadata.yaml`; a second time does nothing."""
        if self._closed:
            return
        with self._failing_cleanly():
            self._flush()
            text = dump_yaml(
                metadata(self.file.name, tuple(self.topics.values()), self.totals, self.custom_data)
            )
            self._writer.add_metadata("rosbag2", {"serialized_metadata": text})
            self._writer.finish()  # type: ignore[no-untyped-call]
            self._file.flush()
            os.fsync(self._file.fileno())
            self._closed = True
            self._file.close()
            self._write_metadata_file()

    @contextlib.contextmanager
    def _failing_cleanly(self) -> Iterator[None]:
        """If the disk refuses or Ctrl-C strikes: end the file behind the last whole piece."""
        if self._closed:
            raise BagError(f"{self.path}: the bag is closed")
        try:
            yield
        except OSError as error:
            saved = self._end_after_failure()
            raise BagError(f"{self.path}: {error.strerror or error}; {saved}") from error
        except BaseException:
            self._end_after_failure()
            raise

    def _end_after_failure(self) -> str:
        """Cut off what is incomplete, add the shortest legal end; a sentence on what is left."""
        self._closed = True
        lost = self.totals.messages - self._safe_totals.messages
        self.totals = self._safe_totals
        with contextlib.suppress(OSError, ValueError):
            self._file.close()  # what its buffer still holds is cut off below
        try:
            os.truncate(self.file, self._safe_bytes)
            self._append_shortest_end()
        except OSError:
            return (
                f"{self.totals.messages} messages are on the disk; ./gearsim recover {self.path} saves them"
            )
        with contextlib.suppress(OSError):
            self._write_metadata_file()  # without room for it the one from the start stays
        return f"{self.totals.messages} messages are kept and readable, the last {lost} are lost"

    def _append_shortest_end(self) -> None:
        with open(self.file, "ab") as end:
            Writer(
                end,
                index_types=IndexType.NONE,
                repeat_channels=False,
                repeat_schemas=False,
                use_chunking=False,
                use_statistics=False,
                use_summary_offsets=False,
            ).finish()  # type: ignore[no-untyped-call]

    def _metadata_text(self) -> str:
        topics = tuple(self.topics.values())
        return dump_yaml(metadata(self.file.name, topics, self.totals, self.custom_data))

    def _write_metadata_file(self) -> None:
        text = self._metadata_text()
        target = self.path / METADATA
        fresh = target.with_suffix(".yaml.tmp")
        try:
            fresh.write_text(text, encoding="utf-8")
            os.replace(fresh, target)
        except OSError:
            with contextlib.suppress(OSError):
                fresh.unlink()
            raise


def _copy(totals: Totals) -> Totals:
    return Totals(dict(totals.counts), totals.first_ns, totals.last_ns)
