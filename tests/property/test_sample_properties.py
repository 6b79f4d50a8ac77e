"""Whatever fits the fields comes back from the bytes as it was, bit for bit."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.sample import SAMPLE_BYTES, WIRES, Sample, pack, unpack

NUMBERS = {
    "fixed32": st.integers(0, 2**32 - 1),
    "sfixed64": st.integers(-(2**63), 2**63 - 1),
    "double": st.floats(allow_nan=True, allow_infinity=True),
}
SAMPLES = st.tuples(*(NUMBERS[wire.kind] for wire in WIRES.values())).map(lambda values: Sample(*values))


def bits(sample: Sample) -> list[bytes]:
    return [struct.pack("<d", v) if isinstance(v, float) else str(v).encode() for v in sample]


@given(SAMPLES)
def test_round_trip(sample: Sample) -> None:
    packed = pack(sample)
    assert len(packed) == SAMPLE_BYTES
    assert bits(unpack(packed)) == bits(sample)


@given(st.binary(min_size=SAMPLE_BYTES, max_size=SAMPLE_BYTES))
def test_bytes_without_the_tags_of_the_fields_are_refused(data: bytes) -> None:
    with pytest.raises(ValueError, match="not a packed sample"):
        unpack(data)


@given(SAMPLES, st.integers(0, SAMPLE_BYTES - 1), st.integers(0, 255))
def test_a_sample_with_another_byte_is_refused_or_comes_back_with_it(sample: Sample, place: int, byte: int) -> None:
    packed = bytearray(pack(sample))
    packed[place] = byte
    data = bytes(packed)
    try:
        sample = unpack(data)
    except ValueError:
        return
    assert pack(sample) == data


@given(SAMPLES, st.integers(0, SAMPLE_BYTES - 1))
def test_a_cut_sample_is_no_sample(sample: Sample, length: int) -> None:
    with pytest.raises((ValueError, struct.error)):
        unpack(pack(sample)[:length])
