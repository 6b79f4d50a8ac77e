"""A session, and its like, whose shared memory gives room for a part of it only, leaves nothing there."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rig.app import compose
from rig.app.supervised_command import SupervisedCommand
from rig.errors import StateError
from rig.realtime import shared
from rig.service.session.heir import Heir
from rig.service.session.session import Session


def nobody(*_: object) -> None:
    """An entry that is never called."""


MAKERS: dict[str, tuple[int, Callable[[], Any]]] = {
    "session": (3, lambda: Session(nobody, compose.load(None), virtual=True)),
    "heir": (2, lambda: Heir(nobody, compose.load(None))),
    "command": (2, lambda: SupervisedCommand(compose.load(None))),
}
CASES = [(name, room) for name, (blocks, _) in MAKERS.items() for room in range(blocks)]


def of_this_process() -> list[Path]:
    return [path for path in shared.folder().glob("*pamrig-*") if shared.living_owner(path) == os.getpid()]


@pytest.mark.parametrize(("name", "room"), CASES)
def test_what_was_made_before_the_memory_was_full_is_removed(
    name: str, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The blocks before the one that failed stayed for as long as the daemon lived: some more with each reset."""
    taken, before, has_room = list[int](), of_this_process(), os.posix_fallocate

    def fallocate(descriptor: int, offset: int, size: int) -> None:
        taken.append(size)
        if len(taken) > room:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        has_room(descriptor, offset, size)

    monkeypatch.setattr(os, "posix_fallocate", fallocate)
    with pytest.raises(StateError, match="cannot be made: No space left on device"):
        MAKERS[name][1]()
    assert len(taken) == room + 1
    assert of_this_process() == before
