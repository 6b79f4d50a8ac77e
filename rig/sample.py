"""One tick of the rig as plain data: its fields, their units, and their one binary form.

The class `Sample` is the only list of fields; the ring in shared memory, the MCAP schema, the columns of a record and
the reference page are all derived from it. The binary form is a Protobuf message in which every field has a fixed width
and is always written: the loop packs it once, the recorder copies the bytes into the file, and a reader maps a whole
chunk onto columns without decoding message by message.
"""

import struct
from enum import IntEnum, IntFlag
from typing import Annotated, Final, NamedTuple, get_type_hints

from rig.interfaces import NAN, Role


class Wire(NamedTuple):
    """How a field is stored and what it means."""

    kind: str
    """Protobuf scalar type of fixed width: fixed32, sfixed64 or double."""
    unit: str
    meaning: str


class Phase(IntEnum):
    """Where in the experiment a tick lies; identification and diagnosis read SWEEP only."""

    NONE = 0
    SETTLE = 1
    ZERO = 2
    RAMP_IN = 3
    SWEEP = 4
    RAMP_OUT = 5


class Flag(IntFlag):
    """What is special about a tick; no flag set means a measured, fresh, unclipped sample."""

    ANGLE_ZEROED = 1 << 0
    """`angle_deg` counts from the zero taken at P0 (experiment step 1); unset: from the sensor's own zero."""
    P1_ABSENT = 1 << 1
    P2_ABSENT = 1 << 2
    ANGLE_ABSENT = 1 << 3
    """The rig has no such sensor, or it gave no value this tick: the field is NaN."""
    STALE = 1 << 4
    """At least one value is older than one period; its age says by how much."""
    CLIPPED_RANGE = 1 << 5
    CLIPPED_SLEW = 1 << 6
    """The guard changed a set-point before it was written."""
    READ_ERROR = 1 << 7
    WRITE_ERROR = 1 << 8
    """The device failed this tick and the failure went into the leaky bucket."""
    BROKEN_WIRE = 1 << 9
    """A monitor reads below its live zero (0 V on 1-5 V, 0 mA on 4-20 mA)."""
    SUSPECT = 1 << 10
    """A value was out of range, jumped or was not finite, and was kept away from every output."""
    ANGLE_SUSPECT = 1 << 11
    """The value that could not be true, or was not there, was the angle."""


# The flags as plain ints, for code that runs each tick: arithmetic on an IntFlag costs a microsecond each.
ANGLE_ZEROED: Final = Flag.ANGLE_ZEROED.value
P1_ABSENT: Final = Flag.P1_ABSENT.value
P2_ABSENT: Final = Flag.P2_ABSENT.value
ANGLE_ABSENT: Final = Flag.ANGLE_ABSENT.value
STALE: Final = Flag.STALE.value
CLIPPED_RANGE: Final = Flag.CLIPPED_RANGE.value
CLIPPED_SLEW: Final = Flag.CLIPPED_SLEW.value
READ_ERROR: Final = Flag.READ_ERROR.value
WRITE_ERROR: Final = Flag.WRITE_ERROR.value
BROKEN_WIRE: Final = Flag.BROKEN_WIRE.value
SUSPECT: Final = Flag.SUSPECT.value
ANGLE_SUSPECT: Final = Flag.ANGLE_SUSPECT.value
ABSENT_BY_ROLE: Final = {Role.MONITOR_1: P1_ABSENT, Role.MONITOR_2: P2_ABSENT, Role.ANGLE: ANGLE_ABSENT}
"""Role -> the flag of a measurement without it."""
ABSENT_BY_COLUMN: Final = {"p1_mpa": P1_ABSENT, "p2_mpa": P2_ABSENT, "angle_deg": ANGLE_ABSENT}
"""The same by the field that is NaN then."""


_FURTHER: Final = (
    "a further channel (load cell, temperature, ...); the run fact `further` has its name and unit; NaN without"
)


class Sample(NamedTuple):
    """What happened in one tick; times are nanoseconds of the clock that drove the loop."""

    tick: Annotated[
        int, Wire("fixed32", "1", "index on the period grid since the loop started; skipped periods leave gaps")
    ]
    scheduled_ns: Annotated[int, Wire("sfixed64", "ns", "when the tick was due on the absolute grid")]
    woken_ns: Annotated[int, Wire("sfixed64", "ns", "when the loop woke for it")]
    read_ns: Annotated[int, Wire("sfixed64", "ns", "when the measurement was complete")]
    written_ns: Annotated[int, Wire("sfixed64", "ns", "when the set-points had been handed to the device")]
    missed: Annotated[int, Wire("fixed32", "1", "whole periods skipped just before this tick")]
    dp_cmd_mpa: Annotated[
        float, Wire("double", "MPa", "differential pressure command: p1_cmd_mpa - p2_cmd_mpa as asked for")
    ]
    p1_cmd_mpa: Annotated[float, Wire("double", "MPa", "set-point of regulator 1 as written, after the guard")]
    p2_cmd_mpa: Annotated[float, Wire("double", "MPa", "set-point of regulator 2 as written, after the guard")]
    p1_mpa: Annotated[float, Wire("double", "MPa", "measured pressure of muscle 1; NaN when absent")]
    p2_mpa: Annotated[float, Wire("double", "MPa", "measured pressure of muscle 2; NaN when absent")]
    angle_deg: Annotated[
        float, Wire("double", "deg", "joint angle, from the zero at P0 once the flag ANGLE_ZEROED is set")
    ]
    p1_raw: Annotated[
        float, Wire("double", "raw", "monitor 1 as the device gave it (counts or volts, see the calibration)")
    ]
    p2_raw: Annotated[float, Wire("double", "raw", "monitor 2 as the device gave it")]
    angle_raw: Annotated[float, Wire("double", "raw", "potentiometer as the device gave it")]
    excitation_raw: Annotated[
        float, Wire("double", "raw", "excitation of the potentiometer as the device gave it; NaN when not read")
    ]
    p1_age_ns: Annotated[int, Wire("sfixed64", "ns", "age of p1_mpa when it was read")]
    p2_age_ns: Annotated[int, Wire("sfixed64", "ns", "age of p2_mpa when it was read")]
    angle_age_ns: Annotated[int, Wire("sfixed64", "ns", "age of angle_deg when it was read")]
    run: Annotated[int, Wire("fixed32", "1", "number of the record this tick belongs to within the session; 0: none")]
    state: Annotated[int, Wire("fixed32", "1", "state of the rig, see rig.realtime.state.State")]
    phase: Annotated[int, Wire("fixed32", "1", "phase of the experiment, see rig.sample.Phase")]
    flags: Annotated[int, Wire("fixed32", "1", "see rig.sample.Flag")]
    fault: Annotated[int, Wire("fixed32", "1", "code of the latched fault, see rig.realtime.faults; 0: none")]
    angle_zero_deg: Annotated[
        float, Wire("double", "deg", "sensor angle taken as zero at P0 and subtracted from angle_deg; 0 before")
    ]
    further_1: Annotated[float, Wire("double", "own", _FURTHER)] = NAN
    further_2: Annotated[float, Wire("double", "own", _FURTHER)] = NAN
    further_3: Annotated[float, Wire("double", "own", _FURTHER)] = NAN
    further_4: Annotated[float, Wire("double", "own", _FURTHER)] = NAN
    reference_deg: Annotated[
        float, Wire("double", "deg", "reference angle while the loop is closed over angle_deg; NaN otherwise")
    ] = NAN


_HINTS = get_type_hints(Sample, include_extras=True)
WIRES: Final[dict[str, Wire]] = {name: _HINTS[name].__metadata__[0] for name in Sample._fields}
"""Field name -> its wire form, in the order of the Protobuf field numbers, which count from 1."""

_CODES = {"fixed32": ("I", 5), "sfixed64": ("q", 1), "double": ("d", 1)}
"""Protobuf type -> (struct code, wire type)."""


def tag_bytes(number: int, kind: str) -> bytes:
    """The varint that opens field `number` in a Protobuf message (numbers below 2048)."""
    key = number << 3 | _CODES[kind][1]
    return bytes([key]) if key < 0x80 else bytes([key & 0x7F | 0x80, key >> 7])


_TAGS = [tag_bytes(number, wire.kind) for number, wire in enumerate(WIRES.values(), 1)]
_LAYOUT = struct.Struct(
    "<" + "".join(f"{len(tag)}s{_CODES[wire.kind][0]}" for tag, wire in zip(_TAGS, WIRES.values(), strict=True))
)
_TEMPLATE: list[bytes | float] = [part for tag in _TAGS for part in (tag, 0)]

SAMPLE_BYTES: Final = _LAYOUT.size
"""Length of every packed sample."""


def pack_into(sample: Sample, buffer: memoryview, offset: int) -> None:
    """Write `sample` at `offset` as one Protobuf message of SAMPLE_BYTES bytes."""
    parts = _TEMPLATE.copy()
    parts[1::2] = sample
    _LAYOUT.pack_into(buffer, offset, *parts)


def pack(sample: Sample) -> bytes:
    """The sample as one Protobuf message."""
    parts = _TEMPLATE.copy()
    parts[1::2] = sample
    return _LAYOUT.pack(*parts)


def unpack(data: bytes | memoryview, offset: int = 0) -> Sample:
    """The sample at `offset`; ValueError when the bytes there are not one."""
    parts = _LAYOUT.unpack_from(data, offset)
    if list(parts[::2]) != _TAGS:
        raise ValueError("these bytes are not a packed sample")
    return Sample(*parts[1::2])
