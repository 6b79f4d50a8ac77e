"""Everything in a damaged MCAP file that proves itself, and a list of where it is damaged.

A piece counts only when its own CRC holds: chunks, attachments, and our metadata. After damage the search goes on at
the next byte, so that a flipped length hides nothing that follows it. What to do with the findings is up to check and
recover.
"""

import re
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema, Statistics

from rig.log.mcap import schema
from rig.log.mcap.contents import Contents, attachment_holds
from rig.log.mcap.framing import (
    HEAD,
    MAGIC,
    MESSAGE_INDEX_HEAD,
    Block,
    Chunk,
    DamageError,
    Unpacker,
    blocks,
    parse,
    parse_chunk,
    unpacked_limit,
)

_CANDIDATE: Final = re.compile(
    rb"\x06.{36}(?:\x04\0\0\0zstd|\x03\0\0\0lz4|\0\0\0\0)"  # a chunk, up to the name of its compression
    rb"|\x09.{24}.\0\0\0"  # an attachment with a name of fewer than 256 bytes
    rb"|\x0c.{8}\x0a\0\0\0pamrig\.run|\x0c.{8}\x0d\0\0\0pamrig\.result",
    re.DOTALL,
)
_FIXED_LENGTHS = {Opcode.FOOTER: 20, Opcode.DATA_END: 4}


class DamagedStretch(NamedTuple):
    """A stretch of the file that says nothing one can trust."""

    start: int
    end: int
    what: str


@dataclass
class Salvage:
    """What proved itself."""

    contents: Contents = field(default_factory=Contents)
    """Metadata of ours, attachments and chunks; schemas and channels only of this version (those of chunks come with
    them)."""
    damages: list[DamagedStretch] = field(default_factory=list)
    bytes: int = 0

    @property
    def whole(self) -> bool:
        """Nothing is damaged and the file was finished."""
        return not self.damages and self.contents.finished


def salvage(data: memoryview) -> Salvage:
    """Go through all of `data`, which need not even begin like an MCAP file."""
    found = Salvage(bytes=len(data))
    _assume_our_channels(found.contents)
    start = 0
    if bytes(data[: len(MAGIC)]) == MAGIC:
        start = len(MAGIC)
    else:
        found.damages.append(DamagedStretch(0, min(len(MAGIC), len(data)), "the file does not begin like an MCAP file"))
    unpacker = Unpacker(len(data))
    search = _Search(data, unpacker)
    while start < len(data):
        start = _stretch(data, start, found, unpacker, search)
    if not found.contents.finished and not (found.damages and found.damages[-1].end == len(data)):
        found.damages.append(
            DamagedStretch(len(data), len(data), "the file ends without its end mark: it was not finished")
        )
    return found


def _stretch(data: memoryview, start: int, found: Salvage, unpacker: Unpacker, search: "_Search") -> int:
    """Records one after the other until the end or the first damage; returns where to go on."""
    end = len(data) - len(MAGIC) if bytes(data[-len(MAGIC) :]) == MAGIC else len(data)
    try:
        for block in blocks(data, start, end):
            _believe(block, data, found, unpacker)
            start = block.end
            if block.opcode == Opcode.FOOTER:
                found.contents.finished = end < len(data)
                if start == end:
                    return len(data)
    except DamageError as error:
        after = search.begin(start + 1)
        found.damages.append(DamagedStretch(start, after, error.what))
        return after
    return len(data)


def _believe(block: Block, data: memoryview, found: Salvage, unpacker: Unpacker) -> None:
    """Add what the record proves; DamageError when it proves nothing, or its length is not to be trusted."""
    contents = found.contents
    match block.opcode:
        case Opcode.CHUNK:
            contents.chunks.append(_proven_chunk(block, unpacker))
        case Opcode.METADATA:
            contents.metadata.append(_proven_metadata(block))
        case Opcode.ATTACHMENT:
            contents.take(_proven_attachment(block), data)
        case Opcode.MESSAGE:
            raise DamageError(block.start, "a message outside chunks, which no CRC protects")
        case Opcode.DATA_END | Opcode.FOOTER:
            _end(block, data, found)
        case Opcode.STATISTICS:
            contents.statistics = parse(block, Statistics.read)
        case _:
            _require_own_length(block)


def _require_own_length(block: Block) -> None:
    """DamageError when a record that nothing protects is of unknown kind, or longer or shorter than its own content."""
    length = len(block.body)
    match block.opcode:
        case Opcode.HEADER:
            header = parse(block, Header.read)
            length = 8 + len(header.profile.encode()) + len(header.library.encode())
        case Opcode.MESSAGE_INDEX:
            length = MESSAGE_INDEX_HEAD.size + parse(block, _index_bytes)
        case _ if block.opcode not in set(Opcode):
            raise DamageError(block.start, f"an unknown record (opcode {block.opcode})")
    if length != len(block.body):
        raise DamageError(block.start, f"a broken {Opcode(block.opcode).name.lower().replace('_', ' ')} record")


def _index_bytes(stream: ReadDataStream) -> int:
    stream.read2()
    return stream.read4()


def _end(block: Block, data: memoryview, found: Salvage) -> None:
    """The end of the data or of the file. A CRC that fails because of damage already found is no further damage."""
    if len(block.body) != _FIXED_LENGTHS[Opcode(block.opcode)]:
        raise DamageError(block.start, "a broken record at the end")
    if found.damages:
        return
    try:
        found.contents.end(block, data)
    except DamageError as error:
        found.damages.append(DamagedStretch(block.start, block.start, error.what))


def _proven_chunk(block: Block, unpacker: Unpacker) -> Chunk:
    chunk = parse_chunk(block)
    if not chunk.crc:
        raise DamageError(block.start, "a chunk without a CRC")
    unpacker.open(chunk)
    return chunk


def _proven_metadata(block: Block) -> Metadata:
    item: Metadata = parse(block, Metadata.read)
    length = (
        8
        + len(item.name.encode())
        + sum(8 + len(key.encode()) + len(value.encode()) for key, value in item.metadata.items())
    )
    if length != len(block.body):
        raise DamageError(block.start, "a broken metadata record")
    if not schema.facts_intact(item.metadata):
        raise DamageError(block.start, f"the metadata {item.name[:40]!r}, which carry no CRC that holds")
    return item


def _proven_attachment(block: Block) -> Block:
    parse(block, Attachment.read)
    if not attachment_holds(block):
        raise DamageError(block.start, "an attachment whose CRC does not hold")
    return block


class _Search:
    """Looks for records that prove themselves; it gives up once it has gone over more bytes than a file of that size is
    worth.

    Heads that all claim the rest of the file would cost the square of its size.
    """

    def __init__(self, data: memoryview, unpacker: Unpacker) -> None:
        self._data, self._unpacker = data, unpacker
        self._left = unpacked_limit(len(data))

    def begin(self, start: int) -> int:
        """Where, from `start` on, the next such record begins; the end of the file when there is none."""
        position = start
        while self._left > 0 and (match := _CANDIDATE.search(self._data, position)) is not None:
            position = match.start() + 1
            if self._proves_itself(match.start()):
                return match.start()
        return len(self._data)

    def _proves_itself(self, start: int) -> bool:
        opcode, length = HEAD.unpack_from(self._data, start)
        if length > len(self._data) - start - HEAD.size:
            return False
        self._left -= length + HEAD.size
        try:
            _prove(Block(opcode, start, self._data[start + HEAD.size : start + HEAD.size + length]), self._unpacker)
        except DamageError:
            return False
        return True


def _prove(block: Block, unpacker: Unpacker) -> None:
    match block.opcode:
        case Opcode.CHUNK:
            _proven_chunk(block, unpacker)
        case Opcode.METADATA:
            _proven_metadata(block)
        case Opcode.ATTACHMENT:
            _proven_attachment(block)


def _assume_our_channels(contents: Contents) -> None:
    """The definitions stand in the first chunk; where that is lost, messages are tried as ours (each proves itself by
    its tags)."""
    contents.schemas = {
        1: Schema(id=1, name=schema.SAMPLE_SCHEMA, encoding="protobuf", data=schema.sample_descriptor_set()),
        2: Schema(id=2, name=schema.LOG_SCHEMA, encoding="jsonschema", data=schema.log_json_schema()),
    }
    contents.channels = {
        1: Channel(id=1, schema_id=1, topic=schema.SAMPLE_TOPIC, message_encoding="protobuf", metadata={}),
        2: Channel(id=2, schema_id=2, topic=schema.LOG_TOPIC, message_encoding="json", metadata={}),
    }
    contents.assumed = set(contents.channels)
