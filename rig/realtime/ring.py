"""The ring in shared memory: one writer, the loop; any number of readers, none of which it ever waits for.

The writer overwrites the oldest sample. Each reader keeps its own cursor and learns from it how many samples it lost,
so the recorder, the supervisor, the live view and the black box all read the same ring. With 8192 slots it holds the
last 41 s at 5 ms, also when nothing is being recorded.
"""

import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final, Self

from rig.errors import StateError
from rig.realtime.shared import HEADER_WORDS, SharedBlock
from rig.sample import SAMPLE_BYTES, Sample, pack_into, unpack

CAPACITY: Final = 8192
"""Samples: 41 s at 5 ms, more than the black box keeps. Fewer: a recorder whose disk is being flushed loses samples
sooner."""
PACE_PATIENCE_S: Final = 5.0
"""So long a virtual clock waits for a recorder that does not move: a disk that is flushed takes seconds, a dead one for
ever."""
_PACE_POLL_S: Final = 0.0002
_READS: Final = 3
"""Attempts to read what another process may be writing meanwhile; one is enough unless it is met in its middle."""
_SLOT: Final = 8 + (SAMPLE_BYTES + 7) // 8 * 8  # sequence number, then the packed sample
_WORDS: Final = 9
_HEAD, _HEARTBEAT, _RECORDER, _CAPACITY, _MESSAGE_SEQUENCE, _SAFE, _SAFE_SEEN, _SAFE_COMING, _SAFE_DOUBTED = range(
    HEADER_WORDS, HEADER_WORDS + _WORDS
)
_TEXT: Final = (HEADER_WORDS + _WORDS) * 8
_TEXT_BYTES: Final = 512
_START: Final = _TEXT + _TEXT_BYTES
_OWNER_BYTES: Final = 4608
"""Behind the slots: whose ring it is, a path among it (at most 4096 bytes, limits.h)."""


class Ring:
    """The block and its words; make one `RingWriter` in the loop and a `RingReader` in each other process."""

    def __init__(self, block: SharedBlock) -> None:
        """StateError when `block` holds something else."""
        self.block = block
        self._words = block.words
        self.capacity = block.words[_CAPACITY] if len(block.words) > _CAPACITY else 0
        if self.capacity < 1 or _START + self.capacity * _SLOT > len(block.bytes):
            raise StateError(f"{block.path}: not a ring of samples")

    @classmethod
    def create(cls, name: str, session: int, capacity: int = CAPACITY, owner: str = "") -> Self:
        """A fresh ring of `capacity` samples; `owner` says to whoever finds it whose it is."""
        block = SharedBlock.create(name, session, _WORDS * 8 + _TEXT_BYTES + capacity * _SLOT + _OWNER_BYTES)
        block.words[_CAPACITY] = capacity
        ring = cls(block)
        ring.owner = owner
        return ring

    @classmethod
    def private(cls, capacity: int = 1) -> Self:
        """A ring that no other process sees."""
        block = SharedBlock.private(_WORDS * 8 + _TEXT_BYTES + capacity * _SLOT)
        block.words[_CAPACITY] = capacity
        return cls(block)

    @classmethod
    def attach(cls, path: Path, session: int | None = None) -> Self:
        """The ring of another process."""
        return cls(SharedBlock.attach(path, session))

    @property
    def owner(self) -> str:
        """Whose it is, as its maker says it; empty for a ring of nobody in particular."""
        text = bytes(self.block.bytes[_START + self.capacity * _SLOT :][:_OWNER_BYTES])
        return text.partition(b"\0")[0].decode("utf-8", "surrogateescape")

    @owner.setter
    def owner(self, text: str) -> None:
        packed = text.encode("utf-8", "surrogateescape")[: _OWNER_BYTES - 1]
        self.block.bytes[_START + self.capacity * _SLOT :][:_OWNER_BYTES] = packed.ljust(_OWNER_BYTES, b"\0")

    @property
    def head(self) -> int:
        """How many samples have been published."""
        return self._words[_HEAD]

    @property
    def heartbeat_ns(self) -> int:
        """Monotonic time at which the loop last began a tick; 0 before the first."""
        return self._words[_HEARTBEAT]

    @property
    def safe_ns(self) -> int:
        """Monotonic time at which the device took the safe state from the loop, which has not commanded since; 0 when
        it commands."""
        return self._words[_SAFE]

    @property
    def safe_seen_ns(self) -> int:
        """Monotonic time at which the loop read that safe state back from the device; 0 when it did not."""
        return self._words[_SAFE_SEEN]

    @property
    def safe_is_doubted(self) -> bool:
        """The device took the safe state, and was lost or out of reach after it: it may have left it since."""
        return self._words[_SAFE_DOUBTED] != 0

    @property
    def safe_is_coming(self) -> bool:
        """The loop has told the device to be safe, which is on its way and has not been taken yet."""
        return self._words[_SAFE_COMING] != 0

    @property
    def recorded(self) -> int:
        """Cursor of the recorder, by which a virtual clock is paced."""
        return self._words[_RECORDER]

    @recorded.setter
    def recorded(self, cursor: int) -> None:
        self._words[_RECORDER] = cursor

    @property
    def device_message(self) -> str:
        """What the device last complained of, in the driver's words; empty when it never did."""
        for _ in range(_READS):  # odd: it is being written
            sequence = self._words[_MESSAGE_SEQUENCE]
            text = bytes(self.block.bytes[_TEXT : _TEXT + _TEXT_BYTES])
            if sequence % 2 == 0 and sequence == self._words[_MESSAGE_SEQUENCE]:
                return text.partition(b"\0")[0].decode("utf-8", "ignore")
        return ""

    def latest(self) -> Sample | None:
        """The newest sample; None before the first."""
        for _ in range(_READS):  # a reader that is overtaken by a whole turn of the ring tries again
            head = self.head
            if head == 0:
                return None
            packed = self.slot(head - 1)
            if packed is not None:
                return unpack(packed)
        return None

    def slot(self, sequence: int) -> bytes | None:
        """The packed sample number `sequence`; None when it has been overwritten or not yet published."""
        offset = _START + sequence % self.capacity * _SLOT
        word = offset // 8
        if self._words[word] != sequence + 1:
            return None
        packed = bytes(self.block.bytes[offset + 8 : offset + 8 + SAMPLE_BYTES])
        return packed if self._words[word] == sequence + 1 else None

    def pace(self, patience_s: float = PACE_PATIENCE_S, poll_s: float = _PACE_POLL_S) -> None:
        """Wait until the recorder has half the ring free: what a virtual clock may wait for before time passes.

        A recorder that does not move for `patience_s` is taken for dead; its losses are then counted, not waited for.
        """
        if self._words[_HEAD] - self._words[_RECORDER] <= self.capacity // 2:  # the usual tick pays for no more
            return
        seen, since = self.recorded, time.monotonic()
        while self.head - self.recorded > self.capacity // 2:
            time.sleep(poll_s)
            if self.recorded != seen:
                seen, since = self.recorded, time.monotonic()
            elif time.monotonic() - since > patience_s:
                self.recorded = self.head
                return


class RingWriter:
    """The loop's end. Nothing here allocates more than one packed sample, locks, or waits."""

    def __init__(self, ring: Ring) -> None:
        self._words = ring.block.words
        self._bytes = ring.block.bytes
        self._capacity = ring.capacity
        self._head = ring.head

    def beat(self, ahead_ns: int = 0) -> None:
        """Say that a tick has begun, or that something is under way which will be over in `ahead_ns`."""
        self._words[_HEARTBEAT] = time.monotonic_ns() + ahead_ns

    def not_safe(self) -> None:
        """Other set-points than the safe ones may stand from now on."""
        self._words[_SAFE] = self._words[_SAFE_SEEN] = self._words[_SAFE_COMING] = self._words[_SAFE_DOUBTED] = 0

    def doubt_safe(self) -> None:
        """The device may have left the safe state that was written last, which is written again."""
        self._words[_SAFE_SEEN] = 0
        self._words[_SAFE_DOUBTED] = 1

    def made_safe(self) -> None:
        """The device has taken the safe state."""
        self._words[_SAFE] = time.monotonic_ns()
        self._words[_SAFE_COMING] = self._words[_SAFE_DOUBTED] = 0

    def safe_coming(self, comes: bool) -> None:
        """Whether the safe state is on its way to the device, by somebody who outlives the loop."""
        self._words[_SAFE_COMING] = comes

    def saw_safe(self) -> None:
        """The device says that the safe state stands at its outputs."""
        self._words[_SAFE_SEEN] = time.monotonic_ns()

    def put_device_message(self, text: str) -> None:
        """Leave the device's words for whoever asks why; the newest replace the last. The sequence is odd meanwhile."""
        packed = text.encode("utf-8")[: _TEXT_BYTES - 1]
        self._words[_MESSAGE_SEQUENCE] += 1
        self._bytes[_TEXT : _TEXT + len(packed) + 1] = packed + b"\0"
        self._words[_MESSAGE_SEQUENCE] += 1

    def put(self, sample: Sample) -> None:
        """Publish one sample. Its slot reads as empty while it is being written."""
        offset = _START + self._head % self._capacity * _SLOT
        word = offset // 8
        self._words[word] = 0
        pack_into(sample, self._bytes, offset + 8)
        self._head += 1
        self._words[word] = self._head
        self._words[_HEAD] = self._head


class RingReader:
    """One reader's cursor. `lost` counts the samples that were overwritten before it came by."""

    def __init__(self, ring: Ring, start: int | None = None) -> None:
        self._ring = ring
        self.cursor = ring.head if start is None else start
        self.lost = 0

    def __iter__(self) -> Iterator[bytes]:
        """The packed samples published since the last call, oldest first."""
        head = self._ring.head
        oldest = max(head - self._ring.capacity, 0)
        if self.cursor < oldest:
            self.lost += oldest - self.cursor
            self.cursor = oldest
        while self.cursor < head:
            packed = self._ring.slot(self.cursor)
            self.cursor += 1
            if packed is None:
                self.lost += 1
            else:
                yield packed
