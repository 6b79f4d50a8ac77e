"""Samples and log lines out of opened chunks."""

import json
import struct
from collections.abc import Collection
from contextlib import suppress
from typing import Any, Final, NamedTuple

from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from rig.log.mcap import schema
from rig.log.mcap.columns import GrowingSamples, Layout, Samples, layout_of, run_length
from rig.log.mcap.contents import Contents
from rig.log.mcap.framing import HEAD, MESSAGE_HEAD, Block, DamageError, Unpacker, blocks, unpacked_limit
from rig.number_text import counted
from rig.sample import WIRES

_BATCH_BYTES: Final = 1 << 20
"""As much as fits into a processor's cache: records are taken apart column by column."""
_USUAL_RATIO: Final = 4
"""How much larger than the file the records of a recorder's are; beyond that a claim is believed when it is met."""
_CHANGE_BYTES: Final = 20_000
"""What a change from one channel of samples to another counts for: each makes a part of its own."""
_HEADS = struct.Struct("<BQH")
"""Opcode, length, and a message's channel."""
_PRIVATE_OPCODES: Final = 0x80
"""From here on records belong to who wrote the file, and are passed over."""
_LEVELS = {value: name for name, value in schema.LOG_LEVELS.items()}


class LogLine(NamedTuple):
    """One message of `/log`."""

    time_ns: int
    level: str
    message: str


class SampleCollector:
    """Walks through the records of chunks and keeps samples, their fields `names`, and log lines, of a file of
    `file_bytes` bytes."""

    def __init__(self, contents: Contents, file_bytes: int, names: Collection[str] = tuple(WIRES)) -> None:
        self.contents = contents
        self._room = unpacked_limit(file_bytes)
        self.lines: list[LogLine] = []
        self._layouts: dict[int, Layout | None] = {}
        self._current: Layout | None = None
        self._records = bytearray()
        claimed = sum(chunk.size for chunk in contents.chunks)
        self._kept = GrowingSamples(names, min(claimed, _USUAL_RATIO * file_bytes))

    def feed(self, data: bytes, place: int) -> None:
        """The records of one chunk that stands at byte `place`; DamageError when one is broken."""
        view, offset = memoryview(data), 0
        try:
            while offset < len(view):
                end = self._run(data, offset)
                offset = end if end > offset else self._single(next(blocks(view, offset, len(view))), data)
        except DamageError as error:
            raise DamageError(place, f"inside the chunk, {error}") from None
        except ValueError as error:
            raise DamageError(place, f"inside the chunk: {error}") from None

    def all_chunks(self, data: memoryview) -> Samples:
        """The samples of every chunk that the contents name, of the file `data`; DamageError as for `feed`."""
        unpacker = Unpacker(len(data))
        for chunk in self.contents.chunks:
            self.feed(unpacker.open(chunk), chunk.start)
        return self.samples()

    def samples(self) -> Samples:
        """All samples fed so far; DamageError as for `feed`."""
        try:
            self._convert()
        except ValueError as error:
            raise DamageError(0, f"inside a chunk: {error}") from None
        return self._kept.samples()

    def _run(self, data: bytes, offset: int) -> int:
        """Take the samples in their usual arrangement that start at `offset`; returns where they end, `offset` for
        none.

        Messages that are of no interest here are passed over in the same way.
        """
        if data[offset] != Opcode.MESSAGE or len(data) - offset < HEAD.size + MESSAGE_HEAD.size:
            return offset
        channel = MESSAGE_HEAD.unpack_from(data, offset + HEAD.size)[0]
        layout = self._layout(channel)
        if layout is None:
            return offset if self._is_log(channel) else _skip_messages(data, offset, channel)
        count = run_length(data, offset, layout)
        end = offset + count * layout.message.itemsize
        if count:
            self._keep(layout, memoryview(data)[offset:end])
        return end

    def _single(self, block: Block, data: bytes) -> int:
        """Take one record of any kind; returns where it ends."""
        if block.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            if self.contents.define(block):
                self._layouts.clear()
        elif block.opcode == Opcode.MESSAGE:
            self._message(block, data)
        elif block.opcode < _PRIVATE_OPCODES:
            raise DamageError(block.start, f"a record (opcode {block.opcode}) that has no place in a chunk")
        return block.end

    def _message(self, block: Block, data: bytes) -> None:
        if len(block.body) < MESSAGE_HEAD.size:
            raise DamageError(block.start, f"a message of {counted(len(block.body), 'byte')}, too few for its head")
        channel, _, log_time, _ = MESSAGE_HEAD.unpack_from(block.body)
        layout = self._layout(channel)
        if layout is not None:
            self._pack_again(layout, block, data)
        elif self._is_log(channel):
            self.lines.append(_log_line(log_time, bytes(block.body[MESSAGE_HEAD.size :])))

    def _pack_again(self, layout: Layout, block: Block, data: bytes) -> None:
        """A sample in another arrangement, which may be far shorter than ours: it counts for as much as it becomes."""
        self._room -= layout.message.itemsize
        if self._room < 0:
            raise DamageError(block.start, "more samples than a file of this size may hold")
        self._keep(layout, memoryview(layout.pack_again(data[block.start : block.end])))

    def _is_log(self, channel: int) -> bool:
        return channel in self.contents.channels and self.contents.channels[channel].topic == schema.LOG_TOPIC

    def _layout(self, channel_id: int) -> Layout | None:
        """How samples lie in that channel; None when it is not a channel of samples."""
        if channel_id not in self._layouts:
            channel = self.contents.channels.get(channel_id)
            kind = self.contents.schemas.get(channel.schema_id) if channel else None
            layout = None
            if channel is not None and kind is not None and is_sample_channel(channel, kind):
                layout = layout_of(kind.data, kind.name, channel_id, exact=channel_id in self.contents.assumed)
            self._layouts[channel_id] = layout
        return self._layouts[channel_id]

    def _keep(self, layout: Layout, records: memoryview) -> None:
        if self._current is not layout:
            self._room -= _CHANGE_BYTES
            if self._room < 0:
                raise ValueError("more changes between channels of samples than a file of this size may hold")
        if self._current is not layout or len(self._records) > _BATCH_BYTES:
            self._convert()
            self._current = layout
        self._records += records

    def _convert(self) -> None:
        if self._current is not None and self._records:
            self._kept.add(self._current, self._records)
        self._records = bytearray()


def is_sample_channel(channel: Channel, kind: Schema) -> bool:
    """Whether the channel carries our samples."""
    return (channel.topic, kind.name, kind.encoding) == (schema.SAMPLE_TOPIC, schema.SAMPLE_SCHEMA, "protobuf")


def _skip_messages(data: bytes, offset: int, channel: int) -> int:
    """Where the messages of that channel that begin at `offset` end; the last may reach beyond the chunk, which is then
    found out."""
    while len(data) - offset >= _HEADS.size:
        opcode, length, number = _HEADS.unpack_from(data, offset)
        if (
            opcode != Opcode.MESSAGE
            or number != channel
            or length < MESSAGE_HEAD.size
            or length > len(data) - offset - HEAD.size
        ):
            break
        offset += HEAD.size + length
    return offset


def _log_line(time_ns: int, data: bytes) -> LogLine:
    fields: Any = None
    with suppress(ValueError, RecursionError):
        fields = json.loads(data)
    if not isinstance(fields, dict):
        return LogLine(time_ns, "unknown", data.decode("utf-8", "replace"))
    number = fields.get("level")
    level = _LEVELS.get(number, "unknown") if isinstance(number, int) else "unknown"
    return LogLine(time_ns, level, str(fields.get("message", "")))
