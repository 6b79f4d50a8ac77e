"""The processes above the one that writes set-points: supervisor and guardian, their start, their life, their end.

Whoever writes set-points has them: the loop of a session, and the process of a command that holds a rig while somebody
types.
"""

import multiprocessing
import signal
import time
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final

from rig.errors import ConfigError, DeviceError, RigError
from rig.realtime.ring import Ring
from rig.realtime.safe_report import SafeBlock, Writer
from rig.service.processes import continue_process, start_process
from rig.service.session.process_setups import WatcherSetup
from rig.silence import Silence

WATCHER_PATIENCE_S: Final = 0.3
"""A watcher that has not looked for this long is stopped."""
_START_PATIENCE_S: Final = 30.0
_END_PATIENCE_S: Final = 5.0
_GONE_S: Final = 1.0
_READY_LOOK_S: Final = 0.1
"""How often `meanwhile` is called while a process starts: a tenth of the patience with the one who commands."""


WatcherEntry = Callable[[WatcherSetup, Connection], None]


class Watchers:
    """Supervisor and guardian of one process."""

    def __init__(self, session: int, ring: Ring, rig: Any, options: Mapping[str, Any]) -> None:
        self.block = SafeBlock.create(f"{session:016x}-safe", session)
        self.processes: dict[Writer, BaseProcess] = {}
        self._silences: dict[Writer, Silence] = {}
        self._session, self._ring, self._rig, self._options = session, ring, rig, options
        self._context = multiprocessing.get_context("spawn")
        self._pipes: dict[Writer, Connection] = {}

    def start(
        self,
        entry: WatcherEntry,
        pid: int,
        writers: tuple[Writer, ...],
        patience_ns: int | None = None,
        speak: bool = False,
    ) -> None:
        """Start watching `pid`; `await_ready` must follow."""
        for writer in writers:
            ours, theirs = self._context.Pipe()
            setup = WatcherSetup(
                writer, self._session, self._ring.block.path, self.block.block.path, pid, self._rig, self._options,
                patience_ns, speak,
            )  # fmt: skip
            process = self._context.Process(
                target=entry, args=(setup, theirs), name=f"pamrig-{writer.name.lower()}", daemon=False
            )
            start_process(process)
            theirs.close()
            self.processes[writer], self._pipes[writer] = process, ours
            self._silences[writer] = Silence(WATCHER_PATIENCE_S * 1e9)

    def await_ready(self, meanwhile: Callable[[], None] = lambda: None) -> dict[str, dict[str, Any]]:
        """Name -> the real-time measures of each, when all of them watch; RigError when one does not come so far."""
        ready = {}
        for writer, pipe in self._pipes.items():
            ready[writer.name.lower()] = await_ready(pipe, self.processes[writer], writer.name.lower(), meanwhile)
            pipe.close()
        self._pipes.clear()
        return ready

    def trouble(self) -> str:
        """Why the watchers cannot all be relied on; empty while they can."""
        return next((why for writer in self.processes if (why := self._trouble_of(writer))), "")

    def works(self, writer: Writer) -> bool:
        """That watcher is there and looks."""
        return writer in self.processes and not self._trouble_of(writer)

    def _trouble_of(self, writer: Writer) -> str:
        name = writer.name.lower()
        if not self.processes[writer].is_alive():
            return f"the {name}'s process is gone"
        silent = self._silences[writer].too_long(self.block.beat_ns(writer))
        return f"the {name} has not moved for {WATCHER_PATIENCE_S:g} s" if silent else ""

    def wake(self) -> None:
        """Let those go on that somebody stopped, so that they come to a proper end."""
        for process in self.processes.values():
            continue_process(process)

    def end(self) -> None:
        """They end by themselves when they have seen their process end, or when released; one that does not is of no
        use any more."""
        for process in self.processes.values():
            process.join(_END_PATIENCE_S)
            if process.is_alive():
                process.kill()
                process.join()
        for pipe in self._pipes.values():
            pipe.close()
        self.block.block.unlink()


def await_ready(
    pipe: Connection, process: BaseProcess, who: str, meanwhile: Callable[[], None] = lambda: None
) -> dict[str, Any]:
    """What a process says when it is ready, or the error that it met instead."""
    deadline = time.monotonic() + _START_PATIENCE_S
    while time.monotonic() < deadline:
        meanwhile()
        try:
            if pipe.poll(_READY_LOOK_S):
                kind, content = pipe.recv()
                if kind == "ready":
                    return dict(content)
                raise {"device": DeviceError, "config": ConfigError}.get(kind, RigError)(content)
        except (EOFError, ConnectionResetError):  # the other: with a word unread that it was told
            break
    else:
        raise RigError(
            f"the {who}'s process was not ready within {_START_PATIENCE_S:g} s; is this machine busy? Else run `pamrig "
            "devices probe` to see whether the device answers"
        )
    if name := _ended_by(process):
        raise RigError(f"the {who}'s process was ended by {name} before anything was written to the rig")
    raise RigError(
        f"the {who}'s process ended before it was ready; run `pamrig devices probe` to see the device's answer"
    )


def _ended_by(process: BaseProcess) -> str:
    """The name of the signal that ended it; empty for one that ended otherwise."""
    process.join(_GONE_S)  # its end of the pipe closes a moment before it is gone
    code = process.exitcode
    return signal.Signals(-code).name if code is not None and code < 0 else ""
