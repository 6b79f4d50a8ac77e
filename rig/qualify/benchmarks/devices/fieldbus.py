"""The serial valves' and the Modbus modules' part of `pamrig bench devices`, on their emulators in a process of their
own.

What one tick costs the loop, beside the bare package's calls, and what rate each line really sustains, beside what its
baud rate allows by computation.
"""

import time
from collections.abc import Callable
from typing import Any, Final

from drivers.itv_serial.codec import Dialect, pace
from drivers.itv_serial.device import ItvSerial
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.plan import make_plan
from drivers.modbus_io.settings import ExchangeMode, ModbusSettings
from hil.emulators.emulation import Emulation
from rig.errors import DeviceError
from rig.interfaces import Device, Role
from rig.qualify.benchmarks import figure
from rig.qualify.benchmarks.devices.deaths import bench_deaths
from rig.qualify.benchmarks.devices.fieldbus_rig import (
    BAUDS,
    REPLY_S,
    VALVE_ROLES,
    context,
    itv,
    modbus,
    quantiles_us,
    spec,
    tick,
)

FIELDBUS_TICKS: Final = 2000
RATE_S: Final = 1.0
"""Ticks of the exchanges that are timed one by one, and how long each rate is counted for, s."""


def bench_fieldbus() -> dict[str, Any]:
    """All figures of this file."""
    figures = _tcp()
    for baud in BAUDS:
        figures |= _rates(baud)
    return figures | _peers() | bench_deaths()


def _tcp() -> dict[str, Any]:
    figures: dict[str, Any] = {}
    with Emulation(spec()) as running:
        settings = modbus(running)
        bare = _bare(settings)
        for mode in (ExchangeMode.SEPARATE, ExchangeMode.COMBINED):
            device = ModbusIo(modbus(running, mode), context())
            device.open()
            ours, peer = _in_turns(lambda device=device: tick(device), bare[mode])  # type: ignore[misc]
            device.close()
            calls = "functions 4 and 16" if mode is ExchangeMode.SEPARATE else "function 23"
            for key in ("p50", "p99"):
                figures[f"Modbus TCP {mode.value}, tick {key}"] = figure(
                    ours[key], "us", f"bare pymodbus, {calls}", peer[key]
                )
        figures |= _tcp_rates(running)
        bare[ExchangeMode.AUTO]()
    return figures


def _bare(settings: ModbusSettings) -> dict[ExchangeMode, Callable[[], None]]:
    """The same exchanges by the package alone; AUTO closes the client."""
    from pymodbus.client import ModbusTcpClient

    client = ModbusTcpClient(settings.host, port=settings.port, timeout=REPLY_S, retries=0)
    client.connect()  # type: ignore[no-untyped-call]

    def separate() -> None:
        client.read_input_registers(0, count=4, device_id=1)
        client.write_registers(0, [13107, 13107], device_id=1)

    def combined() -> None:
        client.readwrite_registers(read_address=0, read_count=4, write_address=0, values=[13107, 13107], device_id=1)

    return {ExchangeMode.SEPARATE: separate, ExchangeMode.COMBINED: combined, ExchangeMode.AUTO: client.close}


def _tcp_rates(running: Emulation) -> dict[str, Any]:
    """Ticks a second without waiting: what TCP on this machine could carry."""
    figures = {}
    for mode in (ExchangeMode.SEPARATE, ExchangeMode.COMBINED):
        device = ModbusIo(modbus(running, mode), context())
        device.open()
        ticks = _count(lambda device=device: tick(device))  # type: ignore[misc]
        device.close()
        figures[f"Modbus TCP {mode.value}, ticks a second"] = figure(
            ticks / RATE_S,
            "1/s",
            better="higher",
            goal=200.0,
            why="how far beyond the loop's own 200 a second TCP goes here",
        )
    return figures


def _rates(baud: int) -> dict[str, Any]:
    """What the lines of one baud rate sustain, a serial valve and an RTU bus, one after the other on one emulated
    rig."""
    with Emulation(spec(rtu_baud=baud, serial_baud=baud)) as running:
        return _serial_rate(running, baud) | _rtu_rate(running, baud)


def _serial_rate(running: Emulation, baud: int) -> dict[str, Any]:
    """Set-points that reach one valve while a new one is ordered every millisecond."""
    device = ItvSerial(itv(running, baud), context(VALVE_ROLES))
    device.open()
    times, writes = _drive(device, lambda: len(running.state()["writes"]["valve_1"]))
    device.close()
    computed = pace(Dialect(), baud, 10, monitor=True).rate_hz
    figures = {
        f"serial valve at {baud} baud, set-points a second": figure(
            writes / RATE_S,
            "1/s",
            better="higher",
            limit="the wire, computed for the longest message",
            limit_value=computed,
        )
    }
    if baud in (BAUDS[0], BAUDS[-1]):
        for key, value in quantiles_us(times).items():
            name = f"serial valves at {baud} baud, tick {key}"
            figures[name] = figure(value, "us", limit="both exchanges waited for, computed", limit_value=2e6 / computed)
    return figures


def _rtu_rate(running: Emulation, baud: int) -> dict[str, Any]:
    """Rounds of set-points and inputs on RTU, by function 23."""
    settings = modbus(running, ExchangeMode.AUTO, baud)
    device = ModbusIo(settings, context())
    device.open()
    times, rounds = _drive(device, lambda: running.state()["requests"]["io"])
    device.close()
    assert settings.serial
    round_s = make_plan(settings, frozenset(Role)).round_s(settings.serial)
    figures = {
        f"Modbus RTU at {baud} baud, rounds a second": figure(
            rounds / RATE_S, "1/s", better="higher", limit="the wire, computed", limit_value=1.0 / round_s
        )
    }
    if baud == BAUDS[-1]:
        for key, value in quantiles_us(times).items():
            figures[f"Modbus RTU at {baud} baud, tick {key}"] = figure(
                value, "us", limit="the round waited for, computed", limit_value=1e6 * round_s
            )
    return figures


def _drive(device: Device, count: Callable[[], int]) -> tuple[list[int], int]:
    """Tick once a millisecond for RATE_S with set-points that never repeat: what the ticks took (ns), and how far
    `count` went."""
    times, number = [], 0
    before, end = count(), time.monotonic() + RATE_S
    while time.monotonic() < end:
        number += 1
        began = time.perf_counter_ns()
        try:
            device.read()
            device.write(0.1 + 0.0005 * (number % 400), 0.3 - 0.0005 * (number % 400))
        except DeviceError:
            continue
        times.append(time.perf_counter_ns() - began)
        time.sleep(0.001)
    return times, count() - before


def _count(call: Callable[[], object]) -> int:
    done, end = 0, time.monotonic() + RATE_S
    while time.monotonic() < end:
        call()
        done += 1
    return done


def _in_turns(ours: Callable[[], None], peer: Callable[[], None]) -> tuple[dict[str, float], dict[str, float]]:
    """Driver and package in rounds of fifty, so that a drift of the machine meets both."""
    times: tuple[list[int], list[int]] = ([], [])
    for _ in range(FIELDBUS_TICKS // 50):
        for call, found in zip((ours, peer), times, strict=True):
            for _ in range(50):
                began = time.perf_counter_ns()
                call()
                found.append(time.perf_counter_ns() - began)
    return quantiles_us(times[0]), quantiles_us(times[1])


def _peers() -> dict[str, Any]:
    """The same lines at 115200 baud by the bare packages in a loop of their own, which has nothing else to do
    meanwhile."""
    baud = BAUDS[-1]
    with Emulation(spec(rtu_baud=baud, serial_baud=baud)) as running:
        serial_hz = _bare_serial(running, baud)
        synchronous_hz = _bare_rtu(running, baud)
        device = ItvSerial(itv(running, baud), context(VALVE_ROLES))
        device.open()
        _, writes = _drive(device, lambda: len(running.state()["writes"]["valve_1"]))
        device.close()
        bus = ModbusIo(modbus(running, ExchangeMode.AUTO, baud), context())
        bus.open()
        _, rounds = _drive(bus, lambda: running.state()["requests"]["io"])
        bus.close()
    return {
        f"serial valve at {baud} baud, set-points a second, beside pyserial": figure(
            writes / RATE_S, "1/s", "bare pyserial, one valve, waiting", serial_hz, better="higher"
        ),
        f"Modbus RTU at {baud} baud, rounds a second, beside pymodbus": figure(
            rounds / RATE_S,
            "1/s",
            "pymodbus' synchronous client, which polls and keeps no silence",
            synchronous_hz,
            better="higher",
        ),
    }


def _bare_serial(running: Emulation, baud: int) -> float:
    """Set-point and monitor reading in turns."""
    import serial

    with serial.Serial(running.places["valve_1"], baud, timeout=REPLY_S, exclusive=True) as port:
        number = 0

        def exchange() -> None:
            nonlocal number
            number += 1
            port.write(b"SET %d\r\n" % (200 + number % 800))
            port.read_until(b"\r\n")
            port.write(b"MON\r\n")
            port.read_until(b"\r\n")

        return _count(exchange) / RATE_S


def _bare_rtu(running: Emulation, baud: int) -> float:
    """Function 23 by the synchronous client."""
    from pymodbus.client import ModbusSerialClient

    client = ModbusSerialClient(running.places["io"], baudrate=baud, stopbits=2, timeout=REPLY_S, retries=0)
    client.connect()
    rounds = _count(
        lambda: client.readwrite_registers(
            read_address=0, read_count=4, write_address=0, values=[13107, 13107], device_id=1
        )
    )
    client.close()  # type: ignore[no-untyped-call]
    return rounds / RATE_S
