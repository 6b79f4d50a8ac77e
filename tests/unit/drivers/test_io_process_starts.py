"""An I/O process that this machine does not let begin: the device is lost, as any other, and whoever makes safe tries
again."""

import errno
import os
import subprocess
import uuid
from collections.abc import Iterator

import pytest

from drivers.io_process.lookup import find, path_for
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
