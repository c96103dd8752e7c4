"""What Foxglove's ``mcap doctor`` finds wrong with an MCAP file, and a little more.

Written after its published list of checks; like it, errors and warnings are sentences. In
addition to the doctor it wants monotone log times strictly and every message in a chunk.
"""

import zlib
from dataclasses import dataclass, field

import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    MessageIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader

_MAGIC = b"\x89MCAP0\r\n"


@dataclass(slots=True)
class _Chart:
    """What the doctor has seen so far."""

    problems: list[str] = field(default_factory=list)
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    summary: set[tuple[str, int]] = field(default_factory=set)
    counts: dict[int, int] = field(default_factory=dict)
    first_ns: int | None = None
    last_ns: int = 0
    in_summary: bool = False
    chunks: dict[int, tuple[Chunk, int, set[int]]] = field(default_factory=dict)
    indexes: list[ChunkIndex] = field(default_factory=list)
    statistics: list[Statistics] = field(default_factory=list)


def examine(path):
    """Return everything that is wrong with a file, a sentence each; an empty list is good."""
    chart = _Chart()
    content = path.read_bytes()
    if not (content.startswith(_MAGIC) and content.endswith(_MAGIC)):
        return ["The file does not start and end with the magic bytes."]
    kinds = []
    with path.open("rb") as file:
        reader = StreamReader(file, emit_chunks=True, validate_crcs=True)
        pending = None
        start = len(_MAGIC)
        for record in reader.records:
            if pending and not isinstance(record, MessageIndex):
                _examine_chunk(chart, *pending)
                pending = None
            if isinstance(record, Chunk):
                pending = (record, start, file.tell() - start, [])
            elif isinstance(record, MessageIndex):
                if pending is None:
                    chart.problems.append("A message index follows no chunk.")
                else:
                    pending[3].append(record)
            else:
                _examine_record(chart, record)
            kinds.append(type(record))
            start = file.tell()
    if DataEnd not in kinds or Footer not in kinds:
        chart.problems.append("There is no DataEnd or no Footer.")
    if kinds[0] is not Header:
        chart.problems.append("The first record is no Header.")
    _examine_indexes(chart)
    _examine_statistics(chart)
    return chart.problems


def _examine_record(chart, record):
    match record:
        case Header():
            if not record.library:
                chart.problems.append("Header.library is empty.")
            if record.profile not in {"", "ros1", "ros2"}:
                chart.problems.append(f"Header.profile {record.profile!r} is not well known.")
        case Schema():
            _examine_schema(chart, record)
        case Channel():
            _examine_channel(chart, record)
        case Message():
            chart.problems.append("A message lies outside the chunks.")
        case DataEnd():
            chart.in_summary = True
        case ChunkIndex():
            chart.indexes.append(record)
        case Statistics():
            chart.statistics.append(record)
        case _:
            pass


def _examine_schema(chart, schema):
    if not schema.encoding or not schema.data:
        chart.problems.append(f"Schema {schema.name!r} has no encoding or no data.")
    if schema.id == 0:
        chart.problems.append("Schema id 0 is reserved.")
    _examine_twin(chart, "schema", schema, chart.schemas)


def _examine_channel(chart, channel):
    _examine_twin(chart, "channel", channel, chart.channels)
    if channel.schema_id and channel.schema_id not in chart.schemas:
        chart.problems.append(f"Channel {channel.topic!r} has an unknown schema.")


def _examine_twin(chart, what, record, known):
    previous = known.get(record.id)
    if previous is not None and previous != record:
        chart.problems.append(f"Two {what}s of id {record.id} differ.")
    if not chart.in_summary:
        if previous is not None:
            chart.problems.append(f"The {what} {record.id} stands twice in the data section.")
        known[record.id] = record
        return
    chart.summary.add((what, record.id))
    if previous is None:
        chart.problems.append(f"The {what} {record.id} stands in the summary alone.")


def _examine_chunk(chart, chunk, start, length, indexes):
    data = _unpacked(chart, chunk)
    if data is None:
        return
    by_channel = {}
    for index in indexes:
        if index.channel_id in by_channel:
            chart.problems.append(f"Channel {index.channel_id} has two message indexes.")
        by_channel[index.channel_id] = {offset: time for time, offset in index.records}
    times, used = [], set()
    for offset, record in _records_in(data):
        match record:
            case Schema():
                _examine_schema(chart, record)
            case Channel():
                _examine_channel(chart, record)
            case Message():
                used.add(record.channel_id)
                times.append(record.log_time)
                _examine_message(chart, record, offset, by_channel)
            case _:
                chart.problems.append(f"A chunk holds a record of kind {record}.")
    if times and (min(times), max(times)) != (chunk.message_start_time, chunk.message_end_time):
        chart.problems.append("A chunk states other times than its messages have.")
    chart.chunks[start] = (chunk, length, used)


def _unpacked(chart, chunk):
    if chunk.compression not in {"", "zstd"}:
        chart.problems.append(f"The compression {chunk.compression!r} is not supported.")
        return None
    data = chunk.data
    if chunk.compression == "zstd":
        data = zstandard.decompress(data, chunk.uncompressed_size)
    if len(data) != chunk.uncompressed_size:
        chart.problems.append("A chunk is not as long as it says.")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        chart.problems.append("A chunk's checksum is wrong.")
    return data


def _records_in(data):
    stream, offset = ReadDataStream(_Bytes(data)), 0
    while offset < len(data):
        opcode, length = stream.read1(), stream.read8()
        match opcode:
            case Opcode.SCHEMA:
                yield offset, Schema.read(stream)
            case Opcode.CHANNEL:
                yield offset, Channel.read(stream)
            case Opcode.MESSAGE:
                yield offset, Message.read(stream, length)
            case _:
                stream.read(length)
                yield offset, opcode
        offset += 9 + length


class _Bytes:
    """Bytes that are read from front to back."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def read(self, length):
        self._at += length
        return self._data[self._at - length : self._at]


def _examine_message(chart, message, offset, by_channel):
    if message.channel_id not in chart.channels:
        chart.problems.append(f"A message comes before its channel {message.channel_id}.")
    if message.log_time < chart.last_ns:
        chart.problems.append(f"The log time {message.log_time} is before {chart.last_ns}.")
    chart.last_ns = max(chart.last_ns, message.log_time)
    first = message.log_time if chart.first_ns is None else chart.first_ns
    chart.first_ns = min(first, message.log_time)
    chart.counts[message.channel_id] = chart.counts.get(message.channel_id, 0) + 1
    entries = by_channel.get(message.channel_id)
    if entries is None:
        chart.problems.append(f"There is no message index for channel {message.channel_id}.")
    elif offset not in entries:
        chart.problems.append(f"A message at {offset} is not in its index.")
    elif entries[offset] != message.log_time:
        chart.problems.append("A message index states another time than the message.")


def _examine_indexes(chart):
    starts = [index.chunk_start_offset for index in chart.indexes]
    if len(set(starts)) < len(starts):
        chart.problems.append("A chunk has several chunk indexes.")
    if set(starts) != set(chart.chunks):
        chart.problems.append("The chunk indexes point elsewhere than to all chunks.")
    for index in chart.indexes:
        if index.chunk_start_offset not in chart.chunks:
            continue
        chunk, length, used = chart.chunks[index.chunk_start_offset]
        stated = (
            index.chunk_length,
            index.message_start_time,
            index.message_end_time,
            index.compression,
            index.compressed_size,
            index.uncompressed_size,
        )
        found = (
            length,
            chunk.message_start_time,
            chunk.message_end_time,
            chunk.compression,
            len(chunk.data),
            chunk.uncompressed_size,
        )
        if stated != found:
            chart.problems.append(f"A chunk index says {stated}, its chunk is {found}.")
        for channel in used:
            schema = chart.channels[channel].schema_id if channel in chart.channels else 0
            if {("channel", channel), ("schema", schema)} - chart.summary:
                chart.problems.append(f"Channel {channel} is not repeated in the summary.")


def _examine_statistics(chart):
    if len(chart.statistics) != 1:
        chart.problems.append(f"There are {len(chart.statistics)} Statistics records.")
        return
    stated = chart.statistics[0]
    if chart.counts and (stated.message_start_time, stated.message_end_time) != (
        chart.first_ns,
        chart.last_ns,
    ):
        chart.problems.append("The statistics state other times than the messages have.")
    if stated.message_count != sum(chart.counts.values()):
        chart.problems.append(f"The statistics count {stated.message_count} messages.")
    if {c: n for c, n in stated.channel_message_counts.items() if n} != chart.counts:
        chart.problems.append("The statistics count other messages a channel.")
