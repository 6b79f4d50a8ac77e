"""The loop's process: it makes the rig's device, the clock and the loop, opens the device and ticks.

Nothing heavy is imported here: it runs on the controller.
"""

import contextlib
import ctypes
import multiprocessing
import os
import signal
import sys
import time
import traceback
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from rig.app import wire_locks
from rig.app.compose import check_as_loaded, held_wires, make_device
from rig.errors import DeviceError, RigError
from rig.interfaces import Clock, Device, abilities_of
from rig.realtime import closed_loop, measures
from rig.realtime.clock import MonotonicClock, VirtualClock, WarmUpClock
from rig.realtime.commands import Mailbox, Script, program_path
from rig.realtime.faults import Fault
from rig.realtime.loop import Loop, LoopSettings
from rig.realtime.rehearsal import NoDevice, Rehearsal, Rehearsals
from rig.realtime.ring import Ring, RingWriter
from rig.rig_config import RigConfig
from rig.service.processes import name_process, stand_apart, tell_commander
from rig.service.session.process_setups import LoopSetup

_PR_SET_PDEATHSIG = 1
"""prctl(2): the signal that comes when the process that started this one dies."""
_EARLY_SHARE = 4
"""The loop wakes at most a quarter of a period early (`Measures.early_us`): that is how much of a processor it
costs."""


def loop_process(setup: LoopSetup, pipe: Connection) -> None:
    """Entry of the loop's process: open the device, take the real-time measures, wait for `go`, tick."""
    stand_apart()
    for number in (signal.SIGINT, signal.SIGTSTP):
        signal.signal(number, signal.SIG_IGN)  # the terminal's Ctrl-C and Ctrl-Z are for the process that commands
    name_process("loop")
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGHUP)  # if that process is killed, end safe, and know why
    ending = LoopEnding(os.getppid())
    commander = multiprocessing.parent_process()
    if commander is not None and not commander.is_alive():
        return  # killed before the kernel could be told: nobody wants the device opened
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, ending)
    try:
        _open_and_tick(setup, pipe, ending)
    except NotWanted as end:
        signal.signal(end.number, signal.SIG_DFL)
        signal.raise_signal(end.number)  # for whoever asks how it ended


def _open_and_tick(setup: LoopSetup, pipe: Connection, ending: "LoopEnding") -> None:
    try:
        loop, facts = _prepare(setup, ending)
    except RigError as error:
        tell_commander(pipe, "device" if isinstance(error, DeviceError) else "config", str(error))
        return
    except Exception as error:  # noqa: BLE001  # of a driver: one line instead of a traceback
        tell_commander(pipe, "error", f"the loop was not ready by an error of the program: {_one_line(error)}")
        sys.exit(1)
    tell_commander(pipe, "ready", facts)
    try:
        _tick_on_go(loop, pipe)
    finally:  # it has left: a signal that comes while the interpreter ends is not to look like what ended it
        for number in (signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, signal.SIG_IGN)


class NotWanted(BaseException):
    """Whoever commands wants the loop to end, or is gone, before it has its device: no error for a driver to catch."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


class LoopEnding:
    """What SIGTERM, and the end of the process that commands, do to a loop. One that has its device leaves in good
    order; one that has not gives up opening it, and closes what it has of it: a watchdog of the device would be left
    armed, with nobody to feed it. A terminal that is closed is for the process that commands, as its Ctrl-C is."""

    def __init__(self, commander: int) -> None:
        self._commander = commander
        self._loop: Loop | None = None
        self._raises = True

    def __call__(self, number: int, _: object) -> None:
        """A signal has come; NotWanted, once, where the device is not open."""
        if number == signal.SIGHUP and os.getppid() == self._commander:
            return
        if self._raises:
            self._raises = False  # once: closing it is not to be interrupted
            raise NotWanted(number)
        if self._loop is not None:
            self._loop.terminate(Fault.CONTROL_LOST if number == signal.SIGHUP else Fault.TERMINATED)

    def opened(self, device: Device, loop: Loop) -> dict[str, str]:
        """Open the device of the loop; its facts."""
        self._loop = loop
        try:
            facts = dict(device.open())
            self._raises = False
        except NotWanted:
            device.close()
            raise
        return facts


def _tick_on_go(loop: Loop, pipe: Connection) -> None:
    try:
        if _word(pipe) == "go":
            loop.run()
            return
    except RigError as error:
        tell_commander(pipe, "error", str(error))
        return
    except Exception as error:  # noqa: BLE001  # the process's last resort: one line instead of a traceback
        tell_commander(pipe, "error", f"the loop ended by an error of the program: {_one_line(error)}")
        sys.exit(1)
    loop.leave()


def _word(pipe: Connection) -> object:
    """The commanding process's word, `go` or `end`; None once that process is gone."""
    with contextlib.suppress(EOFError, OSError):
        return pipe.recv()
    return None


def _one_line(error: BaseException) -> str:
    """What a traceback says, for one line: the error and where it came from."""
    where = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {' '.join(str(error).split())} ({Path(where.filename).name}, line {where.lineno})"


def _prepare(setup: LoopSetup, ending: LoopEnding) -> tuple[Loop, dict[str, Any]]:
    ring = Ring.attach(setup.ring, setup.session)
    mailbox = Mailbox.attach(setup.mailbox, setup.session)
    rig: RigConfig = setup.rig
    clock: Clock = VirtualClock(pace=ring.pace) if setup.virtual else MonotonicClock()
    seed = {} if setup.seed is None else {"seed": setup.seed}
    check_as_loaded(rig)
    device = make_device(rig, clock, {**setup.options, **seed})
    commands: Mailbox | Script = mailbox
    if setup.script is not None:
        programs = [closed_loop.attach(program_path(setup.session, run), setup.session) for run in setup.script]
        commands = Script(programs, mailbox)
    waiting = clock if setup.virtual else punctual(clock, device, rig)
    loop = Loop(device, waiting, RingWriter(ring), commands, loop_settings(rig))
    rehearse_for(loop, waiting)
    if not setup.virtual:
        wire_locks.hold(held_wires(rig), os.getppid())  # until this process is gone
    facts: dict[str, Any] = {"device": ending.opened(device, loop)}
    facts["realtime"] = {} if setup.virtual else measures.apply(rig.realtime)
    facts["wall_offset_ns"] = time.time_ns() - clock.now_ns()
    return loop, facts


def loop_settings(rig: RigConfig) -> LoopSettings:
    """What the loop needs of the rig's config."""
    return LoopSettings(rig.period_ns, rig.safe.p1_mpa, rig.safe.p2_mpa, rig.safe.return_mpa_s, rig.limits)


def punctual(clock: Clock, device: Device, rig: RigConfig) -> Clock:
    """The clock on which the loop waits: it rehearses each tick beforehand, if the rig's config asks for that."""
    early_ns = min(rig.realtime.early_us * 1000, rig.period_ns // _EARLY_SHARE)
    return (
        WarmUpClock(early_ns, Rehearsals(_rehearsal(device, rig), _rehearsal(device, rig, closed=True)))
        if early_ns
        else clock
    )


def _rehearsal(device: Device, rig: RigConfig, *, closed: bool = False) -> Rehearsal:
    beside, settings = VirtualClock(), loop_settings(rig)
    twin = abilities_of(device).twin(beside)  # a driver without one: its calls would reach the hardware
    return Rehearsal(twin or NoDevice(settings.safe_p1_mpa, settings.safe_p2_mpa), beside, settings, closed_loop=closed)


def rehearse_for(loop: Loop, clock: Clock) -> None:
    """Let the clock rehearse the kind of tick that this loop is about to carry out."""
    if isinstance(clock, WarmUpClock) and isinstance(clock.rehearse, Rehearsals):
        clock.rehearse.follows_angle = loop.follows_angle
