"""Reads, expands and checks sweeps in a process of its own: what a client sends may be large, slow or a trap, and is
kept away from the process that answers to an emergency stop.

The process is niced, bounded in memory, and killed when it takes too long; the next sweep gets a fresh one. It also
writes a record's program into shared memory, so that no set-point ever passes through the process that commands the
loop.
"""

import asyncio
import contextlib
import multiprocessing
import os
import resource
import signal
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, Final, cast

from rig.config import read_text
from rig.errors import EnvelopeError, RigError
from rig.excite.envelope import check_run
from rig.excite.experiment import MOST_SWEEP_BYTES, RunPlan, expand, load_sweep
from rig.realtime.commands import program_name
from rig.rig_config import RigConfig
from rig.service.processes import start_process
from rig.service.session.run_setup import program_of

PATIENCE_S: Final = 120.0
"""For one sweep; a day of set-points at 5 ms takes about 45 s on a busy desktop."""
_MEMORY_BYTES: Final = 2 * 1024**3
_NICE: Final = 19


@dataclass(frozen=True)
class Summary:
    """What a sweep amounts to."""

    records: int
    seconds: float
    text: bytes
    """The sweep's file as it was read."""


@dataclass(frozen=True)
class Published:
    """A record whose program lies in shared memory."""

    name: str
    facts: Mapping[str, Any]
    ticks: int
    sweep_ticks: int


def plans_of(path: Path, rig: RigConfig) -> list[RunPlan]:
    """Every run of the sweep at `path`, checked against the rig's envelope. RigError, one line, when it does not
    fit."""
    plans = expand(load_sweep(path), rig.period_ns)
    checked = set()
    for plan in plans:
        way = (id(plan.dp_mpa), plan.p0_mpa, plan.ramp_in_ticks, plan.ramp_out_ticks)
        if way not in checked:  # repeats go the same way
            try:
                check_run(plan, rig.limits, rig.period_ns)
            except EnvelopeError as error:
                raise EnvelopeError(f"{path.name}: {error}") from None
            checked.add(way)
    return plans


class Planner:
    """One such process, started when it is first needed. One request at a time; the others wait for their turn."""

    def __init__(self, rig: RigConfig, patience_s: float = PATIENCE_S) -> None:
        self._rig, self._patience_s = rig, patience_s
        self._turn = asyncio.Lock()
        self._context = multiprocessing.get_context("spawn")
        self.process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._starting = threading.Lock()
        self._closed = False

    async def check(self, path: Path) -> Summary:
        """What the sweep at `path` amounts to; RigError, one line, when it does not fit."""
        return cast(Summary, await self._ask("check", path))

    async def open(self, path: Path) -> Summary:
        """The same, and keep it for `publish`."""
        return cast(Summary, await self._ask("open", path))

    async def publish(self, index: int, run: int, session: int) -> Published:
        """Put the program of a record of the opened sweep where the loop finds it, as run number `run`."""
        return cast(Published, await self._ask("publish", index, run, session))

    async def warm(self) -> None:
        """Start the process before it is needed; what goes wrong is told to who needs it."""
        with contextlib.suppress(RigError):
            await self._ask("warm")

    def close(self) -> None:
        """End the process, whatever it is doing."""
        with self._starting:
            self._closed = True
            self._end(self.process)

    async def _ask(self, *request: Any) -> Any:
        async with self._turn:
            work = asyncio.to_thread(self._exchange, request)
            try:
                kind, result = await work
            except asyncio.CancelledError:  # who asked has gone: nobody else is to wait for it
                with self._starting:
                    self._end(self.process)
                raise
        if kind == "done":
            return result
        raise RigError(result)

    def _exchange(self, request: tuple[Any, ...]) -> tuple[str, Any]:
        process, pipe = self._ready()
        if process is None or pipe is None:
            return "refused", "the daemon is ending"
        try:
            pipe.send(request)
            if pipe.poll(self._patience_s):
                answer: tuple[str, Any] = pipe.recv()
                return answer
            why = f"takes more than {self._patience_s:g} s to read and expand; make it smaller"
        except (EOFError, OSError):
            why = "the process that read it has ended; it may have needed too much memory"
        with self._starting:
            self._end(process)
        return "refused", f"{request[1] if request[0] in ('check', 'open') else 'the sweep'}: {why}"

    def _ready(self) -> tuple[BaseProcess | None, Connection | None]:
        with self._starting:
            if self._closed:
                return None, None
            if self.process is None or not self.process.is_alive():
                self._pipe, theirs = self._context.Pipe()
                self.process = self._context.Process(
                    target=serve, args=(theirs, self._rig), name="pamrig-planner", daemon=True
                )
                start_process(self.process)
                theirs.close()
            return self.process, self._pipe

    def _end(self, process: BaseProcess | None) -> None:
        """A thread that waits for the process sees its end of the pipe close."""
        if process is None:
            return
        process.kill()
        process.join()
        if process is self.process:
            self.process = None


def serve(pipe: Connection, rig: RigConfig) -> None:
    """Entry of the process: answer requests until the other end closes."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(
            number, signal.SIG_IGN
        )  # they are for the process that commands; the end of the pipe ends this one
    _step_back()
    desk = _Desk(rig)
    answers: dict[str, Callable[..., Any]] = {
        "check": desk.check, "open": desk.open, "publish": desk.publish, "warm": lambda: None,
    }  # fmt: skip
    with contextlib.suppress(EOFError, OSError):
        while True:
            what, *arguments = pipe.recv()
            pipe.send(_answer(answers[what], *arguments))


def _answer(what: Callable[..., Any], *arguments: Any) -> tuple[str, Any]:
    try:
        return "done", what(*arguments)
    except RigError as error:
        return "refused", str(error)
    except MemoryError:
        return "refused", f"{arguments[0]}: needs more than {_MEMORY_BYTES / 1024**3:g} GB to expand; make it smaller"


def _step_back() -> None:
    """Everybody else first, and the first to go when memory runs out."""
    os.nice(_NICE)
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, resource.RLIM_INFINITY))
    with contextlib.suppress(OSError):
        Path("/proc/self/oom_score_adj").write_text("1000", encoding="ascii")


class _Desk:
    """What the process does."""

    def __init__(self, rig: RigConfig) -> None:
        self._rig = rig
        self._plans: list[RunPlan] = []

    def check(self, path: Path) -> Summary:
        return self._summary(path, plans_of(path, self._rig))

    def open(self, path: Path) -> Summary:
        self._plans = []
        self._plans = plans_of(path, self._rig)
        return self._summary(path, self._plans)

    def publish(self, index: int, run: int, session: int) -> Published:
        if index >= len(self._plans):
            raise RigError("the process that read the sweep was replaced; start the sweep again")
        plan = self._plans[index]
        program = program_of(plan, run)
        program.publish(program_name(session, run), session).close()
        return Published(plan.name, plan.facts, program.ticks, len(program.p1_cmd_mpa))

    def _summary(self, path: Path, plans: list[RunPlan]) -> Summary:
        seconds = sum(plan.ticks for plan in plans) * self._rig.period_ns / 1e9
        return Summary(len(plans), seconds, read_text(path, MOST_SWEEP_BYTES).encode())
