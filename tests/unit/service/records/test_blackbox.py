"""The black box: the last 30 s of a ring as a log, and what the memory of a dead daemon is good for."""

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from mcap.reader import make_reader

from rig.realtime.faults import Fault
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.shared import HEADER_WORDS, KEPT_RING
from rig.sample import Sample, unpack
from rig.service.records import blackbox

pytestmark = pytest.mark.real_time

PERIOD_NS = 5_000_000


def filled(ring: Ring, ticks: int, fault: Fault = Fault.NONE) -> Ring:
    writer = RingWriter(ring, os.getpid())
    for tick in range(ticks):
        values = dict.fromkeys(Sample._fields, 0) | {"tick": tick, "scheduled_ns": tick * PERIOD_NS}
        values["fault"] = int(fault) if tick == ticks - 1 else 0
        writer.put(Sample(**values))
    return ring


@pytest.fixture
def ring() -> Iterator[Ring]:
    ring = Ring.create(f"test-{os.getpid()}{KEPT_RING}", 42)
    yield ring
    ring.block.unlink()


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


def test_an_empty_ring_gives_an_empty_log_not_an_error(ring: Ring, tmp_path: Path) -> None:
    assert ticks_of(blackbox.save(ring, tmp_path, Fault.LOOP_DIED, "")) == []


def test_the_ring_of_a_dead_daemon_is_saved_once_and_removed(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 100, Fault.FROZEN_SENSOR)
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    _give_to(ring, ended.pid)
    (saved,) = blackbox.salvage(tmp_path)
    assert saved.name.endswith("_frozen_sensor.mcap")
    assert ticks_of(saved) == list(range(100))
    assert not ring.block.path.exists()
    assert blackbox.salvage(tmp_path) == []


def test_the_ring_of_a_living_daemon_is_left_alone(ring: Ring, tmp_path: Path) -> None:
    filled(ring, 10)
    assert blackbox.salvage(tmp_path) == []
    assert ring.block.path.exists()


def test_a_ring_that_is_none_is_only_removed(ring: Ring, tmp_path: Path) -> None:
    path = ring.block.path.with_name(f"pamrig-test-broken{KEPT_RING}")
    path.write_bytes(b"rubbish")
    assert blackbox.salvage(tmp_path) == []
    assert not path.exists()


def _give_to(ring: Ring, pid: int) -> None:
    """As if another process had made it: its maker's pid stands behind the magic."""
    words = ring.block.words
    place = next(word for word in range(HEADER_WORDS) if words[word] == os.getpid())
    words[place] = pid
