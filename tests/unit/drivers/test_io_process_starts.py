"""An I/O process that this machine does not let begin: the device is lost, as any other, and whoever makes safe tries
again."""

import errno
import fcntl
import os
import subprocess
import time
import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.io_process import lookup
from drivers.io_process.lookup import find, path_for
from drivers.io_process.mailbox import create
from drivers.io_process.owner import IoProcess
from drivers.io_process.worker import WorkerSetup
from rig.errors import DeviceLost


@pytest.fixture
def wire() -> Iterator[str]:
    resource = f"/dev/{uuid.uuid4().hex}"
    yield resource
    path_for(resource).unlink(missing_ok=True)


@pytest.mark.parametrize(("module", "call", "number", "says"), [
    (os, "posix_fallocate", errno.ENOSPC, "the mailbox of an I/O process cannot be made: No space left on device"),
    (os, "pwrite", errno.ENOSPC, "the mailbox of an I/O process cannot be made: No space left on device"),
    (os, "pipe2", errno.EMFILE, "its I/O process cannot be started: Too many open files"),
    (subprocess, "Popen", errno.EAGAIN, "its I/O process cannot be started: Resource temporarily unavailable"),
])  # fmt: skip
def test_a_machine_that_gives_nothing_is_a_device_that_is_lost(
    wire: str, module: object, call: str, number: int, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a full /dev/shm or no process to be had a loop ended by an error of the program, in the middle of making
    safe."""

    def refuse(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    io = IoProcess(wire, WorkerSetup("m", {}, (), 0), WorkerSetup("m", {}, (), 0), 1)
    with monkeypatch.context() as patched:
        patched.setattr(module, call, refuse)
        with pytest.raises(DeviceLost, match=says):
            io.begin_rescue()
    assert find(wire) is None
    assert not path_for(wire).exists()
    assert not io.running


@pytest.fixture
def shared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in the place of /dev/shm, where others have theirs."""
    monkeypatch.setattr(lookup, "folder", lambda: tmp_path)
    return tmp_path


def left_at(path: Path) -> Path:
    """What an I/O process left that was killed with its owner."""
    descriptor = create(path)
    assert descriptor is not None
    os.close(descriptor)
    return path


def test_what_was_killed_with_its_owner_leaves_nothing_after_the_next_start(shared: Path) -> None:
    """Whatever wire it was for: nobody may ever use that one again."""
    dead = left_at(path_for("another wire"))
    living = path_for("a wire in use")
    held = create(living)
    theirs = left_at(shared / f"pamrigio-{os.getuid() + 1}-0123456789abcdef")
    trap = shared / f"pamrigio-{os.getuid()}-trap"
    os.mkfifo(trap)
    io = IoProcess("a wire", WorkerSetup("m", {}, (), 0), WorkerSetup("m", {}, (), 0), 1)
    with pytest.raises(DeviceLost):  # no such module
        io.start()
    assert sorted(shared.iterdir()) == sorted([living, theirs, trap])
    assert held is not None
    os.close(held)
    assert not dead.exists()


@pytest.mark.skipif(os.geteuid() != 0, reason="gives a file to another user")
def test_a_file_of_another_user_in_one_s_own_name_is_left_to_him(shared: Path) -> None:
    forged = left_at(path_for("a wire"))
    os.chown(forged, 12345, 12345)
    lookup.remove_left()
    assert forged.exists()


def test_who_only_looks_keeps_nobody_from_his_mailbox(shared: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """He has its lock for a moment: the wire was called in use by another I/O process."""
    path = left_at(path_for("a wire"))
    looking = path.open("rb")
    fcntl.flock(looking, fcntl.LOCK_SH)
    monkeypatch.setattr(time, "sleep", lambda _: fcntl.flock(looking, fcntl.LOCK_UN))
    descriptor = create(path)
    assert descriptor is not None
    os.close(descriptor)
    looking.close()
