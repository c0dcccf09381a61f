"""Cuts a damaged MCAP file into records; where their frame is broken, goes on with the next sound chunk."""

from __future__ import annotations

import mmap
import re
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import NamedTuple, TypeAlias

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.stream_reader import CRCValidationError, get_chunk_data_stream

MAGIC = b"\x89MCAP0\r\n"
PREFIX = struct.Struct("<BQ")
# Times of first and last message, size, checksum, length of the compression's name (0: not compressed).
_CHUNK_HEAD = struct.Struct("<QQQII")
_CHUNK_FIXED = _CHUNK_HEAD.size + 8
# A chunk's first byte and a length below 4 GiB; its checksum then decides.
_CHUNK_START = re.compile(rb"\x06.{4}\x00{4}", re.DOTALL)
_OPCODES = frozenset(int(code) for code in Opcode)
BAD = (McapError, CRCValidationError, struct.error, ValueError, KeyError, OverflowError, MemoryError)

Data: TypeAlias = bytes | mmap.mmap


class Piece(NamedTuple):
    """A record of the file, or (opcode 0) a stretch of bytes that makes no sense.

    `whole`: it is there to its end; `sound`: of a chunk, its checksum fits.
    """

    opcode: int
    start: int
    end: int
    whole: bool
    sound: bool


def foreign(file: Path) -> str:
    """What a file is if it is no MCAP file, in words; empty for one, however damaged, or an empty file."""
    if file.stat().st_size == 0:
        return ""
    with open(file, "rb") as stream, mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
        head = data[: len(MAGIC)]
        if MAGIC.startswith(head) or data[-len(MAGIC) :] == MAGIC or _next_chunk(data, 0) is not None:
            return ""
        return f"no MCAP file (its magic bytes are {head!r})"


def body(data: Data, piece: Piece) -> ReadDataStream:
    """What follows a record's opcode and length."""
    return ReadDataStream(BytesIO(data[piece.start + PREFIX.size : piece.end]))


def pieces(data: Data) -> Iterator[Piece]:
    """The records of a file in order, whatever state it is in."""
    at = len(MAGIC) if data[: len(MAGIC)] == MAGIC else 0
    end = len(data)
    while at < end:
        piece = _piece(data, at)
        yield piece
        if piece.opcode == Opcode.FOOTER and piece.whole:
            return
        at = piece.end


def inner(data: Data, piece: Piece) -> Iterator[tuple[int, bytes]]:
    """Opcode and body of the records inside a chunk; of a chunk that is cut off, those before the cut.

    Of a whole chunk whose checksum does not fit nothing is taken, as the bad byte may be anywhere.
    """
    if piece.sound:
        stream, length = get_chunk_data_stream(Chunk.read(body(data, piece)))
        records = stream.read(length)
    elif piece.whole or not _is_uncompressed(data, piece.start):
        return
    else:
        records = data[piece.start + PREFIX.size + _CHUNK_FIXED : piece.end]
    at = 0
    while at + PREFIX.size <= len(records):
        opcode, length = PREFIX.unpack_from(records, at)
        stop = at + PREFIX.size + length
        if stop > len(records) or opcode not in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE):
            return
        yield opcode, records[at + PREFIX.size : stop]
        at = stop


def chunk_span_ns(data: Data, piece: Piece) -> tuple[int, int]:
    """Log times of a chunk's first and last message."""
    first, last = struct.unpack_from("<QQ", data, piece.start + PREFIX.size)
    return first, last


def _piece(data: Data, at: int) -> Piece:
    """The record at `at`, or what is there instead of one."""
    end = len(data)
    opcode, stop = _frame(data, at)
    if opcode == Opcode.CHUNK:
        piece = _chunk(data, at, stop)
        if piece is not None:
            return piece
    elif opcode and stop <= end:
        if _frame(data, stop)[0] or stop + PREFIX.size > end:
            return Piece(opcode, at, stop, whole=True, sound=True)
        after = _next_chunk(data, at + 1)  # its length may be what is damaged
        if after is None or after >= stop:
            return Piece(opcode, at, stop, whole=True, sound=True)
        return Piece(0, at, after, whole=False, sound=False)
    after = _next_chunk(data, at + 1)
    cut = after is None and opcode == Opcode.CHUNK
    return Piece(Opcode.CHUNK if cut else 0, at, end if after is None else after, whole=False, sound=False)


def _frame(data: Data, at: int) -> tuple[int, int]:
    """Opcode and end of the record at `at`; opcode 0 if there is none."""
    if at + PREFIX.size > len(data):
        return 0, len(data)
    opcode, length = PREFIX.unpack_from(data, at)
    return (opcode, at + PREFIX.size + length) if opcode in _OPCODES else (0, at)


def _chunk(data: Data, at: int, stop: int) -> Piece | None:
    """The chunk at `at` if it is whole; its length is told twice, so one of the two may be damaged."""
    by_size = _sound_end(data, at)
    if by_size is not None:
        return Piece(Opcode.CHUNK, at, by_size, whole=True, sound=True)
    if stop > len(data):
        return None
    piece = Piece(Opcode.CHUNK, at, stop, whole=True, sound=False)
    if not _is_uncompressed(data, at):
        try:
            get_chunk_data_stream(Chunk.read(body(data, piece)), validate_crc=True)
        except Exception:  # the compression libraries have errors of their own
            return piece if _frame(data, stop)[0] else None
        return piece._replace(sound=True)
    return piece if _frame(data, stop)[0] else None


def _is_uncompressed(data: Data, at: int) -> bool:
    head = at + PREFIX.size
    return head + _CHUNK_FIXED <= len(data) and _CHUNK_HEAD.unpack_from(data, head)[-1] == 0


def _sound_end(data: Data, at: int) -> int | None:
    """End of the uncompressed chunk at `at` if its checksum fits."""
    head = at + PREFIX.size
    if head + _CHUNK_FIXED > len(data):
        return None
    first_ns, last_ns, size, checksum, name_length = _CHUNK_HEAD.unpack_from(data, head)
    stop = head + _CHUNK_FIXED + size
    if name_length or first_ns > last_ns or size == 0 or stop > len(data):
        return None
    return stop if zlib.crc32(data[head + _CHUNK_FIXED : stop]) == checksum else None


def _next_chunk(data: Data, start: int) -> int | None:
    """Where the next uncompressed chunk with a fitting checksum begins."""
    for match in _CHUNK_START.finditer(data, start):
        if _sound_end(data, match.start()) is not None:
            return match.start()
    return None
