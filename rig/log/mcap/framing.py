"""The frame of an MCAP file: records one after the other, and chunks opened with their bounds and CRCs checked.

mcap's own reader stops at the first damage, returns short reads as if they were whole and trusts every length; a log
that is to be checked or rescued needs the offsets and the bounds. What the records say is in rig.log.mcap.reader.
"""

import struct
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from io import BytesIO
from typing import Any, Final, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode

from rig.log.mcap.compression import Decompressor
from rig.number_text import counted

T = TypeVar("T")

MAGIC: Final = b"\x89MCAP0\r\n"
HEAD: Final = struct.Struct("<BQ")
"""Opcode and length of the body that follows."""
MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
"""Channel, sequence, log time and publish time; the data follow."""
MESSAGE_INDEX_HEAD: Final = struct.Struct("<HI")

_CHUNK_HEAD = struct.Struct("<QQQII")
_LENGTH = struct.Struct("<Q")
_CHUNK_LIMIT = 64 << 20
_AHEAD_BYTES = 2 << 20
"""As much is opened while as much is worked on."""
_SMALL_LIMIT = 16 << 20
_RATIO_LIMIT = 100
"""How much larger than the file its content may become (ours: 3 to 20), beyond the limit of small ones."""


class DamageError(Exception):
    """Bytes that are not what the format says must be there."""

    def __init__(self, offset: int, what: str) -> None:
        super().__init__(f"byte {offset}: {what}")
        self.offset = offset
        self.what = what


@dataclass(slots=True)
class Block:
    """One record of the file: where it starts, and its body."""

    opcode: int
    start: int
    body: memoryview

    @property
    def end(self) -> int:
        return self.start + HEAD.size + len(self.body)


@dataclass(frozen=True)
class Chunk:
    """The head of a chunk and its data, still compressed. Times are nanoseconds since the Unix epoch."""

    start: int
    first_ns: int
    last_ns: int
    size: int
    """Bytes when decompressed, as claimed."""
    crc: int
    """0: none was written."""
    compression: str
    packed: memoryview


def unpacked_limit(file_bytes: int) -> int:
    """How many bytes a log file of that size may become in memory; more is a bomb, not a log."""
    return max(_SMALL_LIMIT, _RATIO_LIMIT * file_bytes)


def blocks(data: memoryview, start: int, end: int) -> Iterator[Block]:
    """The records between two offsets of `data`; DamageError at the first that does not fit in."""
    while start < end:
        if end - start < HEAD.size:
            raise DamageError(
                start, f"{counted(end - start, 'byte is', 'bytes are')} too few for a record: the file is cut here"
            )
        opcode, length = HEAD.unpack_from(data, start)
        if length > end - start - HEAD.size:
            raise DamageError(
                start,
                f"a record (opcode {opcode}) of {counted(length, 'byte')} where {end - start - HEAD.size} are left",
            )
        block = Block(opcode, start, data[start + HEAD.size : start + HEAD.size + length])
        yield block
        start = block.end


def parse(block: Block, read: Callable[..., T], *more: Any) -> T:
    """The record in `block` by one of mcap's `read` functions; DamageError when the body is not one."""
    try:
        return read(ReadDataStream(BytesIO(block.body)), *more)
    except (McapError, ValueError, struct.error, OverflowError) as error:
        name = (
            Opcode(block.opcode).name.lower().replace("_", " ")
            if block.opcode in set(Opcode)
            else f"opcode {block.opcode}"
        )
        raise DamageError(block.start, f"a broken {name} record ({type(error).__name__})") from None


def parse_chunk(block: Block) -> Chunk:
    """The head of the chunk in `block`; DamageError when its lengths do not add up."""
    body = block.body
    try:
        first_ns, last_ns, size, crc, name_length = _CHUNK_HEAD.unpack_from(body)
        name = bytes(body[_CHUNK_HEAD.size : _CHUNK_HEAD.size + name_length]).decode("ascii")
        (packed_length,) = _LENGTH.unpack_from(body, _CHUNK_HEAD.size + name_length)
    except (struct.error, UnicodeDecodeError):
        raise DamageError(block.start, "a chunk whose head is broken") from None
    packed = body[_CHUNK_HEAD.size + name_length + _LENGTH.size :]
    if len(packed) != packed_length:
        raise DamageError(
            block.start, f"a chunk with {counted(len(packed), 'byte')} of data where its head says {packed_length}"
        )
    return Chunk(block.start, first_ns, last_ns, size, crc, name, packed)


class Unpacker:
    """Opens chunks, within a budget that a file of `file_bytes` bytes may claim: no memory bomb gets through."""

    def __init__(self, file_bytes: int) -> None:
        self._budget = unpacked_limit(file_bytes)
        self._decompressor = Decompressor()

    def open(self, chunk: Chunk) -> bytes:
        """The records of the chunk, CRC checked; DamageError when they are not what the head says."""
        return _checked(chunk, self._unpacked(chunk))

    def _unpacked(self, chunk: Chunk) -> bytes:
        if chunk.size > min(_CHUNK_LIMIT, self._budget):
            raise DamageError(
                chunk.start, f"a chunk that claims {chunk.size} bytes, more than a file of this size may hold"
            )
        self._budget -= chunk.size  # also when it fails: many that fail late are as much work as many that are whole
        try:
            data = self._decompressor.unpack(chunk.compression, chunk.packed, chunk.size)
        except ValueError as error:
            raise DamageError(chunk.start, f"a chunk {error}") from None
        if len(data) != chunk.size:
            raise DamageError(chunk.start, f"a chunk of {counted(len(data), 'byte')} where its head says {chunk.size}")
        return data

    def open_ahead(self, chunks: Iterable[Chunk]) -> Iterator[tuple[Chunk, bytes]]:
        """Each chunk with its records, as `open`; of many the next are unpacked while the last are worked on."""
        batches = _batches(chunks)
        opened, coming = self._several(next(batches, [])), next(batches, [])
        if not coming:
            yield from _told(opened)
            return
        with ThreadPoolExecutor(1) as beside:
            while opened:
                after = beside.submit(self._several, coming)
                yield from _told(opened)
                opened, coming = after.result(), next(batches, [])

    def _several(self, chunks: Sequence[Chunk]) -> list[tuple[Chunk, bytes | DamageError]]:
        """Up to the first that cannot be unpacked; CRCs are not looked at yet."""
        whole = self._together(chunks)
        if whole is not None:
            return list(zip(chunks, whole, strict=True))
        opened: list[tuple[Chunk, bytes | DamageError]] = []
        for chunk in chunks:
            try:
                opened.append((chunk, self._unpacked(chunk)))
            except DamageError as error:
                opened.append((chunk, error))
                break
        return opened

    def _together(self, chunks: Sequence[Chunk]) -> list[bytes] | None:
        """All of them in one call, so that a thread that unpacks does not wait for the interpreter at every chunk; None
        where one of them is no usual one."""
        total = sum(chunk.size for chunk in chunks)
        if total > self._budget or any(chunk.size > _CHUNK_LIMIT or chunk.compression != "zstd" for chunk in chunks):
            return None
        opened = self._decompressor.unpack_together(
            [chunk.packed for chunk in chunks], [chunk.size for chunk in chunks]
        )
        if opened is not None:
            self._budget -= total
        return opened


def _checked(chunk: Chunk, data: bytes) -> bytes:
    """The data; DamageError when the chunk's CRC does not hold."""
    if chunk.crc and zlib.crc32(data) != chunk.crc:
        raise DamageError(chunk.start, "a chunk whose CRC does not hold")
    return data


def _batches(chunks: Iterable[Chunk]) -> Iterator[list[Chunk]]:
    """Chunks in lists of _AHEAD_BYTES of content, as they claim it."""
    batch: list[Chunk] = []
    size = 0
    for chunk in chunks:
        batch.append(chunk)
        size += chunk.size
        if size > _AHEAD_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _told(opened: Iterable[tuple[Chunk, bytes | DamageError]]) -> Iterator[tuple[Chunk, bytes]]:
    for chunk, data in opened:
        if isinstance(data, DamageError):
            raise data
        yield chunk, _checked(chunk, data)
