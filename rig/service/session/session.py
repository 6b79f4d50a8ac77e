"""A session: the processes of loop, recorder and watchers, the shared memory between them, and their end.

It composes what it is given; which device the loop drives is decided at the roof. `pamrig run` drives a session by a
script, the daemon by its mailbox.
"""

import logging
import multiprocessing
import secrets
import signal
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Self

from rig.number_text import counted
from rig.realtime.commands import Mailbox, program_name, program_path
from rig.realtime.program import Program
from rig.realtime.ring import CAPACITY, Ring
from rig.realtime.safe_report import Writer
from rig.realtime.shared import KEPT_RING, SharedBlock, sweep_stale
from rig.service.processes import continue_process, start_process
from rig.service.records.recorder_messages import RunResult
from rig.service.session.heir import Heir
from rig.service.session.process_setups import LoopSetup
from rig.service.session.process_watch import PathMaker, ProcessWatch, reported_by_loop
from rig.service.session.recording import SessionRecording
from rig.service.session.session_end import SessionEnd
from rig.service.session.watchers import WatcherEntry, Watchers, await_ready
from rig.service.signals import own_signals

LoopEntry = Callable[[LoopSetup, Connection], None]
Insistence = Callable[[Callable[[], bool], Callable[[], None]], str]
"""Takes (done, attempt): calls `attempt` until `done` is true, or until it gives up. Returns how it went, in words."""
END_PATIENCE_S = 5.0
"""For a loop to leave through its safe state, which has a bound of its own (`rig.realtime.way_out.LEAVING_NS`); then it
is killed."""
_END_LOOK_S = 0.02
_LOG = logging.getLogger("pamrig")
SWEPT = "shared memory: removed"
SAFE_STATE_S = 3.0
"""For the safe state of a loop that has ended, however it ended."""


@dataclass(frozen=True)
class Watching:
    """How a session is looked after."""

    entry: WatcherEntry
    writers: tuple[Writer, ...]
    """Who watches; a guardian only where something stays under pressure when the loop is gone."""
    second_path: PathMaker | None
    """This process's own way to the device; None: the plant ends with the loop's process."""
    heir: Callable[[], Heir] | None = None
    """Appoints who goes on where this process is lost while it tries without a session; None: nobody."""


class Session:
    """Start with `open`, use, and leave with `close` (or as a context manager): the loop ends safe on every path."""

    def __init__(
        self,
        entry: LoopEntry,
        rig: Any,
        *,
        virtual: bool = False,
        seed: int | None = None,
        options: Mapping[str, Any] | None = None,
        watching: Watching | None = None,
        ring_suffix: str = "-ring",
    ) -> None:
        """Without `watching` nobody stands above the loop: for a plant that lives in the loop's process. StateError,
        and nothing is left behind, where shared memory gives no room.

        Rings whose name ends with KEPT_RING are kept for the black box of their owner when their session is dead.
        """
        self.id = secrets.randbits(63)
        self.facts: dict[str, Any] = {}
        """What the loop's process said when it was ready: device, real-time measures, cost."""
        self._entry, self._rig, self.virtual, self._seed = entry, rig, virtual, seed
        self._options = dict(options or {})
        self._context = multiprocessing.get_context("spawn")
        swept = len(sweep_stale(KEPT_RING))
        self.swept = f"{SWEPT} {counted(swept, 'block')} of processes that were killed" if swept else ""
        """What of dead processes lay in shared memory, and was removed, in words."""
        name = f"{self.id:016x}"
        with ExitStack() as half_made:
            self.ring = Ring.create(f"{name}{ring_suffix}", self.id, CAPACITY)
            half_made.callback(self.ring.block.unlink)
            self.mailbox = Mailbox.create(f"{name}-mailbox", self.id)
            half_made.callback(self.mailbox.block.unlink)
            self.watchers = Watchers(self.id, self.ring, rig, self._options)
            half_made.pop_all()
        self._blocks: list[SharedBlock] = [self.ring.block, self.mailbox.block]
        self._programs: dict[int, SharedBlock] = {}
        self._watching = watching
        self.watch: ProcessWatch | None = None
        """From the moment on at which the processes are there."""
        self.end = SessionEnd()
        """What became of the rig; known once the session has ended."""
        self.loop: BaseProcess | None = None
        self.recording = SessionRecording(self.ring, self.id)
        self._dismissed = False
        self._loop_pipe: Connection | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        """Ctrl-C, and its like, once more: whoever leaves is under way already."""
        with own_signals(signal.SIG_IGN):
            self.close()

    def open(
        self, programs: Sequence[Program] = (), *, scripted: bool = False, meanwhile: Callable[[], None] = lambda: None
    ) -> None:
        """Start the processes and wait until the loop has its device open. DeviceError or RigError when it cannot.
        `meanwhile` is called ten times a second; what it raises ends the waiting: a device may take half a minute."""

        def look() -> None:
            self.beat()
            meanwhile()

        for program in programs:
            self.publish(program)
        recorder = self.recording.start(self._context)
        ours, theirs = self._context.Pipe()
        setup = LoopSetup(
            self.id, self.ring.block.path, self.mailbox.block.path, self._rig, self.virtual, self._seed,
            tuple(p.run for p in programs) if scripted else None, self._options,
        )  # fmt: skip
        self.loop = self._context.Process(target=self._entry, args=(setup, theirs), name="pamrig-loop", daemon=False)
        start_process(self.loop)
        theirs.close()
        self._loop_pipe = ours
        if self._watching is not None and self.loop.pid is not None:
            self.watchers.start(self._watching.entry, self.loop.pid, self._watching.writers)
        self.facts = await_ready(ours, self.loop, "loop", look)
        self.facts |= self.watchers.await_ready(look)
        self.watch = ProcessWatch(
            self.ring, self.mailbox, self.watchers, self.loop, recorder,
            second_path=self._watching.second_path if self._watching else None,
            period_ns=self._rig.period_ns, timed=not self.virtual,
        )  # fmt: skip

    def publish(self, program: Program) -> None:
        """Put a program into shared memory, where the loop finds it."""
        self._programs[program.run] = program.publish(program_name(self.id, program.run), self.id)

    def adopt(self, run: int) -> None:
        """Take over a program that another process has put where the loop finds it."""
        self._programs[run] = SharedBlock.adopt(program_path(self.id, run), self.id)

    def retire(self, run: int) -> None:
        """Let go of the program of a run that is over."""
        if block := self._programs.pop(run, None):
            block.unlink()
            block.close()

    def end_recording(self) -> None:
        """Let the recorder finish what is open, and end: there is no loop any more. To be called again and again, as
        `SessionRecording.finish`."""
        self.recording.finish(None if self.watch is None else self.watch.loop_fault)

    def beat(self) -> None:
        """Say that we are here; once said, say it at least each second. In virtual time there is nothing that could be
        late."""
        if not self.virtual:
            self.mailbox.beat()

    def go(self) -> None:
        """Let the loop begin to tick."""
        self.beat()
        if self._loop_pipe is not None:
            with suppress(OSError):  # it has ended: seen and told by whoever waits for it
                self._loop_pipe.send("go")

    @property
    def loop_alive(self) -> bool:
        """The loop's process is there."""
        return self.loop is not None and self.loop.is_alive()

    @property
    def recorder(self) -> BaseProcess | None:
        """The recorder's process."""
        return self.recording.process

    @property
    def recorder_alive(self) -> bool:
        """The recorder's process is there."""
        return self.recorder is not None and self.recorder.is_alive()

    def loop_error(self) -> str:
        """The one line that the loop's process left when it ended in an error; empty without one."""
        with suppress(EOFError, OSError, AttributeError):
            if self._loop_pipe is not None and self._loop_pipe.poll():
                kind, text = self._loop_pipe.recv()
                return str(text) if kind != "ready" else ""
        return ""

    def close(self, say: Callable[[str], None] = _LOG.warning, insist: Insistence | None = None) -> list[RunResult]:
        """End the loop through its safe state, let the recorder finish, remove the shared memory. Returns the results
        that have come since, those of records that the recorder left unfinished among them.

        Afterwards `end` says what became of the rig. If the loop could not make it safe, this process and the watchers
        try, for a few seconds, and then for as long as `insist` goes on calling. While the recorder is waited for,
        `say` gets a line every few seconds; `recording.given_up` says why, if the waiting was in vain.
        """
        self.watchers.wake()  # a process that somebody stopped is to come to a proper end
        if self.recorder is not None:
            continue_process(self.recorder)
        self._end_loop()
        self.end = self._seen_at_the_device(insist)
        if self.watch is not None and self.end.unsafe:
            self.watchers.block.release()  # they would go on trying, while the next session waits for them
        self.watchers.end()
        if self.watch is not None:
            self.watch.close()
        results = self.recording.end(say, self.end_recording)
        for block in (*self._blocks, *self._programs.values()):
            block.unlink()
        self.recording.close()
        if self._loop_pipe is not None:
            self._loop_pipe.close()
        return results

    def _seen_at_the_device(self, insist: Insistence | None) -> SessionEnd:
        """What became of the rig of a loop that has ended."""
        ticked, watch = self.ring.heartbeat_ns != 0, self.watch
        if watch is None:  # it was given up while it opened; a loop that had the device has left safe all the same
            return SessionEnd(ticked, reported_by_loop(self.ring))
        if not ticked:
            return SessionEnd(ticked)
        report = watch.settle(SAFE_STATE_S)
        if report.safe or insist is None:
            return SessionEnd(ticked, report)
        self.end_recording()
        insisted = insist(watch.is_settled, watch.follow_up)
        return SessionEnd(ticked, watch.safe, insisted)

    def dismiss_loop(self) -> None:
        """Tell the loop to end through its safe state, without waiting for it. Later calls do nothing."""
        if self.loop is None or not self.loop.is_alive() or self._dismissed:
            return
        self._dismissed = True
        with suppress(OSError):
            if self._loop_pipe is not None:
                self._loop_pipe.send("end")  # for a loop that still waits for its `go`
        self.loop.terminate()  # SIGTERM: safe state, then the end
        if not self.ring.heartbeat_ns:
            continue_process(self.loop)  # nothing of its own stands at the device: it may go on, to its end

    def _end_loop(self) -> None:
        loop = self.loop
        if loop is None:
            return
        self.dismiss_loop()
        deadline = time.monotonic() + END_PATIENCE_S
        while loop.is_alive() and time.monotonic() < deadline:
            if self.watch is not None:
                self.watch.follow_up()  # one that was stopped does not hear the signal
            loop.join(_END_LOOK_S)
        if loop.is_alive():
            loop.kill()
            loop.join()
