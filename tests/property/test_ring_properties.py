"""For every order of writing and reading: what a reader gets is in order, whole, and together with its losses it is
everything."""

import secrets

from hypothesis import given, settings
from hypothesis import strategies as st

from rig.realtime.ring import Ring, RingReader, RingWriter
from rig.sample import WIRES, Sample, unpack


def sample(tick: int) -> Sample:
    return Sample(*[tick if wire.kind != "double" else tick / 3 for wire in WIRES.values()])


@settings(max_examples=60)
@given(capacity=st.integers(1, 20), steps=st.lists(st.tuples(st.integers(0, 25), st.integers(0, 2)), max_size=30))
def test_nothing_is_lost_in_silence(capacity: int, steps: list[tuple[int, int]]) -> None:
    ring = Ring.create(f"test-{secrets.token_hex(8)}", 1, capacity)
    try:
        writer, readers = RingWriter(ring), [RingReader(ring), RingReader(ring)]
        got: list[list[int]] = [[], []]
        written = 0
        for count, who in steps:
            for _ in range(count):
                writer.put(sample(written))
                written += 1
            for reader, mine in zip(readers[:who], got, strict=False):
                for packed in reader:
                    back = unpack(packed)
                    assert back == sample(back.tick)
                    mine.append(back.tick)
                assert len(mine) + reader.lost == written
                assert mine == sorted(set(mine))
        latest = ring.latest()
        assert ring.head == written
        assert (latest is None and not written) or (latest is not None and latest.tick == written - 1)
    finally:
        ring.block.unlink()
        ring.block.close()
