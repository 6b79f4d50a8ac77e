"""The room for records is told also while its disk does not answer, and nobody waits for it for long."""

import asyncio
import gc
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rig.service.aside import NoThread
from rig.service.records import free_space
from rig.service.records.free_space import FreeSpace


def test_the_room_and_a_folder_that_is_gone(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    logs.mkdir()
    space = FreeSpace(logs)
    assert (space.gb or 0.0) > 0.0
    assert space.trouble == ""
    logs.rmdir()
    asyncio.run(space.look())
    assert space.gb is None
    assert space.trouble == f"{logs}: the folder for the records is gone"


def test_a_disk_that_does_not_answer_holds_nobody_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each status asked it, in the process that answers to an emergency stop: a file server that stood still stopped
    the rig, and nobody was answered for as long."""
    answers, asked = threading.Event(), list[int]()

    def slowly(_: Path) -> Any:
        asked.append(threading.get_ident())
        assert answers.wait(30.0)
        return SimpleNamespace(free=2e9)

    space = FreeSpace(tmp_path)
    seen = space.gb
    monkeypatch.setattr(free_space.shutil, "disk_usage", slowly)
    monkeypatch.setattr(free_space, "DISK_SILENCE_S", 0.01)

    async def look() -> None:
        await asyncio.gather(space.look(), space.look())
        assert space.trouble == f"{tmp_path}: the disk does not answer"
        assert space.gb == seen
        assert len(asked) == 1
        answers.set()
        while space.trouble:
            await space.look()

    asyncio.run(look())
    assert space.gb == 2.0
    assert threading.get_ident() not in asked


def test_what_does_not_answer_keeps_no_process_from_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    answers = threading.Event()
    space = FreeSpace(tmp_path)
    monkeypatch.setattr(free_space.shutil, "disk_usage", lambda _: answers.wait(30.0))
    monkeypatch.setattr(free_space, "DISK_SILENCE_S", 0.01)
    asyncio.run(space.look())  # comes to an end
    assert space.trouble
    answers.set()


def test_a_look_that_found_no_thread_is_no_error_of_the_daemons_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was a traceback in the log: "Task exception was never retrieved"."""
    said: list[object] = []

    async def no_thread(_: object) -> float:
        await asyncio.sleep(0.01)
        raise NoThread("this machine gives no thread for it")

    async def look() -> None:
        asyncio.get_running_loop().set_exception_handler(lambda _, context: said.append(context))
        space = FreeSpace(tmp_path)
        await space.look()
        await asyncio.sleep(0.05)
        await space.look()  # asks anew
        gc.collect()

    monkeypatch.setattr(free_space, "aside", no_thread)
    monkeypatch.setattr(free_space, "DISK_SILENCE_S", 0.001)
    asyncio.run(look())
    assert not said
