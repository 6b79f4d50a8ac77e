"""`pamrig bench safety`: how fast the rig is safe after the loop is lost, and whether clients can disturb it.

Times run from the signal, or the call, to the moment when both safe set-points stand at the device: the terminals of
the simulated rig, or the output registers of the emulated Modbus module. Each trial is a sweep of its own under a
daemon of real processes.
"""

import contextlib
import signal
import socket
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, Final

from hil.faults import Injection
from rig.errors import RigError
from rig.qualify.benchmarks import figure
from rig.qualify.faults.bench import FaultBench, Spoilt
from rig.qualify.faults.table import estop
from rig.qualify.faults.wired import ModbusFaultBench
from rig.service.connections import protocol
from rig.service.records.lateness import quantiles

TRIALS: Final = 50
"""Of each fault."""
_GOAL_MS: Final = {"SIGKILL": 20.0, "SIGSTOP": 20.0, "hang": 20.0, "estop": 10.0}
_PERIOD_MS: Final = 5.0
QUIET_S: Final = 20.0
"""In which nothing happens and nothing may be stopped, s."""
_FLOODS: Final = 4
_SUBSCRIBERS: Final = 4

Act = Callable[[FaultBench], int]


def bench_safety(trials: int = TRIALS) -> dict[str, Any]:
    """Figures by name, each with the goal as its peer; the disturbance has the undisturbed loop of the same session."""
    figures: dict[str, Any] = {}
    benches: dict[str, tuple[Callable[[Path], FaultBench], dict[str, Act]]] = {
        "simulated": (FaultBench, _acts() | {"hang": lambda bench: bench.inject(Injection.HANG)}),
        "Modbus TCP": (ModbusFaultBench, _acts()),
    }
    for device, (make, acts) in benches.items():
        with tempfile.TemporaryDirectory(prefix="pamrig-") as folder, make(Path(folder)) as bench:
            for name, act in acts.items():
                times = [_trial(bench, act) for _ in range(trials)]
                figures |= _figures(f"{name}, {device}", times, _GOAL_MS[name])
            if device == "simulated":
                figures |= _disturbance(bench)
    return figures


def _acts() -> dict[str, Act]:
    return {
        "estop": estop,
        "SIGKILL": lambda bench: bench.send("loop", signal.SIGKILL),
        "SIGSTOP": lambda bench: bench.send("loop", signal.SIGSTOP),
    }


def _trial(bench: FaultBench, act: Act) -> float:
    while True:
        bench.ready()
        time.sleep(time.monotonic_ns() % 5_000_000 / 1e9)  # anywhere in the period
        with contextlib.suppress(Spoilt):  # the machine stood still just before
            return bench.ms_to_safe(act(bench))


def _figures(name: str, times: list[float], goal_ms: float) -> dict[str, Any]:
    seen = quantiles(times)
    return {
        f"{name}: p50": figure(seen["p50"], "ms", limit="one period of the loop", limit_value=_PERIOD_MS),
        f"{name}: p99": figure(seen["p99"], "ms", limit="one period of the loop", limit_value=_PERIOD_MS, goal=goal_ms),
        f"{name}: max of {len(times)}": figure(
            seen["max"], "ms", limit="one period of the loop", limit_value=_PERIOD_MS
        ),
    }


def _disturbance(bench: FaultBench) -> dict[str, Any]:
    """Lateness of the loop with floods and subscribers, beside the same loop left alone just before and just after."""
    before = lateness(bench)
    with _crowd(bench.socket):
        crowded = lateness(bench)
    alone = quantiles(before + lateness(bench))["p99"]
    p99 = quantiles(crowded)["p99"]
    name = f"lateness p99 with {_FLOODS} floods and {_SUBSCRIBERS} subscribers"
    return {name: figure(p99, "us", "the loop left alone", alone)}


def lateness(bench: FaultBench, seconds: float | None = None) -> list[float]:
    """Microseconds that each tick was late, over so much of a sweep, read from the ring itself."""
    from rig.realtime.ring import Ring, RingReader
    from rig.realtime.shared import KEPT_RING, folder
    from rig.sample import unpack

    bench.ready()
    session = bench.status()["session"]
    ring = Ring.attach(folder() / f"pamrig-{session}{KEPT_RING}")
    reader, late = RingReader(ring), []
    until = time.monotonic() + (QUIET_S if seconds is None else seconds)
    while time.monotonic() < until:
        time.sleep(0.2)
        for packed in reader:
            sample = unpack(packed)
            late.append((sample.woken_ns - sample.scheduled_ns) / 1e3)
    return late


@contextlib.contextmanager
def _crowd(path: Path) -> Iterator[None]:
    """Clients that ask for the status as fast as they are let, and subscribers that take every event."""
    over = threading.Event()
    threads = [threading.Thread(target=_flood, args=(path, over)) for _ in range(_FLOODS)]
    threads += [threading.Thread(target=_subscribe, args=(path, over)) for _ in range(_SUBSCRIBERS)]
    with busy(threads, over):
        yield


@contextlib.contextmanager
def busy(threads: Sequence[threading.Thread], over: threading.Event) -> Iterator[None]:
    """These threads at work, which end when `over` is set."""
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join()


def _flood(path: Path, over: threading.Event) -> None:
    with socket.socket(socket.AF_UNIX) as client, contextlib.suppress(OSError):
        client.connect(str(path))
        client.settimeout(0.5)
        lines = protocol.encode({"id": 1, "command": "status"}) * 50
        while not over.is_set():
            with contextlib.suppress(TimeoutError):
                client.send(lines)
            with contextlib.suppress(TimeoutError):
                client.recv(1 << 16)


def _subscribe(path: Path, over: threading.Event) -> None:
    from rig.service.client import Client

    with contextlib.suppress(RigError), Client(path) as client:
        for _ in client.subscribe(20.0, samples=True):
            if over.is_set():
                return
