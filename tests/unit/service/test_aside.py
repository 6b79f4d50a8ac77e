"""Work on disks that may stand still: done to its end, whoever waits, and waited for at the end with a patience."""

import _thread
import asyncio
import threading
from collections.abc import Callable
from pathlib import Path

import pytest

from rig.service import aside
from rig.service.aside import DiskWork, NoThread, ReadyThread, aside_or_here
from rig.service.records.free_space import FreeSpace


def test_what_was_begun_is_done_though_who_waited_has_gone_and_before_the_last() -> None:
    go, done, said = threading.Event(), list[str](), list[str]()

    def write() -> None:
        go.wait()
        done.append("written")

    async def look() -> str:
        disks = DiskWork()
        waits = asyncio.ensure_future(disks.do(write))
        await asyncio.sleep(0)
        waits.cancel()
        await asyncio.wait({waits})
        ending = asyncio.ensure_future(disks.end(lambda: done.append("last"), said.append))
        await asyncio.sleep(0)
        assert not done
        go.set()
        return await ending

    assert asyncio.run(look()) == ""
    assert done == ["written", "last"]
    assert not said, "it took no time"


def test_an_error_is_told_to_who_waits_and_no_matter_to_the_end() -> None:
    def refuse() -> None:
        raise OSError("no room")

    async def look() -> str:
        disks = DiskWork()
        with pytest.raises(OSError, match="no room"):
            await disks.do(refuse)
        return await disks.end(lambda: None, lambda _: None)

    assert asyncio.run(look()) == ""


def test_a_disk_that_stands_still_is_left_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(aside, "END_S", 0.0)
    free, done, said = threading.Event(), list[str](), list[str]()

    async def look() -> str:
        disks = DiskWork()
        disks.begin(free.wait)
        return await disks.end(lambda: done.append("last"), said.append)

    assert asyncio.run(look()) == (
        "a disk did not take within 0 s what was begun on it: look at the queue and the ledger"
    )
    assert not done, "the last is written by nobody beside what writes yet"
    assert said == ["waiting for the disk: queue, ledger or metrics"]
    free.set()


@pytest.fixture
def no_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """As at the most that a service may have (TasksMax), or without memory."""

    def refuse(*_: object) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(_thread, "start_new_thread", refuse)
    monkeypatch.setattr(threading.Thread, "start", refuse)


def test_without_a_thread_it_is_refused_or_done_here(no_threads: None) -> None:
    with pytest.raises(NoThread, match="this machine gives no thread for it; try again"):
        asyncio.run(DiskWork().do(list))
    assert asyncio.run(aside_or_here(lambda: 5)) == 5
    with pytest.raises(NoThread):
        ReadyThread()


def test_without_a_thread_the_room_for_records_is_not_known_and_the_daemon_goes_on(
    tmp_path: Path, no_threads: None
) -> None:
    """It ended, as of an error of its own, within half a second."""
    space = FreeSpace(tmp_path)
    asyncio.run(space.look())
    assert space.trouble == f"{tmp_path}: the disk does not answer"


def test_who_stands_by_is_there_for_the_next_attempt(caplog: pytest.LogCaptureFixture) -> None:
    hands, done = ReadyThread(), threading.Event()

    def fail() -> None:
        raise ValueError("a bug")

    hands.begin(fail)
    hands.begin(done.set)
    assert done.wait(10.0)
    hands.end()
    assert "a bug" in caplog.text


def test_a_thread_that_never_takes_up_its_work_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that comes up without memory: whoever waited for it waited for ever."""
    late: list[Callable[[], None]] = []
    monkeypatch.setattr(_thread, "start_new_thread", lambda work, _: late.append(work))
    monkeypatch.setattr(aside, "BEGINS_S", 0.0)
    done: list[str] = []
    with pytest.raises(NoThread):
        asyncio.run(DiskWork().do(lambda: done.append("done")))
    late[0]()
    assert not done, "who was told that nobody does it may have done it himself"
