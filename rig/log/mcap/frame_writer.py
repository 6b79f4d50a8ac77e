"""Writes the frame of an MCAP file: chunks, indexes, summary, CRCs. Pure Python; what goes into it is
rig.log.mcap.writer's affair.

mcap's own writer spends most of its time on one message; here a message costs one struct and one append, whole runs of
messages go in at once, and the level of compression can be chosen. Every record but messages and chunks is written by
mcap's classes.
"""

import struct
import zlib
from array import array
from collections.abc import Mapping, Sequence
from typing import Final, Protocol

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from rig.log.mcap.compression import best_compression
from rig.log.mcap.framing import HEAD, MAGIC, MESSAGE_HEAD, MESSAGE_INDEX_HEAD

_MESSAGE: Final = struct.Struct("<BQHIQQ")
_CHUNK: Final = struct.Struct("<QQQI")
_FOOTER_CRC: Final = struct.Struct("<BQQQ")


class Stream(Protocol):
    """Where the bytes go."""

    def write(self, data: bytes) -> int:
        """Take all of `data`."""

    def tell(self) -> int:
        """How many bytes were taken so far."""


class McapWriter:
    """One MCAP file, from its magic to its magic. The stream must be at its beginning."""

    def __init__(self, stream: Stream, library: str) -> None:
        self._stream = stream
        self._compression, self._compress = best_compression()
        self._data_crc = 0
        self._schemas: list[Schema] = []
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._first_ns: int | None = None
        self._last_ns = 0
        self._chunk = bytearray()
        self._index: dict[int, array[int]] = {}
        self._put(MAGIC)
        self._put(_bytes_of(Header(profile="", library=library)))

    def add_schema(self, name: str, encoding: str, data: bytes) -> int:
        """A schema, into the current chunk; returns its number."""
        item = Schema(id=len(self._schemas) + 1, name=name, encoding=encoding, data=data)
        self._schemas.append(item)
        self._chunk += _bytes_of(item)
        return item.id

    def add_channel(self, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]) -> int:
        """A channel, into the current chunk; returns its number."""
        number = len(self._channels) + 1
        item = Channel(id=number, topic=topic, message_encoding=encoding, schema_id=schema_id, metadata=dict(metadata))
        self._channels.append(item)
        self._counts[number] = 0
        self._chunk += _bytes_of(item)
        return number

    def add_message(self, channel: int, sequence: int, time_ns: int, data: bytes | memoryview) -> None:
        """One message; `time_ns` is both its log time and its publish time."""
        index = self._index.get(channel)
        if index is None:
            index = self._index[channel] = array("Q")
        index.append(time_ns)
        index.append(len(self._chunk))
        self._chunk += _MESSAGE.pack(Opcode.MESSAGE, MESSAGE_HEAD.size + len(data), channel, sequence, time_ns, time_ns)
        self._chunk += data

    def add_records(self, channel: int, records: bytes | memoryview, times_ns: Sequence[int]) -> None:
        """Whole message records of `channel`, all of one length, with their log times."""
        count = len(times_ns)
        start, size = len(self._chunk), len(records) // count
        index = self._index.setdefault(channel, array("Q"))
        added = array("Q", bytes(16 * count))
        added[0::2] = array("Q", times_ns)
        added[1::2] = array("Q", range(start, start + count * size, size))
        index += added
        self._chunk += records

    def close_chunk(self) -> None:
        """Compress what is in the current chunk and hand it to the stream with its index; nothing without messages."""
        if not self._index:
            return
        data = bytes(self._chunk)
        first_ns = min(min(index[0::2]) for index in self._index.values())
        last_ns = max(max(index[0::2]) for index in self._index.values())
        packed = self._compress(data)
        name = self._compression.encode()
        body = b"".join((
            _CHUNK.pack(first_ns, last_ns, len(data), zlib.crc32(data)),
            struct.pack("<I", len(name)),
            name,
            struct.pack("<Q", len(packed)),
            packed,
        ))  # fmt: skip
        start = self._stream.tell()
        self._put(HEAD.pack(Opcode.CHUNK, len(body)) + body)
        offsets, length = self._put_index()
        self._chunks.append(
            ChunkIndex(
                message_start_time=first_ns,
                message_end_time=last_ns,
                chunk_start_offset=start,
                chunk_length=HEAD.size + len(body),
                message_index_offsets=offsets,
                message_index_length=length,
                compression=self._compression,
                compressed_size=len(packed),
                uncompressed_size=len(data),
            )
        )
        self._first_ns = first_ns if self._first_ns is None else min(self._first_ns, first_ns)
        self._last_ns = max(self._last_ns, last_ns)
        self._chunk.clear()
        self._index.clear()

    def add_metadata(self, name: str, texts: Mapping[str, str]) -> None:
        """A named map of texts, outside the chunks."""
        start, data = self._stream.tell(), _bytes_of(Metadata(name=name, metadata=dict(texts)))
        self._metadata.append(MetadataIndex(offset=start, length=len(data), name=name))
        self._put(data)

    def add_attachment(self, name: str, media_type: str, data: bytes, time_ns: int) -> None:
        """A file inside the file."""
        record = _bytes_of(
            Attachment(create_time=time_ns, log_time=time_ns, name=name, media_type=media_type, data=data)
        )
        times = {"log_time": time_ns, "create_time": time_ns}
        self._attachments.append(
            AttachmentIndex(
                offset=self._stream.tell(),
                length=len(record),
                data_size=len(data),
                name=name,
                media_type=media_type,
                **times,
            )
        )
        self._put(record)

    def finish(self) -> None:
        """Close the chunk and write everything that follows the data."""
        self.close_chunk()
        self._put(_bytes_of(DataEnd(self._data_crc)))
        start = self._stream.tell()
        summary, offsets = bytearray(), bytearray()
        groups: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        for opcode, items in groups:
            if items:
                group = b"".join(_bytes_of(item) for item in items)
                offsets += _bytes_of(SummaryOffset(opcode, start + len(summary), len(group)))
                summary += group
        head = _FOOTER_CRC.pack(Opcode.FOOTER, 20, start, start + len(summary))
        crc = zlib.crc32(head, zlib.crc32(summary + offsets))
        self._put(bytes(summary + offsets) + _bytes_of(Footer(start, start + len(summary), crc)) + MAGIC)

    def _put(self, data: bytes) -> None:
        self._data_crc = zlib.crc32(data, self._data_crc)
        self._stream.write(data)

    def _put_index(self) -> tuple[dict[int, int], int]:
        """The message index of the current chunk: where each channel's stands, and the length of all."""
        start, offsets, data = self._stream.tell(), {}, bytearray()
        for channel, index in self._index.items():
            offsets[channel] = start + len(data)
            entries = index.tobytes()  # little-endian on every machine that this runs on
            data += HEAD.pack(Opcode.MESSAGE_INDEX, MESSAGE_INDEX_HEAD.size + len(entries))
            data += MESSAGE_INDEX_HEAD.pack(channel, len(entries)) + entries
            self._counts[channel] += len(index) // 2
        self._put(bytes(data))
        return offsets, len(data)

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(self._chunks),
            message_count=sum(self._counts.values()),
            message_end_time=self._last_ns,
            message_start_time=self._first_ns or 0,
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _bytes_of(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    data: bytes = builder.end()  # type: ignore[no-untyped-call]
    return data
