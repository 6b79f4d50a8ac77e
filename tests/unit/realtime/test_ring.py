"""The ring: order, overwriting, losses that are counted, torn slots that are not read, and the pace of a virtual
clock."""

import secrets
import time
from collections.abc import Iterator

import pytest

from rig.errors import StateError
from rig.realtime.ring import Ring, RingReader, RingWriter
from rig.realtime.shared import SharedBlock
from rig.sample import WIRES, Sample, unpack


def sample(tick: int) -> Sample:
    return Sample(*[tick if name == "tick" else 0 for name in WIRES])


@pytest.fixture
def ring() -> Iterator[Ring]:
    made = Ring.create(f"test-{secrets.token_hex(8)}", 5, capacity=16)
    yield made
    made.block.unlink()


def ticks(reader: RingReader) -> list[int]:
    return [unpack(packed).tick for packed in reader]


def test_every_reader_gets_every_sample_in_order(ring: Ring) -> None:
    writer, one, other = RingWriter(ring), RingReader(ring), RingReader(ring)
    for tick in range(10):
        writer.put(sample(tick))
    assert ticks(one) == list(range(10))
    writer.put(sample(10))
    assert ticks(one) == [10]
    assert ticks(other) == list(range(11))
    assert (one.lost, other.lost) == (0, 0)


def test_a_slow_reader_loses_the_oldest_and_knows_how_many(ring: Ring) -> None:
    writer, reader = RingWriter(ring), RingReader(ring)
    for tick in range(50):
        writer.put(sample(tick))
    assert ticks(reader) == list(range(34, 50))
    assert reader.lost == 34


def test_a_reader_that_is_overtaken_while_it_reads_counts_what_it_misses(ring: Ring) -> None:
    writer, reader = RingWriter(ring), RingReader(ring)
    for tick in range(16):
        writer.put(sample(tick))
    got = []
    for packed in reader:
        got.append(unpack(packed).tick)
        if len(got) == 4:
            for tick in range(16, 24):
                writer.put(sample(tick))
    assert got == [0, 1, 2, 3, *range(8, 16)]
    assert reader.lost == 4
    assert ticks(reader) == list(range(16, 24))


def test_a_slot_that_is_being_written_is_not_read(ring: Ring) -> None:
    writer = RingWriter(ring)
    writer.put(sample(0))
    word = next(w for w in range(len(ring.block.words) - 1) if ring.block.words[w] == 1 and w >= 16)
    ring.block.words[word] = 0  # as `put` leaves it while the bytes are going in
    assert ring.slot(0) is None
    assert ring.latest() is None


def test_a_late_reader_starts_now_or_where_it_says(ring: Ring) -> None:
    writer = RingWriter(ring)
    for tick in range(5):
        writer.put(sample(tick))
    assert ticks(RingReader(ring)) == []
    assert ticks(RingReader(ring, 3)) == [3, 4]
    latest = ring.latest()
    assert latest is not None
    assert latest.tick == 4


def test_the_head_of_an_empty_ring(ring: Ring) -> None:
    assert (ring.head, ring.heartbeat_ns, ring.latest()) == (0, 0, None)


def test_a_beat_is_the_moment_of_the_loops_tick(ring: Ring) -> None:
    before = time.monotonic_ns()
    writer = RingWriter(ring)
    writer.beat()
    assert before <= ring.heartbeat_ns <= time.monotonic_ns()


def test_another_process_s_view_is_the_same(ring: Ring) -> None:
    there = Ring.attach(ring.block.path, 5)
    RingWriter(ring).put(sample(3))
    assert ticks(RingReader(there, 0)) == [3]
    assert there.capacity == 16


def test_what_is_no_ring_is_refused(ring: Ring) -> None:
    block = SharedBlock.create(f"{ring.block.path.name.removeprefix('pamrig-')}-mailbox", 5, 64)
    tiny = SharedBlock.create(f"{ring.block.path.name.removeprefix('pamrig-')}-tiny", 5, 8)
    try:
        for foreign in (block, tiny):
            with pytest.raises(StateError, match="not a ring of samples"):
                Ring.attach(foreign.path, 5)
        with pytest.raises(StateError, match="stale"):
            Ring.attach(ring.block.path, 6)
    finally:
        block.unlink()
        tiny.unlink()


def test_the_pace_waits_for_a_recorder_that_moves(ring: Ring, monkeypatch: pytest.MonkeyPatch) -> None:
    writer, naps = RingWriter(ring), []
    for tick in range(12):
        writer.put(sample(tick))

    def nap(_s: float) -> None:
        naps.append(ring.recorded)
        ring.recorded += 1

    monkeypatch.setattr(time, "sleep", nap)
    ring.pace()
    assert ring.head - ring.recorded == 8, "half the ring is free again"
    assert len(naps) == 4


def test_the_pace_gives_up_on_a_recorder_that_is_dead(ring: Ring) -> None:
    writer = RingWriter(ring)
    for tick in range(12):
        writer.put(sample(tick))
    ring.pace(patience_s=0.0, poll_s=0.0)
    assert ring.recorded == ring.head


def test_the_device_s_words_reach_every_reader(ring: Ring) -> None:
    writer, there = RingWriter(ring), Ring.attach(ring.block.path, 5)
    assert there.device_message == ""
    writer.put(sample(0))
    writer.put_device_message("valve_1: no reply within 30 ms")
    writer.put_device_message("bus: 0 \N{DEGREE SIGN}C")
    assert there.device_message == "bus: 0 \N{DEGREE SIGN}C", "the newest replace the last"
    writer.put_device_message("ß" * 1000)
    assert set(there.device_message) == {"ß"}
    assert ring.slot(0) is not None, "no sample was overwritten"
