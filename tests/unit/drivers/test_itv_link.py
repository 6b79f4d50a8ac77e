"""A serial regulator's line as its I/O process sees it: echoes, and answers to what was asked before."""

import os
import threading
import tty
from typing import Any

import pytest
import serial

from drivers.itv_serial.codec import Dialect
from drivers.itv_serial.link import ItvLink, LinkSettings
from drivers.serial_port import SerialPort
from rig.errors import DeviceError


class LateWire:
    """A port whose every answer comes when the next thing is waited for."""

    timeout, in_waiting = 0.0, 0

    def __init__(self) -> None:
        self.late: list[bytes] = []

    def write(self, command: bytes) -> None:
        self.late.append(b"205\r\n" if command.startswith(b"MON") else command.removeprefix(b"SET "))
        self.now = self.late[:-1]

    def read_until(self, _end: bytes, size: int) -> bytes:
        assert size
        return self.read(size)

    def read(self, _count: int) -> bytes:
        taken = self.now[0] if self.now else b""
        self.late, self.now = [reply for reply in self.late if reply is not taken], self.late[:1]
        return taken

    def flush(self) -> None:
        pass

    def reset_input_buffer(self) -> None:
        pass


def made(device: str, patience_s: float = 0.001, **dialect: Any) -> ItvLink:
    return ItvLink(LinkSettings("valve_1", SerialPort(device), Dialect(**dialect), patience_s=patience_s))


def test_a_late_answer_to_one_hello_does_not_answer_the_next(monkeypatch: pytest.MonkeyPatch) -> None:
    """The port was taken for one that answers, and each reading from then on was that of before."""
    monkeypatch.setattr(serial, "serial_for_url", lambda *_, **__: LateWire())
    with pytest.raises(DeviceError, match=r"no answer within .*; tried 3 times"):
        made("/dev/late").connect()


def test_an_echo_is_named_and_not_taken_for_noise() -> None:
    """It was "bytes came without being asked for", from the answer to the echo of before."""
    with pytest.raises(DeviceError, match=r"the command b'MON' came back: .*set `echo: true` in the dialect"):
        made("loop://").connect()
    with pytest.raises(DeviceError, match="no answer within"):
        made("loop://", echo=True).connect()


def test_of_two_replies_neither_is_taken_for_the_answer() -> None:
    """The first was: the answer to an earlier command, or noise that is a number, and the pressure stood behind it."""
    line, device = os.openpty()
    tty.setraw(device)
    link = made(os.ttyname(device), 1.0)
    regulator = threading.Thread(target=_answer, args=(line, [b"205\r\n", b"777\r\n206\r\n", b"207\r\n"]))
    regulator.start()
    link.connect()
    with pytest.raises(DeviceError, match="more came than one reply"):
        link.exchange(None, False, False)
    assert link.exchange(None, False, False).values[0][0] == 207
    regulator.join()
    link.close()
    os.close(line)
    os.close(device)


def _answer(line: int, replies: list[bytes]) -> None:
    for reply in replies:
        while not os.read(line, 100).endswith(b"\n"):
            pass
        os.write(line, reply)
