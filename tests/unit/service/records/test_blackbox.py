"""The black box: the last 30 s of a ring as a log, and what the memory of a dead daemon is good for."""

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader
from support.records.made_logs import made_log
from support.records.mcap_files import contents

from rig.errors import RecordError
from rig.log.reader import read
from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.shared import HEADER_WORDS, KEPT_RING
from rig.sample import Sample, unpack
from rig.service.records import blackbox

pytestmark = pytest.mark.real_time

PERIOD_NS = 5_000_000


def filled(ring: Ring, ticks: int, fault: Fault = Fault.NONE) -> Ring:
    writer = RingWriter(ring)
    for tick in range(ticks):
        values = dict.fromkeys(Sample._fields, 0) | {"tick": tick, "scheduled_ns": tick * PERIOD_NS}
        values["fault"] = int(fault) if tick == ticks - 1 else 0
        writer.put(Sample(**values))
    return ring


def owner(state: Path) -> blackbox.Owner:
    """The daemon with that state folder."""
    state.mkdir(exist_ok=True)
    return blackbox.Owner.of(state, "wrist")


def salvaged(ring: Ring, out: Path, by: blackbox.Owner | None = None) -> tuple[list[Path], list[str]]:
    """The black boxes, and what is said of `ring`; other tests beside this one leave rings of their own."""
    boxes, others = blackbox.salvage(out, by or owner(out))
    return boxes, [line for line in others if line.startswith(f"{ring.block.path}: ")]


@pytest.fixture
def ring(tmp_path: Path) -> Iterator[Ring]:
    ring = Ring.create(f"test-{os.getpid()}{KEPT_RING}", 42, owner=str(owner(tmp_path)))
    yield ring
    ring.block.unlink()


@pytest.fixture
def of_before(ring: Ring) -> None:
    """Another version made the ring, before there were any."""
    ring.block.words[4] = 0


def ticks_of(path: Path) -> list[int]:
    with path.open("rb") as file:
        return [
            unpack(m.data).tick for _, channel, m in make_reader(file).iter_messages() if channel.topic == "/rig/sample"
        ]


def test_it_holds_the_last_thirty_seconds_also_when_the_ring_has_gone_round(ring: Ring, tmp_path: Path) -> None:
    saved = blackbox.save(filled(ring, 9000), tmp_path, Fault.ESTOP, "by hand")
    assert ticks_of(saved) == list(range(9000 - 1 - 6000, 9000))
    assert saved.name.endswith("_estop.mcap")


def test_it_says_why(ring: Ring, tmp_path: Path) -> None:
    saved = blackbox.save(filled(ring, 10), tmp_path, Fault.BROKEN_WIRE, "monitor 1")
    with saved.open("rb") as file:
        lines = [m.data for _, channel, m in make_reader(file).iter_messages() if channel.topic == "/log"]
    assert len(lines) == 1
    assert b"BROKEN_WIRE: a monitor reads below its live zero" in lines[0]
    assert b"monitor 1" in lines[0]


def test_among_logs_it_is_left_out_and_said(ring: Ring, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    made_log(tmp_path / "sine.mcap", 400)
    saved = blackbox.save(filled(ring, 10), tmp_path, Fault.ESTOP, "by hand")
    assert [record.source for record in read(tmp_path)] == [tmp_path / "sine.mcap"]
    assert f"{saved}: left out: a black box, no record of a sweep" in caplog.text
    assert len(read(saved, phases=None)) == 1, "named itself it is read"


def test_an_empty_ring_gives_an_empty_log_not_an_error(ring: Ring, tmp_path: Path) -> None:
    assert ticks_of(blackbox.save(ring, tmp_path, Fault.LOOP_DIED, "")) == []


def test_the_ring_of_a_dead_daemon_is_saved_once_and_removed(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 100, Fault.FROZEN_SENSOR)
    _give_to_the_dead(ring)
    ((saved,), others) = salvaged(ring, tmp_path)
    assert others == []
    assert saved.name.endswith("_frozen_sensor.mcap")
    assert ticks_of(saved) == list(range(100))
    assert contents(saved).run["rig"] == "wrist"
    assert not ring.block.path.exists()
    assert salvaged(ring, tmp_path) == ([], [])


def test_a_folder_that_cannot_be_made_is_one_line_and_the_ring_stays(ring: Ring, tmp_path: Path) -> None:
    """On a full disk, or with a file in its place: the next daemon did not start."""
    _give_to_the_dead(filled(ring, 10))
    (tmp_path / "blackbox").write_text("not a folder")
    with pytest.raises(RecordError, match=r"blackbox: cannot be made: File exists$"):
        blackbox.save(ring, tmp_path / "blackbox", Fault.ESTOP, "")
    boxes, (said,) = salvaged(ring, tmp_path / "blackbox", owner(tmp_path))
    assert not boxes
    assert "cannot be written now" in said
    assert ring.block.path.exists()


def test_the_ring_of_a_dead_daemon_with_another_state_folder_stays_and_is_named(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 100)
    _give_to_the_dead(ring)
    other = owner(tmp_path / "of another rig")
    boxes, (line,) = salvaged(ring, tmp_path / "boxes", other)
    assert boxes == []
    assert line.startswith(f"{ring.block.path}: left by a dead daemon of the rig wrist, ")
    assert f"--state {tmp_path}" in line
    assert ring.block.path.exists()
    assert len(blackbox.salvage(tmp_path / "boxes", owner(tmp_path))[0]) == 1


def test_a_ring_that_says_nobody_s_name_stays(tmp_path: Path) -> None:
    ring = Ring.create(f"test-{os.getpid()}-nobody{KEPT_RING}", 42)
    try:
        _give_to_the_dead(filled(ring, 10))
        boxes, (line,) = salvaged(ring, tmp_path)
        assert (boxes, "does not say whose it is" in line) == ([], True)
        assert ring.block.path.exists()
    finally:
        ring.block.unlink()


def test_the_ring_of_another_version_stays_and_is_named(ring: Ring, tmp_path: Path, of_before: None) -> None:
    """It was read as if it were one of ours, and removed."""
    _give_to_the_dead(filled(ring, 10))
    boxes, (line,) = salvaged(ring, tmp_path / "boxes", owner(tmp_path))
    assert boxes == []
    assert line.endswith("which alone can read it; left by a dead daemon, and not touched")
    assert ring.block.path.exists()


def test_the_ring_of_a_living_daemon_is_left_alone(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 10)
    assert salvaged(ring, tmp_path) == ([], [])
    assert ring.block.path.exists()


def test_a_ring_that_is_none_is_only_removed(ring: Ring, tmp_path: Path) -> None:
    path = ring.block.path.with_name(f"pamrig-test-broken{KEPT_RING}")
    path.write_bytes(b"rubbish")
    assert salvaged(ring, tmp_path) == ([], [])
    assert not path.exists()


def test_the_rings_that_an_owner_does_not_want_are_removed_and_no_others(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 10)
    _give_to_the_dead(ring)
    blackbox.remove(owner(tmp_path / "other"))
    assert ring.block.path.exists()
    blackbox.remove(owner(tmp_path))
    assert not ring.block.path.exists()


def _give_to_the_dead(ring: Ring) -> None:
    """As if another process had made it, which has ended: its maker's pid stands behind the magic, and nobody holds a
    lock on the file."""
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    words = ring.block.words
    place = next(word for word in range(HEADER_WORDS) if words[word] == os.getpid())
    words[place] = ended.pid
    content = ring.block.path.read_bytes()
    ring.block.unlink()
    ring.block.path.write_bytes(content)


def test_one_that_the_disk_does_not_take_leaves_nothing_and_may_be_tried_again(
    ring: Ring, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    box = blackbox.take(filled(ring, 10), Fault.ESTOP, "")

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(RecordError, match="cannot be written: No space left on device"):
            box.write(tmp_path / "boxes")
    assert list((tmp_path / "boxes").iterdir()) == []
    filled(ring, 20)
    assert ticks_of(box.write(tmp_path / "boxes")) == list(range(10))
