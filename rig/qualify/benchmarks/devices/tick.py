"""What a tick of the whole loop costs on the myRIO at the rig's own pace: part of `pamrig bench devices`.

The real nifpga package on the emulated FPGA, whose registers stand still. Between two ticks the processor sleeps, as on
the rig, so that what is not rehearsed is cold; the peer sleeps as long between its bare calls.
"""

import contextlib
import gc
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final

from drivers.myrio.device import MyRio
from drivers.myrio.settings import MyRioSettings
from rig.app import compose
from rig.app.loop_process import loop_settings, punctual, rehearse_for
from rig.interfaces import Clock, Device, DeviceContext
from rig.qualify.benchmarks import figure
from rig.qualify.lateness import at_rest
from rig.realtime.clock import MonotonicClock
from rig.realtime.commands import Mailbox, Script
from rig.realtime.loop import Loop
from rig.realtime.ring import Ring, RingReader, RingWriter
from rig.rig_config import RigConfig
from rig.sample import unpack
from rig.service.records.lateness import quantiles

TICKS: Final = 600
"""Of each turn."""
TURNS: Final = 3
"""In which the drivers take turns, so that a drift of the machine meets all."""
_GOAL_US: Final = 40.0


class _Twinless:
    """The same device for a rehearsal that may not call its driver."""

    def __init__(self, device: Device) -> None:
        self.roles = device.roles


def bench_tick(settings: MyRioSettings, context: DeviceContext, bare: Callable[[], None]) -> dict[str, Any]:
    """Loop with the driver rehearsed, loop without, and bare calls, in turns; of each the ticks of all turns."""
    rig = compose.load(None)
    rig = replace(rig, limits=replace(rig.limits, misses_per_s=1000, stall_periods=1000))
    context = replace(context, period_ns=rig.period_ns)
    took: dict[str, list[float]] = {"rehearsed": [], "cold": [], "bare": []}
    with _as_the_loop(rig.realtime.fifo_priority):
        _take_turns(rig, settings, context, bare, took)
    ours, cold, peer = (quantiles(times) for times in took.values())
    figures: dict[str, Any] = {}
    for key, goal in (("p50", None), ("p99", _GOAL_US)):
        figures |= {
            f"tick's own work on the myRIO at 200 Hz, {key}": figure(
                ours[key], "us", "a bare nifpga cycle at 200 Hz", peer[key], goal=goal
            ),
            f"the same when the driver is not rehearsed, {key}": figure(cold[key], "us", "rehearsed", ours[key]),
        }
    return figures


def _take_turns(
    rig: RigConfig,
    settings: MyRioSettings,
    context: DeviceContext,
    bare: Callable[[], None],
    took: dict[str, list[float]],
) -> None:
    for _ in range(TURNS):
        device = MyRio(settings, context)
        took["rehearsed"] += _work_us(rig, device, punctual(MonotonicClock(), device, rig))
        took["cold"] += _work_us(rig, device, punctual(MonotonicClock(), _Twinless(device), rig))  # type: ignore[arg-type]
        took["bare"] += _paced_us(bare, rig.period_ns)


@contextlib.contextmanager
def _as_the_loop(priority: int) -> Iterator[None]:
    """With the real-time priority of the rig's loop, where the system grants it, and as there without collections of
    garbage: whatever else runs here is no part of a tick."""
    before, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    gc.disable()
    try:
        yield
    finally:
        gc.enable()
        os.sched_setscheduler(0, before, parameters)


def _work_us(rig: RigConfig, device: Device, clock: Clock) -> list[float]:
    """Read to write of each tick of a sweep at rest."""
    ring = Ring.private(2 * TICKS)
    reader, script = RingReader(ring), Script([at_rest(rig, TICKS)], Mailbox.private())
    device.open()
    loop = Loop(device, clock, RingWriter(ring), script, loop_settings(rig))
    rehearse_for(loop, clock)
    loop.run()
    samples = [unpack(packed) for packed in reader]
    return [(sample.written_ns - sample.woken_ns) / 1e3 for sample in samples if sample.run == 1]


def _paced_us(call: Callable[[], None], period_ns: int) -> list[float]:
    """The call once a period, slept in between."""
    clock, times = MonotonicClock(), []
    due_ns = clock.now_ns()
    for _ in range(TICKS):
        due_ns += period_ns
        clock.wait_until_ns(due_ns)
        began = time.perf_counter_ns()
        call()
        times.append((time.perf_counter_ns() - began) / 1e3)
    return times
