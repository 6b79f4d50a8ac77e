"""What makes a Linux process keep its deadlines, each measure applied and reported as granted or denied.

Linux only; on another system each measure is reported as denied with the reason. Sources: sched(7), mlock(2), prctl(2),
the kernel's PM QoS interface /dev/cpu_dma_latency.
"""

import ctypes
import gc
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from rig.fields import bounded

_MCL_CURRENT_AND_FUTURE = 3
_PR_SET_TIMERSLACK = 29


@dataclass(frozen=True)
class Measures:
    """What the loop's process asks the system for."""

    fifo_priority: int = bounded(0, 99, default=80)
    """SCHED_FIFO priority; 0: none asked for."""
    cpu: int = bounded(-1, 1023, default=-1)
    """Core to stay on; -1: the last one this process may use, none on a machine with a single core."""
    early_us: int = bounded(0, 2000, "us", default=400)
    """Wake this long before a tick (at most a quarter of a period), rehearse it, wait out the rest on the processor; 0:
    sleep on."""
    lock_memory: bool = True
    """Keep all memory of the loop's process from being swapped out (mlockall)."""
    cpu_dma_latency: bool = True
    """Keep the processor from deep sleep, out of which it wakes late."""


def apply(measures: Measures) -> dict[str, str]:
    """Apply to this process; returns measure -> 'granted' or 'denied: why', in the order applied."""
    wanted: dict[str, Callable[[], None]] = {"gc_frozen": _freeze_collector, "timer_slack": _timer_slack}
    if measures.lock_memory:
        wanted["mlock"] = _lock_memory
    if measures.cpu_dma_latency:
        wanted["cpu_dma_latency"] = _hold_cpu_awake
    if len(os.sched_getaffinity(0)) > 1 or measures.cpu >= 0:
        wanted["affinity"] = lambda: _pin(measures.cpu)
    if measures.fifo_priority:
        wanted["fifo"] = lambda: fifo(measures.fifo_priority)
    return {name: _tried(measure) for name, measure in wanted.items()}


def denied(report: Mapping[str, str]) -> str:
    """What a run on real hardware needs and did not get, with the reason; empty for nothing. Pinning is a nicety."""
    return "; ".join(f"{name} {report[name]}" for name in ("fifo", "mlock") if report.get(name, "granted") != "granted")


def fifo(priority: int) -> None:
    """SCHED_FIFO for this process; needs CAP_SYS_NICE or an rtprio limit."""
    os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def _tried(measure: Callable[[], None]) -> str:
    try:
        measure()
    except (OSError, AttributeError, ValueError) as error:
        return f"denied: {getattr(error, 'strerror', None) or error}"
    return "granted"


def _freeze_collector() -> None:
    """A full collection of a large heap takes tens of milliseconds; the loop makes no cycles."""
    gc.collect()
    gc.freeze()
    gc.disable()


def _timer_slack() -> None:
    _call("prctl", _PR_SET_TIMERSLACK, 1, 0, 0, 0)


def _lock_memory() -> None:
    _call("mlockall", _MCL_CURRENT_AND_FUTURE)


def _call(function: str, *arguments: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if getattr(libc, function)(*arguments) != 0:
        code = ctypes.get_errno()
        raise OSError(code, os.strerror(code))


_held: list[int] = []  # the request holds for as long as the file is open: for the life of the process


def _hold_cpu_awake() -> None:
    descriptor = os.open("/dev/cpu_dma_latency", os.O_WRONLY)
    os.write(descriptor, b"\0\0\0\0")
    _held.append(descriptor)


def _pin(cpu: int) -> None:
    allowed = sorted(os.sched_getaffinity(0))
    os.sched_setaffinity(0, {allowed[-1] if cpu < 0 else cpu})
