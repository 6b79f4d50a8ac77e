"""The emulated line of a serial regulator, plugged in and out: one thread serves it, and what it serves is its own."""

import os
import select
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from hil.emulators.itv_serial import line as lines
from hil.emulators.itv_serial.line import EmulatedSerialLine
from hil.emulators.itv_serial.regulator import Regulator, RegulatorDialect

BAUD = 38_400
"""What a pty is set to as long as nobody sets it."""


@pytest.fixture
def line(tmp_path: Path) -> Iterator[EmulatedSerialLine]:
    regulator = Regulator(RegulatorDialect(), lambda _: None, lambda: 0.25)
    line = EmulatedSerialLine(regulator, tmp_path / "port", BAUD)
    line.plug()
    yield line
    line.unplug()


def asked(line: EmulatedSerialLine, command: bytes) -> bytes:
    """What it answers to a client that opens it for that."""
    client = os.open(line.device, os.O_RDWR | os.O_NOCTTY)
    try:
        os.write(client, command)
        answer = b""
        while not answer.endswith(b"\r\n") and select.select([client], [], [], 5.0)[0]:
            answer += os.read(client, 64)
        return answer
    finally:
        os.close(client)


@pytest.mark.parametrize("at_once", [True, False], ids=["in again at once", "in again later"])
def test_one_that_is_unplugged_in_the_middle_of_a_command_ends_in_order(
    line: EmulatedSerialLine, monkeypatch: pytest.MonkeyPatch, at_once: bool
) -> None:
    """Its thread died of a port that was not there, or went on with the number of it, which was the new one's: two
    served that, and each had half of a command."""
    lost: list[threading.ExceptHookArgs] = []
    on_the_wire, before = threading.Event(), threading.active_count()

    def sleep(seconds: float) -> None:
        on_the_wire.set()
        time.sleep(seconds)

    monkeypatch.setattr(threading, "excepthook", lost.append)
    monkeypatch.setattr(lines, "time", SimpleNamespace(**{**vars(time), "sleep": sleep}))
    client = os.open(line.device, os.O_RDWR | os.O_NOCTTY)
    os.write(client, b"SET 5\r\n" * 30)  # 55 ms
    assert on_the_wire.wait(5.0)
    line.unplug()
    if not at_once:
        time.sleep(0.1)  # by when it has left the wire
    line.plug()
    os.close(client)
    assert asked(line, b"SET 77\r\n").endswith(b"77\r\n")
    assert threading.active_count() == before
    assert lost == []
