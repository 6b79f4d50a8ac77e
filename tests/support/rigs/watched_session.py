"""A session without its loop: real processes that may be struck, a device that is a list of calls, and whoever watches
them."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

from rig.errors import DeviceError
from rig.realtime.commands import Mailbox
from rig.realtime.ring import Ring, RingWriter
from rig.realtime.safe_report import SafeBlock, Writer
from rig.realtime.safe_state import SecondPath
from rig.service.session.process_watch import Loss, ProcessWatch

PERIOD_NS = 5_000_000
SLEEPER = [sys.executable, "-c", "import time; time.sleep(60)"]


class Process:
    """A process as multiprocessing shows one."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(SLEEPER)
        self.pid = self._process.pid

    def is_alive(self) -> bool:
        return self._process.poll() is None

    @property
    def exitcode(self) -> int | None:
        return self._process.poll()

    def send(self, number: int) -> None:
        self._process.send_signal(number)

    def end(self) -> None:
        self._process.kill()
        self._process.wait()


class Bench:
    """A session without its loop: a process that may be struck, and whoever watches it."""

    def __init__(self) -> None:
        name = f"test-{os.getpid()}-{time.monotonic_ns()}"
        self.ring, self.mailbox = Ring.create(f"{name}-ring", 1), Mailbox.private()
        self.block = SafeBlock.create(f"{name}-safe", 1)
        self.loop, self.recorder = Process(), Process()
        self.writer = RingWriter(self.ring)
        self.writer.beat()
        self.supervisor_works = True
        self.trouble = ""
        self.wrote_while_alive: list[bool] = []
        self.unreachable = False

    def safe(self) -> None:
        if self.unreachable:
            raise DeviceError("no reply")
        self.wrote_while_alive.append(self.loop.is_alive())

    def watch(self, second_path: Callable[[], SecondPath] | None = None) -> ProcessWatch:
        watchers = SimpleNamespace(
            processes={Writer.SUPERVISOR: 1}, block=self.block, trouble=lambda: self.trouble,
            works=lambda _: self.supervisor_works,
        )  # fmt: skip
        path = second_path or (lambda: SecondPath(self.safe, lambda: True))
        return ProcessWatch(
            self.ring, self.mailbox, cast(Any, watchers), cast(Any, self.loop), cast(Any, self.recorder),
            second_path=path, period_ns=PERIOD_NS,
        )  # fmt: skip

    def close(self) -> None:
        self.loop.end()
        self.recorder.end()
        self.ring.block.unlink()
        self.block.block.unlink()


def until(watch: ProcessWatch, condition: Callable[[], bool], patience_s: float = 5.0) -> list[Loss]:
    """Look until it is so; what was found lost meanwhile."""
    found, deadline = [], time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < deadline, "in vain"
        if loss := watch.look():
            found.append(loss)
        time.sleep(0.002)
    return found
