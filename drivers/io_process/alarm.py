"""What a process that does not own an I/O process can do with it: see to the safe outputs, ask whether they stand, and
let it go on when somebody stopped it, or end it when it does not move any more."""

import contextlib
import os
import select
import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from drivers.io_process.lookup import find
from drivers.io_process.mailbox import IoMailbox, LinkState, attach
from rig.errors import DeviceLost, DevicePending

ALARM_LOOK_S: Final = 0.0005
"""From one look at the mailbox to the next, s."""
NOT_YET: Final = "the safe set-points are not confirmed yet"
"""Why a `DevicePending` is raised."""
_GONE_S: Final = 0.1
"""A killed I/O process lets go of its wire within milliseconds."""


@dataclass
class StandingAlarm:
    """What one caller has asked for and not heard the end of."""

    pid: int = 0
    """The I/O process that was asked."""
    count: int = 0
    """Of its alarms; 0: nothing is asked for."""

    def answered(self) -> None:
        """It was done; the next one is a new one."""
        self.count = 0


def alarm(resource: str, patience_s: float, standing: StandingAlarm | None = None) -> bool:
    """Tell the I/O process behind `resource`, whoever owns it, to write its safe outputs and to keep to them.

    True: it lives and the device has confirmed them. DevicePending when it lives and they are not confirmed yet: ask
    again; DeviceLost when it cannot reach the device, or takes no orders from this user. False: there is no such
    process, or there was one that could not be moved any more and was ended, so the caller has to open the wire itself.
    One that somebody stopped goes on. Who asks again gives what is `standing` of before: what was done between two
    looks counts, and is not asked for anew for ever.
    """
    found = find(resource)
    if found is None:
        return False
    path, mailbox = found
    try:
        return _alarmed(mailbox, path, resource, patience_s, standing or StandingAlarm())
    finally:
        mailbox.close()


def _alarmed(mailbox: IoMailbox, path: Path, resource: str, patience_s: float, standing: StandingAlarm) -> bool:
    """An alarm that is not done yet is not raised anew: on a slow wire it would never be done."""
    if not (standing.count and standing.pid == mailbox.pid):
        under_way = mailbox.report().alarm_done < mailbox.alarm
        standing.count = mailbox.alarm if under_way else mailbox.raise_alarm()
        standing.pid = mailbox.pid
    count = standing.count
    _let_go_on(mailbox)
    deadline = time.monotonic() + patience_s
    while (report := mailbox.report()).alarm_done < count and time.monotonic() < deadline:
        time.sleep(ALARM_LOOK_S)
    if report.alarm_done >= count:
        return True
    if report.state is LinkState.ENDED:
        return False
    if mailbox.stuck:  # it was told, and to go on, and does not
        _end(mailbox, path)
        return False
    if report.state is LinkState.UP:
        raise DevicePending(f"{resource}: {NOT_YET}")
    raise DeviceLost(f"{resource}: the safe set-points could not be written: {report.text}")


def confirmed(resource: str) -> bool | None:
    """Whether the device has confirmed the safe outputs that were asked for last, by an alarm or by the owner; None
    when there is no I/O process to ask. DeviceLost when it is another user's."""
    found = find(resource)
    if found is None:
        return None
    mailbox = found[1]
    try:
        return mailbox.confirmed
    finally:
        mailbox.close()


def is_stopped(pid: int) -> bool:
    """The process is in the state T of proc(5)."""
    with contextlib.suppress(OSError, IndexError):
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()[0] == "T"
    return False


def let_go_on(pid: int) -> None:
    """SIGCONT, which does nothing to a process that is not stopped."""
    if pid:
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGCONT)


def _let_go_on(mailbox: IoMailbox) -> None:
    """The same to the process behind a mailbox, which may be another user's."""
    with mailbox.process() as process, contextlib.suppress(OSError):
        if process is not None:
            signal.pidfd_send_signal(process, signal.SIGCONT)


def _end(mailbox: IoMailbox, path: Path) -> None:
    """Kill the I/O process that holds the lock of the mailbox at `path`, and wait until it has let go."""
    with mailbox.process() as process, contextlib.suppress(OSError):
        # it is still the one that was written down, and no later pid
        if process is not None and (held := attach(path)) is not None:
            held.close()
            signal.pidfd_send_signal(process, signal.SIGKILL)
            look = select.poll()
            look.register(process, select.POLLIN)
            look.poll(_GONE_S * 1e3)
