"""The supervisor's process: its own way to the device, and real-time priority above the loop."""

import contextlib
import dataclasses
import os
import signal
from multiprocessing.connection import Connection
from typing import Final

from rig.app import compose
from rig.errors import RigError
from rig.realtime import measures
from rig.realtime.clock import MonotonicClock
from rig.realtime.ring import Ring
from rig.realtime.supervisor import Supervisor, SupervisorBlock
from rig.rig_config import RigConfig
from rig.service.keeper import Parts
from rig.service.session import SupervisorOrders

ABOVE_THE_LOOP: Final = 5
_MOST_PRIORITY: Final = 99


def patience_periods(rig: RigConfig) -> int:
    """One period less than the stall that the loop would call a fault itself; 3 by default, never below 2."""
    return max(rig.limits.stall_periods - 1, 2)


def supervisor_process(orders: SupervisorOrders, pipe: Connection) -> None:
    """Entry of the supervisor's process: watch the loop until it ends, then make safe and tell.

    It outlives the process that commands on purpose: when that one is killed, the loop must still be watched to its end.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)  # it ends when the loop has ended, not before
    rig: RigConfig = orders.rig
    device = compose.make_device(rig, MonotonicClock(), orders.options)
    stand_by = getattr(device, "stand_by", None)
    if stand_by is not None:
        with contextlib.suppress(RigError):  # `safe` then opens what it needs, which only takes longer
            stand_by()
    ring = Ring.attach(orders.ring, orders.session)
    block = SupervisorBlock.attach(orders.block, orders.session)
    try:
        supervisor = Supervisor(ring, block, orders.loop_pid, device.safe, rig.period_ns, patience_periods(rig))
    except ProcessLookupError:
        return  # the loop could not open its device and has gone: nothing was written, nothing is to be undone
    wanted = rig.realtime.fifo_priority and min(rig.realtime.fifo_priority + ABOVE_THE_LOOP, _MOST_PRIORITY)
    away_from_the_loop = min(os.sched_getaffinity(0))  # which stays on the last core by default
    report = measures.apply(dataclasses.replace(rig.realtime, fifo_priority=wanted, cpu=away_from_the_loop))
    pipe.send(("ready", report))
    pipe.close()
    try:
        supervisor.run()
    finally:
        with contextlib.suppress(Exception):
            device.close()


def parts_of(rig: RigConfig, *, virtual: bool = False, seed: int | None = None) -> Parts:
    """What the daemon's keeper needs to make the processes of this rig. A virtual rig moves nothing and has no supervisor."""
    return Parts(
        rig=rig,
        loop=compose.loop_process,
        supervisor=None if virtual else supervisor_process,
        safe=lambda: compose.make_device(rig, MonotonicClock()).safe(),
        simulated=compose.is_simulated(rig),
        virtual=virtual,
        seed=seed,
        warnings=lambda: _warnings(rig),
    )


def _warnings(rig: RigConfig) -> list[str]:
    from rig.app import inventory  # late: the supervisor's process loads this file too, and needs no tables

    return inventory.warnings(rig)
