"""One tick as data: the table of fields, the binary form, and that other software reads it as Protobuf."""

import math
import struct

import pytest
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

from rig.log.mcap import schema
from rig.sample import SAMPLE_BYTES, WIRES, Flag, Phase, Sample, pack, pack_into, tag_bytes, unpack


def sample(**values: float) -> Sample:
    """A sample in which every field has a value of its own."""
    numbered = {name: 1000 + n if wire.kind != "double" else n + 0.125 for n, (name, wire) in enumerate(WIRES.items())}
    return Sample(**(numbered | values))  # type: ignore[arg-type]


def test_every_field_has_a_wire_in_order() -> None:
    assert list(WIRES) == list(Sample._fields)
    assert {wire.kind for wire in WIRES.values()} == {"fixed32", "sfixed64", "double"}
    assert all(wire.meaning and wire.unit for wire in WIRES.values())


def test_units_stand_in_the_names() -> None:
    ends = {"ns": "_ns", "MPa": "_mpa", "deg": "_deg", "raw": "_raw"}
    assert all(name.endswith(ends[wire.unit]) for name, wire in WIRES.items() if wire.unit in ends)


def test_every_packed_sample_has_the_same_length() -> None:
    sizes = {"fixed32": 4, "sfixed64": 8, "double": 8}
    expected = sum(sizes[wire.kind] + len(tag_bytes(n, wire.kind)) for n, wire in enumerate(WIRES.values(), 1))
    assert len(pack(sample())) == SAMPLE_BYTES == expected
    assert len(pack(Sample(*[0] * len(WIRES)))) == SAMPLE_BYTES


def test_packing_into_a_buffer_writes_there_and_nowhere_else() -> None:
    buffer = bytearray(b"\xaa" * (SAMPLE_BYTES + 20))
    pack_into(sample(), memoryview(buffer), 10)
    assert buffer[:10] == buffer[-10:] == b"\xaa" * 10
    assert unpack(buffer, 10) == sample()


def test_what_is_no_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="not a packed sample"):
        unpack(bytes(SAMPLE_BYTES))
    broken = bytearray(pack(sample()))
    broken[0] ^= 1
    with pytest.raises(ValueError, match="not a packed sample"):
        unpack(bytes(broken))


def test_google_reads_it_by_the_schema_in_the_file() -> None:
    files = descriptor_pb2.FileDescriptorSet.FromString(schema.sample_descriptor_set())
    pool = descriptor_pool.DescriptorPool()
    for file in files.file:
        pool.Add(file)  # type: ignore[no-untyped-call]
    message = message_factory.GetMessageClass(pool.FindMessageTypeByName(schema.SAMPLE_SCHEMA))()
    message.ParseFromString(pack(sample(p1_mpa=math.nan)))
    for name, value in sample()._asdict().items():
        if name != "p1_mpa":
            assert getattr(message, name) == value, name
    assert math.isnan(message.p1_mpa)


@pytest.mark.parametrize(
    ("number", "kind", "expected"), [(1, "fixed32", b"\x0d"), (16, "double", b"\x81\x01"), (15, "sfixed64", b"\x79")]
)
def test_tags(number: int, kind: str, expected: bytes) -> None:
    assert tag_bytes(number, kind) == expected


def test_flags_are_single_bits_and_phases_in_order() -> None:
    values = [flag.value for flag in Flag]
    assert values == [1 << n for n in range(len(values))]
    assert [phase.value for phase in Phase] == list(range(6))


def test_a_value_that_does_not_fit_its_wire_is_an_error() -> None:
    with pytest.raises(struct.error):
        pack(sample(tick=2**32))
    with pytest.raises(struct.error):
        pack(sample(run=-1))
