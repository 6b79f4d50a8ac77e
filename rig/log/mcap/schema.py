"""What our MCAP files call things: topics, schemas, channel metadata, and run facts as text.

Everything about samples is derived from rig.sample.WIRES. Pure Python, because the recorder on the controller needs it;
the numpy view of the same layout is in rig.log.mcap.columns.
"""

import json
import zlib
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, Final

from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorProto, FileDescriptorSet

from rig.sample import WIRES, Flag, Phase, Wire

SAMPLE_TOPIC: Final = "/rig/sample"
SAMPLE_SCHEMA: Final = "pamrig.Sample"
LOG_TOPIC: Final = "/log"
LOG_SCHEMA: Final = "foxglove.Log"
REPLAY_TOPIC: Final = "/rig/replay"
REPLAY_SCHEMA: Final = "pamrig.Replay"
REPLAY_WIRES: Final = {
    "tick": Wire("fixed32", "1", "tick of the replay"),
    "recorded_tick": Wire("fixed32", "1", "tick of the recording at the same place of the sweep"),
    "recorded_angle_deg": Wire("double", "deg", "angle in the recording"),
    "angle_deg": Wire("double", "deg", "angle in the replay"),
    "residual_deg": Wire("double", "deg", "replay minus recording"),
}
"""Fields of the channel that a replay adds to its log."""
RUN_METADATA: Final = "pamrig.run"
"""Name of the metadata record with the facts known at the start."""
BLACK_BOX: Final = "black box"
"""The fact `kind` of a log that no sweep made (rig.service.records.blackbox)."""
RESULT_METADATA: Final = "pamrig.result"
"""Name of the metadata record with the facts known at the end; a file without it was not finished."""

LOG_LEVELS: Final = {"debug": 1, "info": 2, "warning": 3, "error": 4, "fatal": 5}
"""Names of the levels of foxglove.Log."""


class Ended(StrEnum):
    """How a run came to its end: three things that are not to be taken for each other, and a fourth that only a rescue
    finds."""

    COMPLETE = "complete"
    """The whole sweep was recorded."""
    STOPPED = "stopped"
    """Somebody stopped it before its sweep was over."""
    FAULT = "fault"
    CUT = "cut"
    """The recording breaks off, or lacks a part, without a word from the rig."""


_CRC_KEY = "crc32"
_NUMBERS: Final = ("p0_mpa", "frequency_hz", "amplitude_mpa")
_COUNTS: Final = ("started_ns", "period_ns", "repeat", "seed", "ticks", "records", "missed", "dropped")
"""Facts that others count on being numbers, and whole numbers from 0 to MOST_INT64."""
_MOST_NUMBER: Final = 1e300
"""A number of the facts beyond it is none: what is computed with it would end in infinity."""
MOST_INT64: Final = (1 << 63) - 1
"""The largest signed number of 64 bits."""


def sample_descriptor_set() -> bytes:
    """The Protobuf schema of `pamrig.Sample`."""
    return descriptor_set(SAMPLE_SCHEMA, WIRES)


def descriptor_set(kind: str, wires: Mapping[str, Wire]) -> bytes:
    """The Protobuf schema of a flat message `pamrig.KIND` as a serialised FileDescriptorSet; units and meanings as
    comments."""
    short = kind.removeprefix("pamrig.")
    file = FileDescriptorProto(name=f"pamrig/{short.lower()}.proto", package="pamrig", syntax="proto3")
    message = file.message_type.add(name=short)
    for number, (name, wire) in enumerate(wires.items(), 1):
        scalar = FieldDescriptorProto.Type.Value(f"TYPE_{wire.kind.upper()}")
        message.field.add(
            name=name, json_name=name, number=number, type=scalar, label=FieldDescriptorProto.LABEL_OPTIONAL
        )
        file.source_code_info.location.add(
            path=[4, 0, 2, number - 1], leading_comments=f" [{wire.unit}] {wire.meaning}\n"
        )
    return FileDescriptorSet(file=[file]).SerializeToString(deterministic=True)


def field_metadata(wires: Mapping[str, Wire]) -> dict[str, str]:
    """Unit and meaning of each field, as metadata of its channel."""
    return {name: f"[{wire.unit}] {wire.meaning}" for name, wire in wires.items()}


def sample_channel_metadata() -> dict[str, str]:
    """What the fields of samples mean, and the names of phases and flags, for who opens the file in another tool."""
    phases = ", ".join(f"{phase.value} {phase.name}" for phase in Phase)
    flags = ", ".join(f"{flag.value} {flag.name}" for flag in Flag)
    return field_metadata(WIRES) | {"phase values": phases, "flags bits": flags}


def log_json_schema() -> bytes:
    """The JSON schema of `foxglove.Log`, as published in Foxglove's collection of well-known schemas."""
    stamp = {
        "type": "object",
        "title": "time",
        "properties": {
            "sec": {"type": "integer", "minimum": 0},
            "nsec": {"type": "integer", "minimum": 0, "maximum": 999_999_999},
        },
    }
    names = {"UNKNOWN": 0} | {name.upper(): value for name, value in LOG_LEVELS.items()}
    level = {"title": "foxglove.LogLevel", "oneOf": [{"title": name, "const": value} for name, value in names.items()]}
    texts = {name: {"type": "string"} for name in ("message", "name", "file")}
    properties = {"timestamp": stamp, "level": level} | texts | {"line": {"type": "integer", "minimum": 0}}
    return json.dumps(
        {"title": LOG_SCHEMA, "description": "A log message", "type": "object", "properties": properties}
    ).encode()


def log_message(level: str, message: str, time_ns: int) -> bytes:
    """One `foxglove.Log` message; `level` is a key of LOG_LEVELS, what is none is of unknown level; `time_ns` counts
    from the Unix epoch."""
    sec, nsec = divmod(time_ns, 1_000_000_000)
    stamp = {"sec": sec, "nsec": nsec}
    fields = {
        "timestamp": stamp,
        "level": LOG_LEVELS.get(level, 0),
        "message": message,
        "name": "pamrig",
        "file": "",
        "line": 0,
    }
    return json.dumps(fields, ensure_ascii=False).encode(
        "utf-8", "backslashreplace"
    )  # which is how JSON escapes halves of characters


def facts_to_text(facts: Mapping[str, Any]) -> dict[str, str]:
    """Facts as an MCAP metadata map: plain text as it stands, all else as JSON, and a CRC because the format has none
    here."""
    texts = {_key(key): _to_text(value) for key, value in facts.items() if key != _CRC_KEY}
    return texts | {_CRC_KEY: _crc(texts)}


def facts_from_text(texts: Mapping[str, str]) -> dict[str, Any]:
    """The inverse of `facts_to_text`; says nothing about the CRC."""
    return {key: _from_text(text) for key, text in texts.items() if key != _CRC_KEY}


def facts_intact(texts: Mapping[str, str]) -> bool:
    """Whether the map carries a CRC and agrees with it."""
    return texts.get(_CRC_KEY) == _crc({key: text for key, text in texts.items() if key != _CRC_KEY})


def unsound(facts: Mapping[str, Any]) -> dict[str, str]:
    """Facts that are of another kind than their name says, with what they should be. A file may hold anything."""
    wrong = {name: "a number" for name in _NUMBERS if name in facts and not _is_number(facts[name])}
    return wrong | {
        name: f"a whole number from 0 to {MOST_INT64}"
        for name in _COUNTS
        if name in facts and not _is_count(facts[name])
    }


def sound(facts: Mapping[str, Any]) -> dict[str, Any]:
    """The facts without those that are `unsound`: they say nothing."""
    wrong = unsound(facts)
    return {name: value for name, value in facts.items() if name not in wrong}


def count_of(facts: Mapping[str, Any], name: str) -> int:
    """The whole number of that name; 0 where it is not said, or is no such number."""
    value = facts.get(name, 0)
    return int(value) if _is_count(value) else 0


def ended_of(facts: Mapping[str, Any]) -> Ended | None:
    """How the run of a record ended; None where nothing is said of it, as in records that no recorder made.

    Files from before `ended` was written say it by `fault` and `complete`.
    """
    ended = facts.get("ended")
    if isinstance(ended, str) and ended in set(Ended):
        return Ended(ended)
    if facts.get("fault"):
        return Ended.FAULT
    complete = facts.get("complete")
    return None if not isinstance(complete, bool) else Ended.COMPLETE if complete else Ended.STOPPED


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and -_MOST_NUMBER < value < _MOST_NUMBER


def _is_count(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value <= MOST_INT64


def _crc(texts: Mapping[str, str]) -> str:
    canonical = json.dumps(dict(sorted(texts.items())), ensure_ascii=False)
    return f"{zlib.crc32(canonical.encode('utf-8', 'surrogatepass')):08x}"


def _key(key: object) -> str:
    return str(key).encode("utf-8", "backslashreplace").decode()


def _to_text(value: Any) -> str:
    if isinstance(value, str) and _from_text(value) == value and _encodable(value):
        return value
    text = json.dumps(value, ensure_ascii=False, default=_plain)
    return text if _encodable(text) else json.dumps(value, default=_plain)


def _encodable(text: str) -> bool:
    """Whether the text has no half of a character alone, as JSON's escapes allow it and UTF-8 does not."""
    return not any("\ud800" <= letter <= "\udfff" for letter in text)


def _from_text(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return text


def _plain(value: Any) -> Any:
    """numpy's scalars and arrays as Python's own; paths and the like as text."""
    return value.tolist() if hasattr(value, "tolist") else str(value)
