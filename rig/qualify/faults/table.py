"""The fault table: what is done to the rig, what must follow, within how long, and which evidence must be left.

`pamrig faults` runs it and prints it, the tests assert it, the docs are made from it.
"""

import contextlib
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from hil.faults import Injection
from rig.errors import CheckFailed, RigError, StateError
from rig.log.mcap.writer import PARTIAL_SUFFIX
from rig.qualify.faults.bench import START_S, FaultBench
from rig.qualify.faults.opening import interrupt_opening
from rig.service.connections import protocol

_FLUSHED_S: Final = 0.8
"""After which something of a record is surely on the disk: three flushes (`rig.service.records.open_run.FLUSH_NS`)."""
_FULL_S: Final = 1.2
"""So long the disk takes nothing: the recorder meets it in several flushes, and must outlive each."""
_FLOOD_S: Final = 1.5
"""Longer than a loop bears without a beat of the process that commands (`CONTROL_PATIENCE_NS`), so that a daemon held
up by it would be seen."""


_STOOD_S: Final = 2.0
"""Longer than anybody bears who listens to another (`CONTROL_PATIENCE_NS`)."""


@dataclass(frozen=True)
class FaultRow:
    """One fault."""

    name: str
    done: str
    """What is done, in words."""
    act: Callable[[FaultBench], int]
    """Does it; returns when (monotonic ns)."""
    causes: tuple[str, ...]
    """Names of the fault that may be reported; empty: none, the sweep goes on."""
    bound_ms: float = 0.0
    """From the fault to the safe set-points at the valves."""
    in_log: str = ""
    """What the daemon's log must say besides the cause."""
    control_dies: bool = False


def _device(fault: Injection) -> Callable[[FaultBench], int]:
    return lambda bench: bench.inject(fault)


def _signal(process: str, number: int) -> Callable[[FaultBench], int]:
    return lambda bench: bench.send(process, number)


def _signals(**struck: int) -> Callable[[FaultBench], int]:
    """Several processes at once."""

    def act(bench: FaultBench) -> int:
        pids = bench.pids()
        now_ns = time.monotonic_ns()
        for process, number in struck.items():
            os.kill(pids[process], number)
        return now_ns

    return act


def _after_a_flush(number: int) -> Callable[[FaultBench], int]:
    """To the recorder, when something of the record is on the disk already."""

    def act(bench: FaultBench) -> int:
        time.sleep(_FLUSHED_S)
        return bench.send("recorder", number)

    return act


def estop(bench: FaultBench) -> int:
    """By a client that connects anew, as `pamrig estop` does; returns when it was called."""
    with bench.client() as client:
        now_ns = time.monotonic_ns()
        client.estop()
    return now_ns


def _full_disk(bench: FaultBench) -> int:
    """Files of the recorder may not grow any more: what a full disk is to it. The run is then stopped, to see what
    became of it."""
    pid = bench.pid("recorder")
    now_ns = time.monotonic_ns()
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
    time.sleep(_FULL_S)
    with bench.client() as client:
        if client.status()["state"] != "running":
            raise CheckFailed("the loop did not go on")
        client.stop()
        bench.wait(lambda: not client.status()["working"], "the end of the run")
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    return now_ns


def _flood(bench: FaultBench) -> int:
    """Nonsense and status requests as fast as they go, and a subscriber that never reads."""
    now_ns = time.monotonic_ns()
    lazy = socket.socket(socket.AF_UNIX)
    lazy.connect(str(bench.socket))
    lazy.sendall(protocol.encode({"id": 1, "command": "subscribe", "rate_hz": 50, "samples": True}))
    floods = [socket.socket(socket.AF_UNIX) for _ in range(4)]
    for flood in floods:
        flood.connect(str(bench.socket))
        flood.setblocking(False)
    until = time.monotonic() + _FLOOD_S
    lines = protocol.encode({"id": 1, "command": "status"}) * 20 + b"nonsense\n" * 20
    while time.monotonic() < until:
        for flood in floods:
            try:
                flood.send(lines)
            except (BlockingIOError, ConnectionError):
                time.sleep(0.001)
    for each in (lazy, *floods):
        each.close()
    return now_ns


def _second_daemon(bench: FaultBench) -> int:
    now_ns = time.monotonic_ns()
    command = [
        sys.executable,
        "-m",
        "rig.cli.main",
        "daemon",
        "--socket",
        str(bench.socket),
        "--state",
        str(bench.state),
    ]
    second = subprocess.run(
        [*command, "--logs", str(bench.logs)], capture_output=True, text=True, timeout=START_S, check=False
    )
    if second.returncode != 2 or "another daemon is running" not in second.stderr:
        raise CheckFailed(f"the second daemon was not refused: {second.returncode} {second.stderr}")
    return now_ns


def _sweep_outside(bench: FaultBench) -> int:
    now_ns = time.monotonic_ns()
    sweep = bench.folder / "outside.yaml"
    sweep.write_text("records: [{sine: {frequency_hz: 0.5, amplitude_mpa: 0.9}}]", encoding="utf-8")
    with bench.client() as client:
        try:
            client.start(sweep)
        except StateError:
            raise
        except RigError as error:
            if "would be" in str(error):
                return now_ns
    raise CheckFailed("a sweep outside the envelope was not refused")


def _moved(bench: FaultBench) -> int:
    """The folder of the record that is being written gets another name: to who writes it, a disk that was taken
    away."""
    recorder = bench.pid("recorder")
    partial = bench.wait(lambda: next(_written_by(recorder), None), "the record")
    assert partial
    now_ns = time.monotonic_ns()
    folder = partial.parent
    folder.rename(folder.with_name(f"{folder.name}_moved_{now_ns}"))  # a second time within one second, too
    with bench.client() as client:
        bench.wait(lambda: not client.status()["working"], "the end of the run")
    return now_ns


def _written_by(pid: int) -> Iterator[Path]:
    """Unfinished records that a process has open; those of recorders that were killed lie about as well."""
    for opened in Path(f"/proc/{pid}/fd").iterdir():
        with contextlib.suppress(OSError):
            if (file := opened.readlink()).name.endswith(PARTIAL_SUFFIX):
                yield file


def all_stopped(bench: FaultBench) -> int:
    """As near to a suspended machine as a process comes; returns when it goes on."""
    pids = bench.pids().values()
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    time.sleep(_STOOD_S)
    now_ns = time.monotonic_ns()
    for pid in pids:
        os.kill(pid, signal.SIGCONT)
    return now_ns


def _interrupted(bench: FaultBench) -> int:
    return interrupt_opening(bench.folder, bench.sweep, START_S)


_D, _S = _device, _signal
_KILL, _STOP = signal.SIGKILL, signal.SIGSTOP
_LOST: Final = ("LOOP_DIED", "SUPERVISOR_DIED")
TABLE: Final[tuple[FaultRow, ...]] = (
    FaultRow("late", "one call of the device takes 3 ms", _D(Injection.LATE), ()),
    FaultRow("skip", "one call takes 12 ms: periods are skipped and counted", _D(Injection.SKIP), ()),
    FaultRow("misses", "every call takes 7.5 ms", _D(Injection.MISSES), ("MISSED_TICKS",), 1000.0),
    FaultRow("stall", "one call takes 40 ms", _D(Injection.STALL), ("LOOP_DIED", "LONG_STALL"), 25.0),
    FaultRow("timeout", "one reply does not come", _D(Injection.ONE_TIMEOUT), ()),
    FaultRow(
        "timeouts", "no reply comes any more", _D(Injection.TIMEOUTS), ("DEVICE_ERRORS",), 60.0, "no reply within 5 ms"
    ),
    FaultRow("garbled", "every reply is garbled", _D(Injection.GARBLED), ("DEVICE_ERRORS",), 60.0, "checksum is wrong"),
    FaultRow(
        "lost", "the connection is closed", _D(Injection.LOST), ("DEVICE_LOST",), 15.0, "the connection was closed"
    ),
    FaultRow(
        "refused",
        "one output is refused in every tick",
        _D(Injection.REFUSED),
        ("DEVICE_ERRORS",),
        60.0,
        "output 1 is refused",
    ),
    FaultRow("hang", "the driver hangs", _D(Injection.HANG), ("LOOP_DIED",), 25.0, "it hung or was stopped"),
    FaultRow("crash", "the driver has a bug", _D(Injection.CRASH), ("LOOP_ERROR", "LOOP_DIED"), 15.0),
    FaultRow("frozen", "all sensors repeat their last value", _D(Injection.FROZEN), ("FROZEN_SENSOR",), 1000.0),
    FaultRow("nan", "the angle is not a number", _D(Injection.NOT_A_NUMBER), ("BAD_VALUE",), 60.0),
    FaultRow("range", "a pressure reads 9.9 MPa", _D(Injection.OUT_OF_RANGE), ("BAD_VALUE",), 60.0),
    FaultRow("jump", "the angle jumps by 40 degrees", _D(Injection.JUMP), ("BAD_VALUE",), 100.0),
    FaultRow("wire", "a monitor's wire breaks", _D(Injection.BROKEN_WIRE), ("BROKEN_WIRE",), 60.0),
    FaultRow("stale", "values get older and older", _D(Injection.STALE), ("STALE_VALUE",), 60.0),
    FaultRow("air", "the air is cut off", _D(Injection.NO_AIR), ("NOT_FOLLOWING",), 1500.0),
    FaultRow(
        "loop killed", "SIGKILL to the loop", _S("loop", signal.SIGKILL), ("LOOP_DIED",), 15.0, "killed by signal 9"
    ),
    FaultRow(
        "loop stopped",
        "SIGSTOP to the loop",
        _S("loop", signal.SIGSTOP),
        ("LOOP_DIED",),
        25.0,
        "it hung or was stopped",
    ),
    FaultRow("loop ended", "SIGTERM to the loop", _S("loop", signal.SIGTERM), ("TERMINATED", "LOOP_DIED"), 15.0),
    FaultRow(
        "recorder killed",
        "SIGKILL to the recorder",
        _after_a_flush(signal.SIGKILL),
        ("RECORDER_DIED",),
        100.0,
        "process is gone",
    ),
    FaultRow(
        "recorder stopped",
        "SIGSTOP to the recorder",
        _S("recorder", signal.SIGSTOP),
        ("RECORDER_DIED",),
        1000.0,
        "stopped by a signal",
    ),
    FaultRow(
        "recorder ended",
        "SIGTERM to the recorder",
        _S("recorder", signal.SIGTERM),
        ("RECORDER_DIED",),
        1000.0,
        "process is gone",
    ),
    FaultRow(
        "supervisor killed",
        "SIGKILL to the supervisor",
        _S("supervisor", signal.SIGKILL),
        ("SUPERVISOR_DIED",),
        100.0,
        "is gone",
    ),
    FaultRow(
        "supervisor stopped",
        "SIGSTOP to it",
        _S("supervisor", signal.SIGSTOP),
        ("SUPERVISOR_DIED",),
        500.0,
        "has not moved",
    ),
    FaultRow("supervisor told", "SIGTERM to the supervisor", _S("supervisor", signal.SIGTERM), ()),
    FaultRow(
        "control stopped", "SIGSTOP to the control process", _S("control", signal.SIGSTOP), ("CONTROL_LOST",), 1200.0
    ),
    FaultRow(
        "control killed",
        "SIGKILL to the control process",
        _S("control", signal.SIGKILL),
        ("CONTROL_LOST",),
        15.0,
        control_dies=True,
    ),
    FaultRow(
        "control ended",
        "SIGTERM to the control process",
        _S("control", signal.SIGTERM),
        ("TERMINATED",),
        100.0,
        control_dies=True,
    ),
    FaultRow(
        "both killed",
        "SIGKILL to supervisor and loop",
        _signals(supervisor=_KILL, loop=_KILL),
        _LOST,
        300.0,
        "seen at the device",
    ),
    FaultRow(
        "both stopped",
        "SIGSTOP to supervisor and loop",
        _signals(supervisor=_STOP, loop=_STOP),
        _LOST,
        300.0,
        "seen at the device",
    ),
    FaultRow(
        "killed and stopped",
        "SIGKILL to the supervisor, SIGSTOP to the loop",
        _signals(supervisor=_KILL, loop=_STOP),
        _LOST,
        300.0,
        "seen at the device",
    ),
    FaultRow(
        "stopped and killed",
        "SIGSTOP to the supervisor, SIGKILL to the loop",
        _signals(supervisor=_STOP, loop=_KILL),
        _LOST,
        300.0,
        "seen at the device",
    ),
    FaultRow(
        "three killed",
        "SIGKILL to supervisor, recorder and loop",
        _signals(supervisor=_KILL, recorder=_KILL, loop=_KILL),
        (*_LOST, "RECORDER_DIED"),
        300.0,
        "seen at the device",
    ),
    FaultRow(
        "guardian alone",
        "SIGSTOP to control, supervisor and loop",
        _signals(control=_STOP, supervisor=_STOP, loop=_STOP),
        _LOST,
        500.0,
        "written by the guardian, seen at the device",
    ),
    FaultRow(
        "guardian killed",
        "SIGKILL to the guardian",
        _S("guardian", signal.SIGKILL),
        ("SUPERVISOR_DIED",),
        100.0,
        "is gone",
    ),
    FaultRow(
        "all stopped",
        "SIGSTOP to all of them for 2 s, then SIGCONT",
        all_stopped,
        ("LONG_STALL", *_LOST),
        100.0,
    ),
    FaultRow("estop", "`pamrig estop`", estop, ("ESTOP",), 10.0),
    FaultRow("full disk", "the disk takes nothing any more", _full_disk, (), in_log="not valid"),
    FaultRow("moved", "the folder of the record is moved away", _moved, (), in_log="was deleted or moved"),
    FaultRow("opening", "Ctrl-C to another `pamrig run` while its rig opens", _interrupted, ()),
    FaultRow("flood", "four floods and a subscriber that does not read", _flood, ()),
    FaultRow("second daemon", "another daemon is started", _second_daemon, ()),
    FaultRow("sweep outside", "a sweep that leaves the envelope is sent", _sweep_outside, ()),
)
"""Every fault of the table, in the order of ../explanation/safety.md."""

_IN_CLOSED_LOOP: Final = {
    "nan": ("ANGLE_LOST",),
    "jump": ("ANGLE_LOST",),
    "frozen": ("FROZEN_SENSOR", "TRACKING_ERROR"),
}
"""Where the loop is closed over the angle, what is wrong with the angle has a name of its own."""
CLOSED_LOOP_TABLE: Final = tuple(replace(row, causes=_IN_CLOSED_LOOP.get(row.name, row.causes)) for row in TABLE)
"""Every fault of the table while an angle is followed: the same bounds."""
