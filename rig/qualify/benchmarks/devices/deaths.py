"""How long after the loop's death the safe set-points stand at Modbus outputs and serial valves: part of `pamrig bench
devices`."""

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any, Final

from drivers.itv_serial.codec import Dialect, pace
from drivers.itv_serial.device import ItvSerial, ItvSettings
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode
from drivers.serial_port import SerialPort
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError
from rig.interfaces import Device
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.devices.fieldbus_rig import (
    BAUDS,
    REPLY_S,
    SAFE,
    VALVE_ROLES,
    context,
    modbus,
    modbus_at,
    quantiles_us,
    spec,
)

DEATHS: Final = 16
"""Killed loops; a driver behind a slow line gets half of them."""
_WAITED: Final = "the end of a killed process is in the time of its death, which is the kernel's"
_NEVER_S: Final = 5.0
"""What counts for set-points that never arrived."""


def bench_deaths() -> dict[str, Any]:
    """SIGKILL of a process that drives, until both safe set-points have arrived; the end of the killed process is in
    it.

    TCP: by a second instance in this process, which waits for the end of the other as the supervisor does. Serial: by
    the I/O processes alone, which see their pipe close.
    """
    with Emulation(spec()) as running:
        rescuer = ModbusIo(modbus(running), context())
        times = [_killed(running, rescuer.safe, "modbus", str(running.places["io"])) for _ in range(DEATHS)]
    figures = _death_figures("Modbus TCP, a second connection", times, {"goal": 20.0, "why": _WAITED})
    for baud in (BAUDS[0], BAUDS[-1]):
        with Emulation(spec(serial_baud=baud)) as running:
            ports = [running.places["valve_1"], running.places["valve_2"], str(baud)]
            times = [_killed(running, lambda: None, "serial", *ports) for _ in range(DEATHS // 2)]
        found = pace(Dialect(), baud, 10, monitor=True)
        wire_ms = 1e3 * (found.set_s + max(found.set_s, found.monitor_s))
        figures |= _death_figures(
            f"serial valves at {baud} baud, their I/O processes",
            times,
            {"limit": "the wire, at most, computed", "limit_value": wire_ms},
        )
    return figures


def _death_figures(what: str, times_s: list[float], limit: dict[str, Any]) -> dict[str, Any]:
    found = quantiles_us([round(t * 1e9) for t in times_s])
    return {
        f"death of the loop to safe, {what}, {key}": figure(value / 1e3, "ms", **limit) for key, value in found.items()
    }


def _killed(running: Emulation, rescue: Callable[[], None], *words: str) -> float:
    code = "from rig.qualify.benchmarks.devices.deaths import drive_forever; drive_forever()"
    path = os.pathsep.join(filter(None, sys.path))
    with subprocess.Popen(
        [sys.executable, "-c", code, *words], stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path}
    ) as child:
        assert child.stdout
        if child.stdout.readline() != b"driving\n":
            raise DeviceError("the process that was to be killed could not open its device")
        descriptor = os.pidfd_open(child.pid)
        time.sleep(0.05)
        killed_ns = time.monotonic_ns()
        child.send_signal(signal.SIGKILL)
        select.select([descriptor], [], [], 1.0)
        os.close(descriptor)
        rescue()
    return _safe_since(running, killed_ns)


def _safe_since(running: Emulation, killed_ns: int) -> float:
    """Seconds from the kill to the later of the two valves' changes."""
    deadline = time.monotonic() + _NEVER_S
    while time.monotonic() < deadline:
        changes = [change for change in running.state()["changes"] if change[0] >= killed_ns]
        reached = {
            valve: at_ns for at_ns, valve, pressure_mpa in changes if abs(pressure_mpa - SAFE[valve - 1]) < 0.001
        }
        if len(reached) == 2:
            return float(max(reached.values()) - killed_ns) / 1e9
        time.sleep(0.05)  # each look makes the emulators' process write a long answer
    return _NEVER_S


def drive_forever() -> None:
    """Entry of a process that drives until it is killed: argv is `modbus PORT` or `serial DEVICE DEVICE BAUD`."""
    kind, *where = sys.argv[1:]
    device: Device
    if kind == "modbus":
        device = ModbusIo(modbus_at(int(where[0]), ExchangeMode.SEPARATE), context())
    else:
        baud = int(where[2])
        ports = ItvSettings(
            SerialPort(where[0], baud), SerialPort(where[1], baud), patience_s=REPLY_S, silence_periods=1000
        )
        device = ItvSerial(ports, context(VALVE_ROLES))
    device.open()
    started = False
    while True:
        device.write(0.35, 0.15)
        if not started:
            time.sleep(0.1)
            print("driving", flush=True)
            started = True
        time.sleep(0.005)
