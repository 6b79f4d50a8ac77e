"""Channels of other programs' MCAP files as tables: JSON and Protobuf messages, one row a message.

Nested fields are named with dots (pose.angle); the log time is there as log_time, in seconds from the first message.
"""

import itertools
import json
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from google.protobuf import descriptor_pool, json_format, message_factory
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from mcap.opcode import Opcode
from mcap.records import Channel, Schema

from rig.errors import RecordError
from rig.log.foreign.tables import RawColumn, RawTable
from rig.log.mcap.contents import Contents, map_file, walk
from rig.log.mcap.framing import MESSAGE_HEAD, DamageError, Unpacker, blocks

TIME_COLUMN = "log_time"


def read_foreign(path: Path, topic: str) -> RawTable:
    """The channel `topic` of an MCAP file; the time of its first message is the fact `started_ns`. RecordError when it
    is not there, or its encoding is not JSON or Protobuf."""
    data = map_file(path)
    try:
        contents = walk(data)
        messages = list(_messages(data, contents, topic))
    except DamageError as error:
        raise RecordError(f"{path}: {error}") from None
    if not messages:
        raise RecordError(
            f"{path}: no messages on topic {topic!r}; it has {contents.describe_channels()} (`topic:` in the mapping)"
        )
    channels = {channel.id: channel for channel, _, _ in messages}  # a topic may have several
    decoders = {number: _decoder(path, contents, channel) for number, channel in channels.items()}
    rows = [_row(path, decoders[one.id], payload) | {TIME_COLUMN: time_ns} for one, time_ns, payload in messages]
    names = [name for name in rows[0] if all(name in row for row in rows)]
    columns = {name: np.array([row[name] for row in rows], dtype=np.float64) for name in names if name != TIME_COLUMN}
    times = np.array([row[TIME_COLUMN] for row in rows], dtype=np.int64)
    raw = {name: RawColumn(values) for name, values in columns.items()}
    facts = {"started_ns": int(times[0])} if times[0] else {}
    return RawTable(path, raw | {TIME_COLUMN: RawColumn((times - times[0]) / 1e9, "s")}, facts)


def _messages(data: memoryview, contents: Contents, topic: str) -> Iterator[tuple[Channel, int, bytes]]:
    unpacker = Unpacker(len(data))
    opened = (unpacker.open(chunk) for chunk in contents.chunks)
    loose = (bytes(data[block.start : block.end]) for block in contents.loose)
    for records in itertools.chain(opened, loose):
        for block in blocks(memoryview(records), 0, len(records)):
            if block.opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                contents.define(block)
            elif block.opcode == Opcode.MESSAGE and len(block.body) >= MESSAGE_HEAD.size:
                channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(block.body)
                if channel in contents.channels and contents.channels[channel].topic == topic and time_ns < 1 << 63:
                    yield contents.channels[channel], time_ns, bytes(block.body[MESSAGE_HEAD.size :])


def _decoder(path: Path, contents: Contents, channel: Channel) -> Callable[[bytes], Any]:
    if channel.message_encoding == "json":
        return json.loads
    kind = contents.schemas.get(channel.schema_id)
    if channel.message_encoding == "protobuf" and kind is not None:
        return _protobuf_decoder(path, kind)
    raise RecordError(
        f"{path}: {channel.topic} is encoded as {channel.message_encoding!r}; json and protobuf can be imported"
    )


def _protobuf_decoder(path: Path, kind: Schema) -> Callable[[bytes], Any]:
    try:
        pool = descriptor_pool.DescriptorPool()
        for file in FileDescriptorSet.FromString(kind.data).file:
            pool.AddSerializedFile(file.SerializeToString())
        message_class = message_factory.GetMessageClass(pool.FindMessageTypeByName(kind.name))
    except (DecodeError, KeyError, TypeError, ValueError):
        raise RecordError(f"{path}: the schema {kind.name} is not a Protobuf descriptor") from None
    return lambda data: json_format.MessageToDict(
        message_class.FromString(data), preserving_proto_field_name=True, always_print_fields_with_no_presence=True
    )


def _row(path: Path, decode: Callable[[bytes], Any], payload: bytes) -> dict[str, float]:
    try:
        return dict(_numbers(decode(payload), ""))
    except (ValueError, OverflowError, RecursionError, DecodeError):
        raise RecordError(f"{path}: a message that is not what its channel says") from None


def _numbers(value: Any, prefix: str) -> Iterator[tuple[str, float]]:
    """The numbers in a decoded message, by dotted name; text that spells a number counts (Protobuf's int64 in JSON)."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _numbers(item, f"{prefix}.{key}" if prefix else str(key))
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield prefix, float(value)
    elif isinstance(value, str):
        try:
            yield prefix, float(value)
        except ValueError:
            return
