"""Samples as numpy columns, straight from the bytes of the file, by the schema that the file carries.

A file written by an older or newer pamrig is read by its own field list; a field it lacks is filled in.
"""

import struct
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from itertools import chain
from operator import attrgetter
from typing import Any, Final

import numpy as np
from google.protobuf import descriptor_pool, message_factory
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from numpy.typing import NDArray

from rig.errors import RecordError
from rig.log.mcap.framing import HEAD, MESSAGE_HEAD
from rig.sample import WIRES, Wire, tag_bytes

Array = NDArray[Any]

_FIXED = {getattr(FieldDescriptor, f"TYPE_{kind.upper()}"): kind for kind in ("fixed32", "sfixed64", "double")}
_MOST_NUMBER: Final = 2**11 - 1
"""Of a field, up to which its tag is one or two bytes long (Protobuf encoding: 3 bits of wire type, 7 bits a byte)."""
DTYPES: Final[dict[str, np.dtype[Any]]] = {
    "fixed32": np.dtype("<u4"),
    "sfixed64": np.dtype("<i8"),
    "double": np.dtype("<f8"),
}
"""Protobuf type -> numpy type of the same bytes."""


def kept_as(dtype: np.dtype[Any], values: Array, where: str) -> Array:
    """A column of a table, shape (n,), as a field of that type keeps it. RecordError for a field of whole numbers where
    a cell is none of its own, for a cast would make another number of it."""
    if dtype.kind == "f":
        return values.astype(dtype, copy=False)
    low, high = np.iinfo(dtype).min, np.iinfo(dtype).max
    fits = (values >= low) & (values < high + 1) & (values == np.rint(values))
    if not fits.all():
        row = int(np.argmin(fits))
        raise RecordError(f"{where}: {values[row]:g} in row {row + 1} is no whole number from {low} to {high}")
    return values.astype(dtype, copy=False)


_STRUCT_CODES: Final = {"fixed32": "I", "sfixed64": "q", "double": "d"}
_HEAD_FIELDS: Final[dict[str, Any]] = {
    "opcode": "u1",
    "length": "<u8",
    "channel": "<u2",
    "sequence": "<u4",
    "log_time": "<u8",
    "publish_time": "<u8",
}


@dataclass(frozen=True)
class Samples:
    """Ticks as columns of equal length n, in the order of the file: one per field of rig.sample.Sample, in its type, or
    per field that was asked for."""

    fields: dict[str, Array]
    log_time_ns: NDArray[np.int64]
    """Nanoseconds since the Unix epoch, shape (n,)."""
    sequence: NDArray[np.uint32]
    """Counts in the recorder; a gap is a sample lost between loop and file. Shape (n,)."""

    def __getitem__(self, name: str) -> Array:
        return self.fields[name]

    def __len__(self) -> int:
        return len(self.log_time_ns)

    def rows(self, chosen: slice | NDArray[np.bool_]) -> "Samples":
        """Only some rows: a slice, or (n,) which of them."""
        fields = {name: column[chosen] for name, column in self.fields.items()}
        return Samples(fields, self.log_time_ns[chosen], self.sequence[chosen])


@dataclass(frozen=True)
class Layout:
    """How the samples of one channel lie in the file."""

    channel: int
    names: tuple[str, ...]
    kinds: tuple[str, ...]
    tags: tuple[bytes, ...]
    decode: Callable[[bytes], tuple[float, ...]] = field(repr=False)
    """Values of a message that is valid Protobuf in another arrangement; ValueError when it is not even that."""
    exact: bool = False
    """Other arrangements are refused: the schema is assumed, and only the tags can prove it."""

    @cached_property
    def message(self) -> np.dtype[Any]:
        """One whole message record of the file: head, then each field behind its tag."""
        return np.dtype(list(_HEAD_FIELDS.items()) + tagged_fields(self.names, self.kinds, self.tags))

    @cached_property
    def probe(self) -> np.dtype[Any]:
        """The same record, only its head, as two whole numbers that overlap: quick to compare."""
        parts = {
            "names": ["first", "last"],
            "formats": ["<u8", "<u4"],
            "offsets": [0, 7],
            "itemsize": self.message.itemsize,
        }
        return np.dtype(parts)  # type: ignore[call-overload, no-any-return]

    @cached_property
    def probed(self) -> Array:
        """What `probe` shows of a record of this channel in this arrangement."""
        head = np.zeros(1, self.message)
        head["opcode"], head["length"], head["channel"] = self.head
        return head.view(self.probe)[0]  # type: ignore[no-any-return]

    @cached_property
    def head(self) -> tuple[int, int, int]:
        """Opcode, length and channel of every message record in this arrangement."""
        return Opcode.MESSAGE, self.message.itemsize - HEAD.size, self.channel

    @cached_property
    def head_bytes(self) -> bytes:
        """The same as they lie in the file."""
        opcode, length, channel = self.head
        return HEAD.pack(opcode, length) + struct.pack("<H", channel)

    def regular(self, rows: Array) -> bool:
        """Whether all `rows` (of the type `message`) hold the fields in this arrangement."""
        tags = zip(self.names, self.tags, strict=True)
        return all(bool((rows[f"tag {name}"] == int.from_bytes(tag, "little")).all()) for name, tag in tags)

    @cached_property
    def packer(self) -> struct.Struct:
        """The whole record for Python's own packing: head, then tag and value of each field."""
        parts = zip(self.tags, self.kinds, strict=True)
        return struct.Struct("<BQHIQQ" + "".join(f"{len(tag)}s{_STRUCT_CODES[kind]}" for tag, kind in parts))

    def pack_again(self, record: bytes) -> bytes:
        """A message record in another arrangement as one in this; ValueError when its data are not such a message."""
        if self.exact:
            raise ValueError("a message that is not a sample as pamrig writes it")
        _, sequence, log_time, publish_time = MESSAGE_HEAD.unpack_from(record, HEAD.size)
        values = self.decode(record[HEAD.size + MESSAGE_HEAD.size :])
        fields = chain.from_iterable(zip(self.tags, values, strict=True))
        return self.packer.pack(*self.head, sequence, log_time, publish_time, *fields)


def layout_of(descriptor_set: bytes, schema_name: str, channel: int, exact: bool = False) -> Layout:
    """The layout that a schema in the file describes; ValueError when it is not one of flat, fixed-width fields."""
    return replace(_described(descriptor_set, schema_name), channel=channel, exact=exact)


@lru_cache(maxsize=16)
def _described(descriptor_set: bytes, schema_name: str) -> Layout:
    """That layout in channel 0; kept, for a file may define the same channel again before each message."""
    try:
        files = FileDescriptorSet.FromString(descriptor_set)
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.AddSerializedFile(file.SerializeToString())
        descriptor = pool.FindMessageTypeByName(schema_name)
    except (DecodeError, KeyError, TypeError, ValueError):
        raise ValueError("the schema is not a Protobuf descriptor") from None
    fields = sorted(descriptor.fields, key=lambda item: int(item.number))
    if not fields or any(item.type not in _FIXED or item.is_repeated or item.number > _MOST_NUMBER for item in fields):
        raise ValueError("the schema has fields that are not single numbers of fixed width")
    kind = message_factory.GetMessageClass(descriptor)
    names = tuple(item.name for item in fields)

    values = attrgetter(*names, names[0])  # of one name alone it would be the bare value

    def decode(data: bytes) -> tuple[float, ...]:
        try:
            message = kind.FromString(data)
        except DecodeError:
            raise ValueError("not a Protobuf message") from None
        return values(message)[:-1]

    kinds = tuple(_FIXED[item.type] for item in fields)
    tags = tuple(tag_bytes(item.number, wire) for item, wire in zip(fields, kinds, strict=True))
    return Layout(0, names, kinds, tags, decode)


def run_length(data: bytes, offset: int, layout: Layout) -> int:
    """How many message records of `layout`'s channel and length follow one another from `offset` on."""
    size = layout.message.itemsize
    available = (len(data) - offset) // size
    done, look = 0, 128
    if not data.startswith(layout.head_bytes, offset):
        return 0
    first, last = layout.probed["first"], layout.probed["last"]
    while done < available:
        rows = np.frombuffer(data, layout.probe, min(look, available - done), offset + done * size)
        other = (rows["first"] != first) | (rows["last"] != last)
        if other.any():
            return done + int(other.argmax())
        done += len(rows)
        look *= 2  # so that a long run costs few calls and a short one little work
    return done


class GrowingSamples:
    """Samples that come in batches, the fields `names` of them: each column grows in its place, so that an hour is in
    memory once. Room for `expected_bytes` of records is made at once; what is not filled of it costs nothing."""

    def __init__(self, names: Collection[str], expected_bytes: int) -> None:
        self._expected_bytes = expected_bytes
        self._fields = {name: np.empty(0, DTYPES[wire.kind]) for name, wire in WIRES.items() if name in names}
        self._times, self._sequence = np.empty(0, np.int64), np.empty(0, np.uint32)
        self._length = 0

    def add(self, layout: Layout, records: bytearray) -> None:
        """Message records of `layout`'s channel and length; a field that the file lacks is NaN or 0.

        ValueError when a record is no such message, or its time is beyond the year 2262.
        """
        rows = _rows(layout, records)
        if len(rows) and int(rows["log_time"].max()) > np.iinfo(np.int64).max:
            raise ValueError("a message whose time is beyond the year 2262")
        start, end = self._length, self._length + len(rows)
        if end > len(self._times):
            self._make_room(max(end, self._expected_bytes // layout.message.itemsize, end + end // 8))
        self._times[start:end], self._sequence[start:end] = rows["log_time"], rows["sequence"]
        for name, column in self._fields.items():
            filler = np.nan if WIRES[name].kind == "double" else 0
            column[start:end] = rows[f"field {name}"] if name in layout.names else filler
        self._length = end

    def samples(self) -> Samples:
        """All that were added; nothing may be added afterwards."""
        for column in self._columns():
            column.resize(self._length, refcheck=False)  # nobody else has seen it yet
        return Samples(self._fields, self._times, self._sequence)

    def _make_room(self, length: int) -> None:
        if not self._length:
            self._fields = {name: np.empty(length, column.dtype) for name, column in self._fields.items()}
            self._times, self._sequence = np.empty(length, np.int64), np.empty(length, np.uint32)
            return
        for column in self._columns():
            column.resize(length, refcheck=False)

    def _columns(self) -> list[Array]:
        return [self._times, self._sequence, *self._fields.values()]


def _rows(layout: Layout, records: bytearray) -> Array:
    """The records as rows of `layout.message`; those in another arrangement are packed again."""
    rows = np.frombuffer(records, layout.message)
    if layout.regular(rows):
        return rows
    size = layout.message.itemsize
    again = (layout.pack_again(bytes(records[start : start + size])) for start in range(0, len(records), size))
    return np.frombuffer(b"".join(again), layout.message)


def pack_columns(columns: Mapping[str, Array], wires: Mapping[str, Wire]) -> Array:
    """Columns as packed Protobuf messages of the fields `wires`, numbered from 1: an array of n items of equal size."""
    return _filled(columns, wires, [])


def message_rows(samples: Samples, channel: int) -> Array:
    """Samples as whole message records of that channel: an array of n items of equal size."""
    rows = _filled(samples.fields, WIRES, list(_HEAD_FIELDS.items()))
    rows["opcode"], rows["length"], rows["channel"] = Opcode.MESSAGE, rows.dtype.itemsize - HEAD.size, channel
    rows["sequence"], rows["log_time"], rows["publish_time"] = (
        samples.sequence,
        samples.log_time_ns,
        samples.log_time_ns,
    )
    return rows


def _filled(columns: Mapping[str, Array], wires: Mapping[str, Wire], head: list[tuple[str, Any]]) -> Array:
    kinds = tuple(wire.kind for wire in wires.values())
    tags = tuple(tag_bytes(number, kind) for number, kind in enumerate(kinds, 1))
    rows = np.zeros(len(next(iter(columns.values()))), np.dtype(head + tagged_fields(tuple(wires), kinds, tags)))
    for name, tag in zip(wires, tags, strict=True):
        rows[f"tag {name}"] = int.from_bytes(tag, "little")
        rows[f"field {name}"] = columns[name]
    return rows


def tagged_fields(names: tuple[str, ...], kinds: tuple[str, ...], tags: tuple[bytes, ...]) -> list[tuple[str, Any]]:
    """The numpy fields of a packed message: each value behind its tag, a whole number of one or two bytes."""
    pairs = (
        ((f"tag {n}", f"<u{len(tag)}"), (f"field {n}", DTYPES[kind]))
        for n, kind, tag in zip(names, kinds, tags, strict=True)
    )
    return [part for pair in pairs for part in pair]
