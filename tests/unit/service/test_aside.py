"""Work on disks that may stand still: done to its end, whoever waits, and waited for at the end with a patience."""

import asyncio
import threading

import pytest

from rig.service import aside
from rig.service.aside import DiskWork


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
