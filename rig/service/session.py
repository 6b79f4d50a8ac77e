"""A session: the processes of loop, recorder and supervisor, the shared memory between them, and their end.

It composes what it is given; which device the loop drives is decided at the roof. `pamrig run` drives a session by a
script, the daemon by its mailbox.
"""

import multiprocessing
import os
import secrets
import signal
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from typing import Any, Self

from rig.errors import ConfigError, DeviceError, RigError
from rig.realtime.commands import Mailbox, program_name, program_path
from rig.realtime.program import Program
from rig.realtime.ring import CAPACITY, Ring
from rig.realtime.shared import KEPT_RING, SharedBlock, sweep_stale
from rig.realtime.supervisor import SupervisorBlock
from rig.service.recorder import RunOrder, RunResult, record

LoopEntry = Callable[["LoopOrders", Connection], None]
SupervisorEntry = Callable[["SupervisorOrders", Connection], None]
START_PATIENCE_S = 30.0
END_PATIENCE_S = 5.0


@dataclass(frozen=True)
class LoopOrders:
    """What the loop's process is told when it starts; everything in it can be pickled."""

    session: int
    ring: Path
    mailbox: Path
    rig: Any
    """A RigConfig; the roof knows what to do with it."""
    virtual: bool = False
    seed: int | None = None
    script: tuple[int, ...] | None = None
    """Numbers of the runs to carry out one after the other; None: obey the mailbox."""
    options: Mapping[str, Any] = field(default_factory=dict)
    """Further wishes of the caller for the roof, for example a model that replaces the rig's."""


@dataclass(frozen=True)
class SupervisorOrders:
    """What the supervisor's process is told."""

    session: int
    ring: Path
    block: Path
    loop_pid: int
    rig: Any
    options: Mapping[str, Any]


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
        supervisor: SupervisorEntry | None = None,
        ring_suffix: str = "-ring",
    ) -> None:
        """Without a `supervisor` nobody stands above the loop: for the virtual clock, which moves nothing real.

        Rings whose name ends with KEPT_RING are kept for their black box when their session is dead.
        """
        self.id = secrets.randbits(63)
        self.facts: dict[str, Any] = {}
        """What the loop's process said when it was ready: device, real-time measures, cost."""
        self._entry, self._rig, self.virtual, self._seed = entry, rig, virtual, seed
        self._options = dict(options or {})
        self._context = multiprocessing.get_context("spawn")
        sweep_stale(KEPT_RING)
        name = f"{self.id:016x}"
        self.ring = Ring.create(f"{name}{ring_suffix}", self.id, CAPACITY)
        self.mailbox = Mailbox.create(f"{name}-mailbox", self.id)
        self.supervision = SupervisorBlock.create(f"{name}-supervisor", self.id)
        self._blocks: list[SharedBlock] = [self.ring.block, self.mailbox.block, self.supervision.block]
        self._programs: dict[int, SharedBlock] = {}
        self._supervisor_entry = supervisor
        self.loop: BaseProcess | None = None
        self.supervisor: BaseProcess | None = None
        self.recorder: BaseProcess | None = None
        self._loop_pipe: Connection | None = None
        self._orders: Connection | None = None
        self._results: Connection | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def open(self, programs: Sequence[Program] = (), *, scripted: bool = False) -> None:
        """Start the processes and wait until the loop has its device open. DeviceError or RigError when it cannot."""
        for program in programs:
            self.publish(program)
        self._start_recorder()
        ours, theirs = self._context.Pipe()
        orders = LoopOrders(
            self.id, self.ring.block.path, self.mailbox.block.path, self._rig, self.virtual, self._seed,
            tuple(p.run for p in programs) if scripted else None, self._options,
        )  # fmt: skip
        self.loop = self._context.Process(target=self._entry, args=(orders, theirs), name="pamrig-loop", daemon=False)
        start_process(self.loop)
        theirs.close()
        self._loop_pipe = ours
        above = self._start_supervisor(self._supervisor_entry) if self._supervisor_entry is not None else None
        self.facts = self._await_ready(ours, "loop")
        if above is not None:
            self.facts["supervisor"] = self._await_ready(above, "supervisor")
            above.close()

    def publish(self, program: Program) -> None:
        """Put a program where the loop finds it."""
        self._programs[program.run] = program.publish(program_name(self.id, program.run), self.id)

    def adopt(self, run: int) -> None:
        """Take over a program that another process has put where the loop finds it."""
        self._programs[run] = SharedBlock.adopt(program_path(self.id, run), self.id)

    def retire(self, run: int) -> None:
        """Let go of the program of a run that is over."""
        if block := self._programs.pop(run, None):
            block.unlink()
            block.close()

    def expect(self, order: RunOrder) -> None:
        """Tell the recorder of a run before it starts."""
        if self._orders is not None:
            self._orders.send(order)

    def end_recording(self) -> None:
        """Let the recorder finish what is open, and end: there is no loop any more."""
        if self._orders is not None:
            with suppress(OSError):
                self._orders.send(None)

    def beat(self) -> None:
        """Say that we are here; once said, say it at least each second. In virtual time there is nothing that could be late."""
        if not self.virtual:
            self.mailbox.beat()

    def go(self) -> None:
        """Let the loop begin to tick."""
        self.beat()
        if self._loop_pipe is not None:
            self._loop_pipe.send("go")

    def results(self) -> Iterator[RunResult]:
        """The runs that have been finished since the last call."""
        if self._results is None:
            return
        with suppress(EOFError, OSError):
            while self._results.poll():
                yield self._results.recv()

    @property
    def loop_alive(self) -> bool:
        """The loop's process is there."""
        return self.loop is not None and self.loop.is_alive()

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

    def close(self) -> list[RunResult]:
        """End the loop through its safe state, let the recorder finish, remove the shared memory; returns the last results."""
        for stopped in (self.supervisor, self.recorder):  # a process that somebody stopped is to come to a proper end
            if stopped is not None and stopped.is_alive() and stopped.pid is not None:
                os.kill(stopped.pid, signal.SIGCONT)
        self._end_loop()
        self._end_supervisor()
        left = self._end_recorder()
        for block in (*self._blocks, *self._programs.values()):
            block.unlink()
        for pipe in (self._loop_pipe, self._orders, self._results):
            if pipe is not None:
                pipe.close()
        return left

    def _start_supervisor(self, entry: SupervisorEntry) -> Connection:
        """At the same time as the loop; returns where it says that it is ready."""
        pid = self.loop.pid if self.loop is not None else None
        if pid is None:
            raise RigError("there is no loop to supervise")
        ours, theirs = self._context.Pipe()
        orders = SupervisorOrders(self.id, self.ring.block.path, self.supervision.block.path, pid, self._rig, self._options)
        self.supervisor = self._context.Process(target=entry, args=(orders, theirs), name="pamrig-supervisor", daemon=False)
        start_process(self.supervisor)
        theirs.close()
        return ours

    def _start_recorder(self) -> None:
        orders, self._orders = self._context.Pipe(duplex=False)
        self._results, results = self._context.Pipe(duplex=False)
        arguments = (self.ring.block.path, self.id, orders, results)
        self.recorder = self._context.Process(target=record, args=arguments, name="pamrig-recorder", daemon=False)
        start_process(self.recorder)
        orders.close()
        results.close()

    def _await_ready(self, pipe: Connection, who: str) -> dict[str, Any]:
        deadline = time.monotonic() + START_PATIENCE_S
        while time.monotonic() < deadline:
            self.beat()
            try:
                if pipe.poll(0.1):
                    kind, said = pipe.recv()
                    if kind == "ready":
                        return dict(said)
                    raise {"device": DeviceError, "config": ConfigError}.get(kind, RigError)(said)
            except EOFError:
                break
        raise RigError(f"the {who}'s process ended before it was ready; run `pamrig devices probe` to see the device's answer")

    def _end_loop(self) -> None:
        loop = self.loop
        if loop is None:
            return
        if loop.is_alive() and loop.pid is not None:
            with suppress(OSError):
                if self._loop_pipe is not None:
                    self._loop_pipe.send("end")  # for a loop that still waits for its `go`
            loop.terminate()  # SIGTERM: safe state, then the end
            loop.join(END_PATIENCE_S)
        if loop.is_alive():
            loop.kill()
            loop.join()

    def _end_supervisor(self) -> None:
        """It ends by itself when it has seen the loop end; one that does not was stopped, and is of no use any more."""
        if self.supervisor is None:
            return
        self.supervisor.join(END_PATIENCE_S)
        if self.supervisor.is_alive():
            self.supervisor.kill()
            self.supervisor.join()

    def _end_recorder(self) -> list[RunResult]:
        recorder = self.recorder
        if recorder is None or self._orders is None:
            return []
        with suppress(OSError):
            self._orders.send(None)
        left: list[RunResult] = []
        deadline = time.monotonic() + END_PATIENCE_S
        while recorder.is_alive() and time.monotonic() < deadline:
            left += self.results()
            recorder.join(0.02)
        if recorder.is_alive():
            recorder.kill()
        recorder.join()
        return left + list(self.results())


def spoken(device: Mapping[str, str]) -> dict[str, str]:
    """Of a device's facts those that an operator must know before anything moves: pace, fail-safe, warnings."""
    return {key: said for key, said in device.items() if _subject(key) in ("pace", "failsafe", "warning")}


def is_warning(key: str) -> bool:
    """Whether the fact of that name warns, be it the rig's or one part's of it (`2.warning`)."""
    return _subject(key) == "warning"


def _subject(key: str) -> str:
    return key.rpartition(".")[2]


def start_process(process: BaseProcess) -> None:
    """Start a process that the terminal's Ctrl-C does not reach, not even before its first line: that is for the one who commands."""
    ensure_running()  # multiprocessing's own helper would lift the mask when it is started on the way
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        process.start()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def ending_signals() -> list[signal.Signals]:
    """What asks a commanding process to end: Ctrl-C, SIGTERM, and the end of its terminal, unless `nohup` has it ignored."""
    hang_up = [] if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN else [signal.SIGHUP]
    return [signal.SIGINT, signal.SIGTERM, *hang_up]


def own_signals(handler: Callable[[int], None]) -> None:
    """Call `handler` with the number of each of `ending_signals` instead of being ended by them."""
    for number in ending_signals():
        signal.signal(number, lambda n, _frame: handler(n))
