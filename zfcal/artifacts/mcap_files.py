"""MCAP files, closed or cut short: their metadata records and an overview of what they hold.

Decoding messages is the business of those who write them.
"""

from __future__ import annotations

import dataclasses
import io
import os
import struct
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import lz4.frame
import zstandard
from mcap.exceptions import EndOfFile, McapError, UnsupportedCompressionError
from mcap.records import Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk

from zfcal.artifacts.reading.limits import CHUNK_BYTES, largest
from zfcal.artifacts.reading.opening import open_regular, unreadable
from zfcal.errors import DamagedError

BROKEN = (
    McapError,
    ValueError,
    struct.error,
    zstandard.ZstdError,
    RuntimeError,  # lz4 has no error of its own
    OverflowError,  # a damaged size of what a chunk unpacks to
    MemoryError,  # the same
)
"""What reading a damaged MCAP file may raise."""


FRESH_S = 10.0
"""A file that changed so lately is taken to be growing still, or to be closed soon."""

_MAGIC = b"\x89MCAP0\r\n"
"""An MCAP file begins with it, and a closed one ends with it."""


@dataclass(slots=True, kw_only=True)
class Overview:
    """What an MCAP file holds, as far as it can be read.

    Parameters
    ----------
    profile, library
        From the header.
    schemas
        Name of the schema of each topic.
    counts
        Messages of each topic.
    metadata
        The metadata records by name.
    start_s, end_s
        Log time of the first and the last message, in seconds; None without messages.
    whole
        Whether the file ends as a closed one does.
    read_bytes, total_bytes
        How far reading came, and the file's size.
    problem
        Why reading stopped early; empty for a whole file.
    is_cut
        Whether it just ends too early: nothing before its end is damaged.
    """

    profile: str = ""
    library: str = ""
    schemas: dict[str, str] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    start_s: float | None = None
    end_s: float | None = None
    whole: bool = False
    read_bytes: int = 0
    total_bytes: int = 0
    problem: str = ""
    is_cut: bool = False

    @property
    def lost_bytes(self) -> int:
        """Bytes behind the last record that could be read."""
        return 0 if self.whole else self.total_bytes - self.read_bytes

    @property
    def loss(self) -> str:
        """How much is lost of a file that is not whole, in words."""
        return (
            f"{self.lost_bytes} of {self.total_bytes} bytes are lost, "
            f"{self.counts.total()} messages can be read"
        )


def overview(path: Path) -> Overview:
    """Read an MCAP file in file order, and as far as it goes when it was cut short.

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    DamagedError
        It is no MCAP file.
    """
    found = Overview()
    for _ in read_messages(path, found):
        pass
    return found


def read_messages(path: Path, found: Overview) -> Iterator[tuple[Channel, Message]]:
    """Yield the messages of an MCAP file in file order, as far as they can be read.

    Parameters
    ----------
    path
        The file; it may have been cut short, or still grow.
    found
        A new overview, which is filled in while the file is read: afterwards it
        says whether the file is whole, and what was lost.

    Yields
    ------
    channel : Channel
    message : Message

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    DamagedError
        It is no MCAP file.
    """
    channels: dict[int, Channel] = {}
    names: dict[int, str] = {}
    try:
        for record, position in _records(path, found):
            _note(record, found, channels, names)
            found.read_bytes = position
            if isinstance(record, Message):
                yield channels[record.channel_id], record
        found.whole = True
    except EndOfFile:
        found.is_cut = True
        found.problem = "the file ends in the middle of a record: it was cut short, or still grows"
    except BROKEN as error:
        found.problem = f"a damaged record ({error})"


def has_footer(path: Path) -> bool:
    """Return whether an MCAP file ends as a closed one does: nothing more will come.

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    """
    try:
        with open_regular(path) as file:
            file.seek(max(0, os.fstat(file.fileno()).st_size - len(_MAGIC)))
            return file.read() == _MAGIC
    except OSError as error:
        raise unreadable(path, error) from error


def read_metadata(path: Path, name: str) -> dict[str, str] | None:
    """Return a metadata record of an MCAP file, also of one that still grows; None if absent.

    Raises
    ------
    InputError
        The file is missing or cannot be opened.
    DamagedError
        It is no MCAP file, or is damaged before the record.
    """
    try:
        for record, _ in _records(path, Overview()):
            if isinstance(record, Metadata) and record.name == name:
                return dict(record.metadata)
    except EndOfFile:
        return None
    except BROKEN as error:
        raise DamagedError(
            f"{path}: a record is damaged ({error}).",
            hint=f"See how much of it can be read with: zfcal inspect {path}",
        ) from error
    return None


def unpacked(source: Any, *, skip_magic: bool = False) -> Iterator[McapRecord]:
    """Yield the records of an open file, and those of a chunk in its place.

    Raises
    ------
    EndOfFile, or one of BROKEN
        What is read is cut short, is damaged, or unpacks to more than is believed.
    """
    reader = StreamReader(
        source,
        skip_magic=skip_magic,
        emit_chunks=True,
        validate_crcs=True,
        record_size_limit=largest(CHUNK_BYTES),
    )
    for record in reader.records:
        if isinstance(record, Chunk):
            yield from records_of(record)
        else:
            yield record


def records_of(chunk: Chunk) -> list[McapRecord]:
    """Return the records of a chunk, which unpacks to what it claims and to no more.

    Raises
    ------
    EndOfFile, or one of BROKEN
        It does not, or is damaged.
    """
    most = largest(CHUNK_BYTES)
    if chunk.compression and chunk.uncompressed_size > most:
        message = f"a chunk claims to unpack to {chunk.uncompressed_size} bytes, at most {most} are"
        raise McapError(message)
    plain = dataclasses.replace(chunk, compression="", data=_plain(chunk))
    return breakup_chunk(plain, validate_crc=True)


def _plain(chunk: Chunk) -> bytes:
    """Return what a chunk holds; the library itself would unpack without end."""
    size = chunk.uncompressed_size
    if chunk.compression == "":
        return chunk.data
    if chunk.compression == "zstd":
        with zstandard.ZstdDecompressor().stream_reader(chunk.data) as reader:
            data = reader.read(size + 1)
    elif chunk.compression == "lz4":
        data = lz4.frame.LZ4FrameDecompressor().decompress(chunk.data, max_length=size + 1)
    else:
        raise UnsupportedCompressionError(chunk.compression)
    if len(data) != size:
        message = f"a chunk unpacks to another size than the {size} bytes that it claims"
        raise McapError(message)
    return bytes(data)


class _Bounded:
    """An open file that ends a reading which asks for more than is there.

    The library would take a part for the whole, and memory for a damaged length.
    """

    def __init__(self, file: io.BufferedReader, size: int) -> None:
        self._file = file
        self._left = size

    def read(self, length: int) -> bytes:
        """Return just so many bytes."""
        if length > self._left:
            raise EndOfFile
        self._left -= length
        return self._file.read(length)


def _records(path: Path, found: Overview) -> Iterator[tuple[McapRecord, int]]:
    """Yield each record and where the next one starts, in file order."""
    try:
        file = open_regular(path)
    except OSError as error:
        raise unreadable(path, error) from error
    with file:
        found.total_bytes = os.fstat(file.fileno()).st_size
        _check_magic(path, file, found.total_bytes)
        bounded: Any = _Bounded(file, found.total_bytes)
        for record in unpacked(bounded):
            yield record, file.tell()


def _check_magic(path: Path, file: io.BufferedReader, size: int) -> None:
    if size == 0:
        raise DamagedError(
            f"{path}: the file is empty (0 bytes).", hint="Remove it, or copy it again."
        )
    head = file.read(len(_MAGIC))
    file.seek(0)
    if head != _MAGIC:
        raise DamagedError(
            f"{path}: is not an MCAP file (it starts with {head!r}).",
            hint="Move it out of the trial, or copy the right file there.",
        )


def _note(
    record: McapRecord, found: Overview, channels: dict[int, Channel], names: dict[int, str]
) -> None:
    match record:
        case Header():
            found.profile, found.library = record.profile, record.library
        case Schema():
            names[record.id] = record.name
        case Channel():
            channels[record.id] = record
            found.schemas[record.topic] = names.get(record.schema_id, "")
        case Metadata():
            found.metadata[record.name] = dict(record.metadata)
        case Message():
            if record.channel_id not in channels:
                message = f"a message of the unknown channel {record.channel_id}"
                raise McapError(message)
            found.counts[channels[record.channel_id].topic] += 1
            seconds = record.log_time / 1e9
            found.start_s = seconds if found.start_s is None else min(found.start_s, seconds)
            found.end_s = seconds if found.end_s is None else max(found.end_s, seconds)
        case _:
            pass
