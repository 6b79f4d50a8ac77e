"""What an MCAP file holds beside its messages, each piece believed only when its CRC holds."""

import mmap
import struct
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, DataEnd, Footer, Header, Metadata, Schema, Statistics

from rig.config import check_regular
from rig.errors import RecordError
from rig.log.mcap import schema
from rig.log.mcap.framing import MAGIC, Block, Chunk, DamageError, blocks, parse, parse_chunk

_SKIPPED = frozenset(int(opcode) for opcode in (Opcode.MESSAGE_INDEX, Opcode.CHUNK_INDEX))
"""What only says where other records lie; there are as many as chunks, so they are told apart quickly."""

_FOOTER_BYTES = 29
_CHUNK_INDEX_HEAD = struct.Struct("<QQQQ")
"""First and last time, offset and length of the chunk."""


@dataclass
class Contents:
    """What stands in a file outside its messages."""

    library: str = ""
    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    assumed: set[int] = field(default_factory=set)
    """Channels that the file has not defined so far, taken for ours in a rescue."""
    metadata: list[Metadata] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    chunks: list[Chunk] = field(default_factory=list)
    loose: list[Block] = field(default_factory=list)
    """Messages that stand outside chunks, as some writers do it."""
    statistics: Statistics | None = None
    finished: bool = False
    """The file has its end mark."""
    ends: set[int] = field(default_factory=set)
    """Opcodes seen of those that end the data and the file: each stands once, for its CRC goes over all that is before
    it."""

    def facts(self, name: str) -> dict[str, Any]:
        """The facts of the last metadata record of that name, empty without one."""
        return next(
            (schema.facts_from_text(item.metadata) for item in reversed(self.metadata) if item.name == name), {}
        )

    def describe_channels(self) -> str:
        """Every channel with what it carries, for a message."""
        named = ((channel, self.schemas.get(channel.schema_id)) for channel in self.channels.values())
        texts = (
            f"{channel.topic} ({channel.message_encoding}, {kind.name if kind else 'no schema'})"
            for channel, kind in named
        )
        return ", ".join(texts) or "no channels"

    def take(self, block: Block, data: memoryview) -> None:
        """Add what one record of the file says; DamageError when it is broken or its CRC does not hold."""
        if block.opcode in _SKIPPED:
            return
        match block.opcode:
            case Opcode.CHUNK:
                self.chunks.append(parse_chunk(block))
            case Opcode.MESSAGE:
                self.loose.append(block)
            case Opcode.HEADER:
                self.library = parse(block, Header.read).library
            case Opcode.SCHEMA | Opcode.CHANNEL:
                self.define(block)
            case Opcode.METADATA:
                self.metadata.append(parse(block, Metadata.read))
            case Opcode.ATTACHMENT:
                self._attach(block)
            case Opcode.STATISTICS:
                self.statistics = parse(block, Statistics.read)
            case Opcode.DATA_END | Opcode.FOOTER:
                self.end(block, data)

    def end(self, block: Block, data: memoryview) -> None:
        """Hold the CRC of what ends the data or the file; DamageError when it fails, or when the end has been
        already."""
        if block.opcode in self.ends:
            raise DamageError(block.start, f"a second {Opcode(block.opcode).name.lower().replace('_', ' ')}")
        self.ends.add(block.opcode)
        (hold_data_crc if block.opcode == Opcode.DATA_END else hold_summary_crc)(block, data)

    def define(self, block: Block) -> bool:
        """Add the schema or the channel in `block`, from the file or from inside a chunk; whether that changes
        anything."""
        if block.opcode == Opcode.SCHEMA:
            item = parse(block, Schema.read)
            changed = bool(self.schemas.get(item.id) != item)
            self.schemas[item.id] = item
            return changed
        channel = parse(block, Channel.read)
        changed = channel.id in self.assumed or self.channels.get(channel.id) != channel
        self.channels[channel.id] = channel
        self.assumed.discard(channel.id)
        return changed

    def _attach(self, block: Block) -> None:
        item = parse(block, Attachment.read)
        if not attachment_holds(block):
            raise DamageError(block.start, f"the attachment {item.name!r}, whose CRC does not hold")
        self.attachments[item.name] = bytes(item.data)


def walk(data: memoryview) -> Contents:
    """Everything in a whole MCAP file but its messages; DamageError where it is not whole."""
    require_magic(data)
    contents = Contents()
    end = len(data) - len(MAGIC) if bytes(data[-len(MAGIC) :]) == MAGIC and len(data) > len(MAGIC) else len(data)
    for block in blocks(data, len(MAGIC), end):
        contents.take(block, data)
        contents.finished = block.opcode == Opcode.FOOTER
    if not contents.finished or end == len(data):
        raise DamageError(len(data), "the file ends without its end mark: it was not finished")
    return contents


def indexed(data: memoryview, first_ns: int, last_ns: int) -> Contents | None:
    """Definitions and the chunks that touch first_ns..last_ns, by the summary of a whole file; None without one that
    proves itself."""
    place = len(data) - len(MAGIC) - _FOOTER_BYTES
    try:
        if place < 0 or bytes(data[-len(MAGIC) :]) != MAGIC:
            return None
        block = next(blocks(data, place, len(data) - len(MAGIC)))
        if block.opcode != Opcode.FOOTER or block.end != len(data) - len(MAGIC):
            return None
        footer = parse(block, Footer.read)
        if not footer.summary_crc or not footer.summary_start:
            return None
        hold_summary_crc(block, data)
        contents = Contents(finished=True)
        for item in blocks(data, footer.summary_start, block.start):
            if item.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                contents.define(item)
            elif item.opcode == Opcode.CHUNK_INDEX:
                first, last, start, length = _CHUNK_INDEX_HEAD.unpack_from(item.body)
                if first <= last_ns and last >= first_ns:
                    contents.chunks.append(parse_chunk(next(blocks(data, start, start + length))))
    except (DamageError, StopIteration, struct.error):
        return None
    return contents if contents.channels else None


def attachment_holds(block: Block) -> bool:
    """Whether the CRC at the end of an attachment holds, or none was written."""
    crc = int.from_bytes(block.body[-4:], "little")
    return not crc or crc == zlib.crc32(block.body[:-4])


def require_magic(data: memoryview) -> None:
    """DamageError when this is not the start of an MCAP file."""
    if len(data) == 0:
        raise DamageError(0, "the file is empty")
    if bytes(data[: len(MAGIC)]) != MAGIC:
        raise DamageError(0, "this is not an MCAP file")


def map_file(path: Path) -> memoryview:
    """The bytes of a file, read as they are touched; RecordError when it cannot be opened."""
    try:
        check_regular(path)
        with path.open("rb") as file:
            try:
                return memoryview(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
            except ValueError:  # an empty file cannot be mapped
                return memoryview(b"")
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror}") from None


def let_go(data: memoryview) -> None:
    """Give the pages of a mapped file back, which are read again when they are touched: memory is for its columns."""
    if isinstance(data.obj, mmap.mmap) and hasattr(mmap, "MADV_DONTNEED"):  # Linux
        data.obj.madvise(mmap.MADV_DONTNEED)


def hold_data_crc(block: Block, data: memoryview) -> None:
    """DamageError when the CRC in the record that ends the data is not that of everything before it."""
    crc = parse(block, DataEnd.read).data_section_crc
    if crc and crc != zlib.crc32(data[: block.start]):
        raise DamageError(block.start, "the CRC over all data does not hold: some byte before this was changed")


def hold_summary_crc(block: Block, data: memoryview) -> None:
    """DamageError when the CRC in the footer is not that of the summary before it."""
    footer = parse(block, Footer.read)
    if footer.summary_start > block.start:
        raise DamageError(block.start, "a footer that points beyond itself")
    start = footer.summary_start or block.start
    if footer.summary_crc and footer.summary_crc != zlib.crc32(data[start : block.end - 4]):
        raise DamageError(block.start, "the CRC over the summary does not hold")
