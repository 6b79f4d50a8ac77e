"""The recorder of a session, seen from who commands: its process, what it is told of runs, and what it answers."""

import select
import threading
from collections.abc import Callable, Iterator
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

from rig.realtime.faults import Fault
from rig.realtime.ring import Ring
from rig.service.processes import start_process
from rig.service.records.recorder_messages import Mark, RecorderTrouble, RunOrder, RunResult
from rig.service.session.recorder_end import abandoned, await_end


def _recorder(*arguments: Any) -> None:
    """Entry of the recorder's process, which alone loads what files are written with."""
    from rig.service.records.recorder import record

    record(*arguments)


class SessionRecording:
    """Starts the recorder's process, orders runs from it (`expect`), tells it to `finish`, and waits for its `end`."""

    def __init__(self, ring: Ring, session: int) -> None:
        self._ring, self._session = ring, session
        self.process: BaseProcess | None = None
        self.trouble: RecorderTrouble | None = None
        """Why the recorder's file takes nothing at present, as far as `results` has heard."""
        self.given_up = ""
        """Why the recorder was killed at its end; empty when it was not."""
        self._orders: Connection | None = None
        self._results: Connection | None = None
        self._sending = threading.Lock()
        """Orders are longer than what a pipe takes at once: two writers would mix theirs."""
        self._finishing = False
        self._awaited: dict[int, Path] = {}
        """The files of the runs that the recorder was told of and has given no result for."""

    def start(self, context: SpawnContext) -> BaseProcess:
        """Start the recorder's process."""
        orders, self._orders = context.Pipe(duplex=False)
        self._results, results = context.Pipe(duplex=False)
        arguments = (self._ring.block.path, self._session, orders, results)
        self.process = context.Process(target=_recorder, args=arguments, name="pamrig-recorder", daemon=False)
        start_process(self.process)
        orders.close()
        results.close()
        return self.process

    def expect(self, order: RunOrder | Mark) -> None:
        """Tell the recorder of a run before it starts, or of a marker in the run that is recorded. This blocks while
        the recorder does not read its orders: do not call it where nothing may wait."""
        if self._orders is not None:
            if isinstance(order, RunOrder):
                self._awaited[order.run] = order.path
            # a recorder that is gone is the watch's business, and no broken pipe of the command's output
            with self._sending, suppress(OSError):
                self._orders.send(order)

    def call_off(self, run: int) -> None:
        """The recorder was told of a run that does not begin: nothing is lost of it."""
        self._awaited.pop(run, None)

    def finish(self, loop_fault: Fault | None) -> None:
        """Tell the recorder to finish the open record and to end, for the loop has ended, by `loop_fault`. It never
        blocks: as long as the recorder has not read earlier orders nothing is sent, so call it until the recorder has
        ended."""
        if self._orders is None or self._finishing or not self._sending.acquire(blocking=False):
            return
        try:
            if _has_room(self._orders):
                self._finishing = True
                with suppress(OSError):
                    self._orders.send(loop_fault)
        finally:
            self._sending.release()

    def results(self) -> Iterator[RunResult]:
        """The runs that have been finished since the last call."""
        if self._results is None:
            return
        with suppress(EOFError, OSError):
            while self._results.poll():
                word = self._results.recv()
                if isinstance(word, RecorderTrouble):
                    self.trouble = word if word.error else None
                else:
                    self.trouble = None
                    self._awaited.pop(word.run, None)
                    yield word

    def end(self, say: Callable[[str], None], finish: Callable[[], None]) -> list[RunResult]:
        """Wait for the recorder's end, and call `finish` and `say` (a line every few seconds) meanwhile. Returns the
        last results, those of records that it left unfinished among them."""
        if self.process is None:
            return []
        left: list[RunResult] = []

        def look() -> None:
            finish()
            left.extend(self.results())

        look()
        self.given_up = await_end(self.process, self._ring, say, look)
        left += self.results()
        return left + abandoned(self._awaited, self._ring, self.given_up or "the recorder ended")

    def close(self) -> None:
        """Close its pipes."""
        for pipe in (self._orders, self._results):
            if pipe is not None:
                pipe.close()


def _has_room(pipe: Connection) -> bool:
    """Whether a short word goes into the pipe without waiting for its reader; also when there is none any more."""
    look = select.poll()
    look.register(pipe.fileno(), select.POLLOUT)
    return bool(look.poll(0))
