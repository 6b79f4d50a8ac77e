"""What lies in shared memory has a version: two pamrigs that differ do not read each other."""

import multiprocessing
import os
import zlib

import pytest
from support.scripted import program
from support.shared_names import unused_name

from rig.errors import LayoutError
from rig.realtime import shared
from rig.realtime.commands import Mailbox, Request
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeBlock, SafeReport, Writer
from rig.realtime.shared import LAYOUT, SharedBlock
from rig.sample import Sample
from rig.service.records.recorder import record

SESSION = 0xABC
BYTES = {4: (2150258167, 40446327, 339769178, 2229063801)}
"""Version of the layout -> checksums of the blocks below."""


name = pytest.fixture(unused_name)


def checksum(block: SharedBlock) -> int:
    """Of all that does not depend on the process."""
    found = bytes(block.bytes).replace(os.getpid().to_bytes(8, "little"), bytes(8), 1)
    return zlib.crc32(found)


def full_ring(name: str) -> SharedBlock:
    """Each word and each field holds something of its own, as far as no clock is asked."""
    ring = Ring.create(name, SESSION, 2, owner="somebody")
    writer = RingWriter(ring)
    writer.put(Sample._make(range(1, len(Sample._fields) + 1)))
    writer.put_device_message("no answer")
    writer.beat()
    writer.made_safe()
    writer.doubt_safe()
    writer.saw_safe()
    return ring.block


@pytest.fixture(autouse=True)
def standing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("time.monotonic_ns", lambda: 1 << 40)


def test_a_changed_layout_has_another_version(name: str) -> None:
    ring = full_ring(f"{name}-ring")
    mailbox = Mailbox.create(f"{name}-mailbox", SESSION)
    mailbox.post(Request.START, 5)
    mailbox.stop()
    mailbox.estop()
    mailbox.beat()
    safe = SafeBlock.create(f"{name}-safe", SESSION)
    safe.beat(Writer.GUARDIAN)
    safe.tell(SafeReport(Writer.SUPERVISOR, LoopVerdict.SILENT, Outcome.WRITTEN, 1, 2, 3, 4))
    safe.release()
    blocks = (ring, mailbox.block, safe.block, program().publish(f"{name}-program", SESSION))
    assert tuple(map(checksum, blocks)) == BYTES[LAYOUT], (
        "what lies in shared memory has changed: raise rig.realtime.shared.LAYOUT, and put these checksums beside it"
    )


def test_a_block_of_another_version_is_one_line(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    block = SharedBlock.create(name, SESSION, 64)
    monkeypatch.setattr(shared, "LAYOUT", LAYOUT + 1)
    with pytest.raises(LayoutError) as error:
        SharedBlock.attach(block.path, SESSION)
    assert str(error.value) == (
        f"{block.path}: made by another version of pamrig (layout {LAYOUT}, here {LAYOUT + 1}), which alone can read it"
    )


def test_a_recorder_of_another_version_says_so(name: str) -> None:
    """Its package was replaced while the daemon ran: the next session's processes are of the new one."""
    ring = Ring.create(name, SESSION, 2)
    ring.block.words[4] = LAYOUT + 1
    told, tells = multiprocessing.Pipe(duplex=False)
    arguments = (ring.block.path, SESSION, tells, tells)
    process = multiprocessing.get_context("spawn").Process(target=record, args=arguments)
    process.start()
    trouble = told.recv()
    process.join()
    assert process.exitcode == 0
    assert trouble.final
    assert f"made by another version of pamrig (layout {LAYOUT + 1}, here {LAYOUT})" in trouble.error
