"""The watchers' processes: their own way to the device, and real-time priority above the loop."""

import contextlib
import dataclasses
import functools
import os
import signal
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any, Final

from rig.app import compose, wire_locks
from rig.app.trying_on import ALONE_S, TRIED_ON
from rig.errors import RigError, StateError
from rig.interfaces import Device, abilities_of
from rig.realtime import measures
from rig.realtime.clock import MonotonicClock
from rig.realtime.ring import Ring
from rig.realtime.safe_report import LoopVerdict, Outcome, SafeBlock, Writer
from rig.realtime.safe_state import SafeStateAuthority, SecondPath, write_and_look
from rig.realtime.supervisor import Supervisor
from rig.realtime.watched_process import WatchedProcess
from rig.rig_config import RigConfig
from rig.service.processes import name_process, stand_apart, tell_commander
from rig.service.session.process_setups import WatcherSetup

GUARDIAN_PATIENCE_NS: Final = 250_000_000
"""The guardian comes after the supervisor and the commanding process; well before the watchdog of a device."""
_SOONER: Final = 10
"""By this part of a period the supervisor's patience ends before the tick that would prove it right: it is not to wait
for the whole next one when it wakes late."""
ABOVE_THE_LOOP: Final = 5
"""Steps of SCHED_FIFO priority: who watches the loop must run while it spins."""
_MOST_PRIORITY: Final = 99
_LOOKS_NS: Final = 2_000_000_000
"""Who tries beats between two attempts."""
_LOOK_S: Final = 0.05
_RETRY_S: Final = 0.25
"""Between two attempts in another's place."""
_HIS_LOOP_S: Final = 5.0
"""So long who drives the rig may be what the lost commander left, on the way to its end; then it is somebody else."""


def patience_periods(rig: RigConfig) -> int:
    """One period less than the stall that the loop would call a fault itself; 3 by default, never below 2."""
    return max(rig.limits.stall_periods - 1, 2)


def watcher_process(setup: WatcherSetup, pipe: Connection) -> None:
    """Entry of supervisor and guardian: watch the process that writes set-points until it ends, then see to the safe
    state.

    They outlive the process that commands on purpose: when that one is killed, the loop must still be watched to its
    end.
    """
    stay(setup.writer)
    rig: RigConfig = setup.rig
    device = outside(rig, setup.options)
    path = SecondPath.of(device, claim_of(compose.wires_of(rig), os.getppid()))
    try:
        block = SafeBlock.attach(setup.block, setup.session)
        alone = GoesOnAlone(rig, block, setup.writer)
        supervisor = _supervisor(setup, rig, block, path, alone)
    except StateError as error:
        tell_commander(pipe, "state", str(error))
        return
    if setup.writer is Writer.SUPERVISOR:
        _prepare_safe(device)
    tell_commander(pipe, "ready", _take_measures(rig))
    pipe.close()
    try:
        verdict = supervisor.run()
        if block.report(setup.writer).outcome is Outcome.FAILED and alone.commander_tries():
            try_for_commander(block, setup.writer, alone, path)  # he may be lost later than the loop
        if verdict is not LoopVerdict.WATCHING and (setup.speaks or alone.since_s):
            speak(block, setup.writer)
    finally:
        with contextlib.suppress(Exception):
            device.close()


def stay(writer: Writer) -> None:
    """This process ends when its work is done, and not before, nor with the group of who commands; it is called like
    who it is."""
    stand_apart()
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP):
        signal.signal(number, signal.SIG_IGN)
    name_process(writer.name.lower())


class GoesOnAlone:
    """Whether a watcher tries on although its time is over: where nobody commands any more who would do so, be he gone
    or stopped."""

    def __init__(self, rig: RigConfig, block: SafeBlock, writer: Writer) -> None:
        self._block, self._writer, self._driver = block, writer, driver_of(rig)
        self._commander = os.getppid()
        self.since_s = 0.0
        """It does so since then."""

    def __call__(self) -> bool:
        if self.commander_tries() or self._driver():
            return False
        if not self.since_s:
            self.since_s = time.monotonic()
            if self._writer is Writer.SUPERVISOR or not self._supervisor_looks():
                _print(f"the process that held the rig is gone, or does not move; {TRIED_ON}")
        return time.monotonic() - self.since_s < ALONE_S

    def commander_tries(self) -> bool:
        """By what he does: one that was stopped is there, and does nothing."""
        return os.getppid() == self._commander and self._moves(Writer.CONTROL)

    def _supervisor_looks(self) -> bool:
        return self._moves(Writer.SUPERVISOR)

    def _moves(self, writer: Writer) -> bool:
        return time.monotonic_ns() - self._block.beat_ns(writer) < _LOOKS_NS


def try_for_commander(block: SafeBlock, writer: Writer, alone: GoesOnAlone, path: SecondPath) -> None:
    """While the one who commands tries, nothing; while he does not, his attempts. Until the device has taken the safe
    state, this one is released, its time is over, or somebody else drives the rig."""
    lost_s = 0.0
    while not (block.released or block.best().safe):
        block.beat(writer)
        now_s = time.monotonic()
        if alone.commander_tries():
            if lost_s:
                lost_s = alone.since_s = 0.0
                _let_go(path)
                _tell(block, writer, Outcome.UNKNOWN)
            time.sleep(_LOOK_S)
            continue
        lost_s = lost_s or now_s
        if alone():
            _tell(block, writer, write_and_look(path))
            time.sleep(_RETRY_S)
        elif now_s - lost_s < _HIS_LOOP_S or alone.commander_tries():
            time.sleep(_LOOK_S)
        else:
            break
    _let_go(path)


def _let_go(path: SecondPath) -> None:
    with contextlib.suppress(Exception):
        path.close()


def _tell(block: SafeBlock, writer: Writer, outcome: Outcome) -> None:
    report, now_ns = block.report(writer), time.monotonic_ns()
    block.tell(
        dataclasses.replace(
            report,
            outcome=outcome,
            written_ns=report.written_ns or (now_ns if outcome >= Outcome.WRITTEN else 0),
            confirmed_ns=now_ns if outcome is Outcome.SEEN else report.confirmed_ns,
        )
    )


def _supervisor(
    setup: WatcherSetup, rig: RigConfig, block: SafeBlock, path: SecondPath, goes_on: Callable[[], bool]
) -> Supervisor:
    """The guardian has twice the supervisor's patience, at least its own, and gives the others as long for a loop that
    has ended."""
    ring, loop = Ring.attach(setup.ring, setup.session), WatchedProcess(setup.pid)
    own = path if compose.outlives_the_loop(rig) else None
    authority = SafeStateAuthority(setup.writer, block, ring, loop, own, goes_on)
    patience_ns = setup.patience_ns or patience_periods(rig) * rig.period_ns - rig.period_ns // _SOONER
    grace_ns = 0
    if setup.writer is Writer.GUARDIAN:
        patience_ns, grace_ns = max(GUARDIAN_PATIENCE_NS, 2 * patience_ns), GUARDIAN_PATIENCE_NS
    return Supervisor(
        setup.writer, ring, block, loop, authority, patience_ns=patience_ns, period_ns=rig.period_ns, grace_ns=grace_ns
    )


def _prepare_safe(device: object) -> None:
    with contextlib.suppress(RigError):  # `safe` then opens what it needs, which only takes longer
        abilities_of(device).prepare_safe()


def _take_measures(rig: RigConfig) -> dict[str, str]:
    wanted = rig.realtime.fifo_priority and min(rig.realtime.fifo_priority + ABOVE_THE_LOOP, _MOST_PRIORITY)
    away_from_the_loop = min(os.sched_getaffinity(0))  # which stays on the last core by default
    return measures.apply(dataclasses.replace(rig.realtime, fifo_priority=wanted, cpu=away_from_the_loop))


def speak(block: SafeBlock, who: Writer) -> None:
    """For a terminal whose own command can say nothing any more: whoever made safe, and the supervisor if nobody
    did."""
    best = block.best()
    if best.writer not in (who, Writer.NOBODY) or (best.writer is Writer.NOBODY and who is not Writer.SUPERVISOR):
        return
    _print(f"the process that held the rig is gone or did not move; {best.words}")


def _print(line: str) -> None:
    with contextlib.suppress(OSError):  # a terminal that is gone with the process
        print(f"pamrig: {line}", file=sys.stderr, flush=True)


def outside(rig: RigConfig, options: Mapping[str, Any] | None = None) -> Device:
    """The rig's device for somebody who makes it safe beside whoever drives it, or in his place."""
    driver = driver_of(rig)
    return compose.make_device(rig, MonotonicClock(), options, driven=lambda: bool(driver()))


def claim_of(wires: Sequence[str], commander: int) -> Callable[[], contextlib.AbstractContextManager[None]]:
    """What a watcher holds while it writes in the place of a process of `commander`: nobody else drives meanwhile."""
    return lambda: wire_locks.making_safe(wires, commander)


def driver_of(rig: RigConfig, but: int | None = None) -> Callable[[], str]:
    """Who drives the rig's wires, asked many times: their names are looked up once. `but`: a process not meant."""
    names = functools.cache(lambda: compose.wires_of(rig))
    return lambda: wire_locks.who_drives(names(), but)
