"""What all processes of a rig have in common: how they are started, named, and told apart from the outside."""

import contextlib
import logging
import os
import resource
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from rig.service.signals import own_signals

_LOG = logging.getLogger("pamrig")
DISK_PATIENCE_S: Final = 60.0
"""A disk that takes nothing for so long is given up, and with it what its recorder still holds. Set here alone."""
STEADY_S: Final = 30.0
"""A process that ran for longer did not die in a row with the one before it."""
DESCRIPTORS: Final = 1024
"""Open files that a daemon may need: places at the door and in the hall, and what its processes take, twice over."""


def allow_descriptors() -> None:
    """As many open files as this process may have, up to DESCRIPTORS: shells and services begin with fewer, and a crowd
    of clients takes them from who wants to stop the rig. The log says when there are not so many to be had."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    most = DESCRIPTORS if hard == resource.RLIM_INFINITY else min(hard, DESCRIPTORS)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
    if most < DESCRIPTORS:
        _LOG.warning(
            "at most %d files may be open (ulimit -Hn), where %d are needed: where clients have used them up, nobody "
            "but an emergency stop is heard, and no reset begins",
            most,
            DESCRIPTORS,
        )


class RestartDelays:
    """How long to wait before a process that died is started anew: the longer, the more have died in a row."""

    def __init__(self, pauses_s: Sequence[float], deaths: int = 0) -> None:
        """`pauses_s[n]` after `n` deaths in a row, the last one from there on; `deaths`: the count before any."""
        self._pauses_s, self._deaths, self._began_s = pauses_s, deaths, 0.0

    def began(self) -> None:
        """A process takes up its work now."""
        self._began_s = time.monotonic()

    def next_s(self) -> float:
        """It died: so long, in seconds, before the next."""
        self._deaths = 0 if time.monotonic() - self._began_s > STEADY_S else self._deaths + 1
        return self._pauses_s[min(self._deaths, len(self._pauses_s) - 1)]


def start_process(process: BaseProcess) -> None:
    """Start a process that the terminal's Ctrl-C does not reach, not even before its first line: that is for the one
    who commands."""
    ensure_running()  # multiprocessing's own helper would lift the mask when it is started on the way
    _stand_somewhere()
    with _struck_afterwards():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            with _without_main():
                process.start()
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _struck_afterwards() -> Iterator[None]:
    """What tells this process to end strikes when the new one has all that it is started with; else that one ends by a
    traceback. It is deaf to no signal itself: handlers are not inherited, as a mask would be."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    struck: list[int] = []
    with own_signals(lambda number, _: struck.append(number)):
        yield
    for number in struck:
        signal.raise_signal(number)


def _stand_somewhere() -> None:
    """A new process begins in our folder, and cannot begin in one that somebody has removed: a rig would not be reset
    any more."""
    try:
        os.getcwd()
    except FileNotFoundError:
        os.chdir("/")


@contextlib.contextmanager
def _without_main() -> Iterator[None]:
    """No main module for the new process: none of ours needs it, and a user's script that runs a rig in its first line
    would be run again by it."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def name_process(name: str) -> None:
    """What `ps` and `top` call this process; the kernel keeps 15 characters."""
    with contextlib.suppress(OSError):
        Path("/proc/self/comm").write_text(f"pamrig-{name}", encoding="ascii")


def stand_apart() -> None:
    """Leave the process group and session of who commands: what is sent to that group (Ctrl-\\ and the like by a
    terminal, `kill %1` by a shell, SIGKILL by `timeout`) is for him, and would end or stop those that see to the safe
    state together with him."""
    with contextlib.suppress(OSError):  # it leads a group already
        os.setsid()


def tell_commander(pipe: Connection, kind: str, content: object) -> None:
    """For the process that commands; one that is gone hears nothing, which keeps no loop from coming to its own end and
    is the more reason for a watcher to watch."""
    with contextlib.suppress(OSError):
        pipe.send((kind, content))


def is_stopped(pid: int | None) -> bool:
    """The process is in the state T of proc(5)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] in ("T", "t")
    except OSError:
        return False


def continue_process(process: BaseProcess) -> None:
    """Let it go on when somebody has stopped it by a signal."""
    if process.is_alive() and process.pid is not None:
        os.kill(process.pid, signal.SIGCONT)


def processes_json(session: Any) -> dict[str, dict[str, Any]]:
    """Pid and life of each process beside the daemon's own."""
    shown = {"control": {"pid": os.getpid(), "alive": True}}
    if session is not None:
        watchers = {writer.name.lower(): process for writer, process in session.watchers.processes.items()}
        for name, process in {"loop": session.loop, "recorder": session.recorder, **watchers}.items():
            if process is not None:
                shown[name] = {"pid": process.pid, "alive": process.is_alive()}
    return shown
