"""The loop's process dies or hangs while it drives a Modbus module: the supervisor's own instance makes the outputs
safe."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from support.rigs import fieldbus_rigs as rigs

from drivers.modbus_io.settings import ExchangeMode
from hil.emulators.emulation import Emulation

OWNER = """
import sys, time
from support.rigs import fieldbus_rigs as rigs
from drivers.modbus_io.device import ModbusIo
from drivers.modbus_io.settings import ExchangeMode
place, mode = sys.argv[1:]
place = int(place) if place.isdecimal() else place
settings = rigs.modbus_settings(place, ExchangeMode(mode), silence_periods=10)
device = ModbusIo(settings, rigs.context(period_ns=5_000_000))
device.open()
device.write(0.4, 0.1)
print("driving", flush=True)
while True:
    device.write(0.4, 0.1)
    time.sleep(0.004)
"""
ROUTES = {"tcp": ("separate", None), "tcp_process": ("process", None), "rtu": ("auto", rigs.BAUD)}


def soon(running: Emulation, wanted: tuple[float, float], seconds: float = 5.0) -> bool:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if tuple(round(pressure, 3) for pressure in running.state()["commands_mpa"]) == wanted:
            return True
        time.sleep(0.005)
    return False


@pytest.fixture(params=list(ROUTES))
def driven(request: pytest.FixtureRequest) -> Iterator[tuple[Emulation, "subprocess.Popen[bytes]", str]]:
    mode, baud = ROUTES[request.param]
    running = rigs.wago(f"owner_{'rtu' if baud else 'tcp'}", baud)
    path = os.pathsep.join(filter(None, sys.path))
    call = [sys.executable, "-c", OWNER, str(running.places["io"]), mode]
    with subprocess.Popen(call, stdout=subprocess.PIPE, env={**os.environ, "PYTHONPATH": path}) as process:
        assert process.stdout
        assert process.stdout.readline() == b"driving\n"
        assert soon(running, (0.4, 0.1))
        yield running, process, request.param
        process.kill()


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGSTOP])
def test_a_second_instance_makes_it_safe(
    driven: tuple[Emulation, "subprocess.Popen[bytes]", str], end: signal.Signals
) -> None:
    running, process, route = driven
    other = rigs.modbus(running, ExchangeMode.AUTO if route == "rtu" else ExchangeMode.SEPARATE)
    process.send_signal(end)
    other.safe()
    assert soon(running, rigs.SAFE)
    time.sleep(0.1)
    assert soon(running, rigs.SAFE, 0.1), "and it stays so"
    other.close()
