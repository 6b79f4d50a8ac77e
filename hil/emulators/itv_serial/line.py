"""The RS-232C line of one regulator: a pseudo-terminal whose bytes take the time that their baud rate gives them.

A pty moves bytes at once and knows no baud rate, so this file adds both: a command is complete when its last byte would
have come, an answer arrives in pieces, and a client with another baud rate gets noise. Faults are switched on from
outside.
"""

import contextlib
import os
import random
import select
import termios
import threading
import time
from dataclasses import dataclass
from pathlib import Path

from hil.emulators.itv_serial.regulator import Regulator
from hil.emulators.priority import run_in_real_time
from hil.emulators.pty import plugged_pty

_RATES = {getattr(termios, name): int(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdecimal()}


@dataclass
class LineTrouble:
    """What is wrong with the line or the regulator; all off: a healthy one."""

    silence: bool = False
    """Commands are obeyed, nothing is answered."""
    power_off: bool = False
    """Nothing is obeyed and nothing answered; the pressure stays, as the real one may hold it."""
    cut_answers: int = 0
    """So many bytes are missing at the end of every answer."""
    garble: float = 0.0
    """Share of answers in which a byte is wrong."""
    late_s: float = 0.0
    """Every answer comes so much later."""
    noise: bytes = b""
    """Bytes that come by themselves after every answer."""


class EmulatedSerialLine:
    """Serves one regulator on a pty; `device` is a link to the port that a client opens, the same after every plugging
    in."""

    def __init__(
        self,
        regulator: Regulator,
        device: Path,
        baud: int,
        bits_per_byte: int = 10,
        turnaround_s: float = 0.0,
        seed: int = 0,
    ) -> None:
        self.device = device
        self.trouble = LineTrouble()
        self.writes: list[tuple[int, int]] = []
        """When the set-point changed (CLOCK_MONOTONIC ns) and to how many counts; the newest thousand."""
        self._regulator, self._baud, self._turnaround_s = regulator, baud, turnaround_s
        self._byte_s = bits_per_byte / baud
        self._random = random.Random(seed)
        self._free_s = 0.0
        self._served: tuple[threading.Thread, int] | None = None
        """Who serves the port, and what ends him."""

    @property
    def set_point(self) -> int:
        """What the regulator was told last, in counts."""
        return self._regulator.set_point

    def plug(self) -> None:
        """Make the port and serve it. Idempotent."""
        if self._served is None:
            wake = os.eventfd(0)
            thread = threading.Thread(target=self._serve, args=(*plugged_pty(self.device), wake), daemon=True)
            self._served = thread, wake
            thread.start()

    def unplug(self) -> None:
        """Pull the plug: the client's port is gone when what is under way on it has been. Idempotent."""
        self.device.unlink(missing_ok=True)
        served, self._served = self._served, None
        if served is not None:
            thread, wake = served
            os.eventfd_write(wake, 1)
            thread.join()
            os.close(wake)

    def _serve(self, master: int, slave: int, wake: int) -> None:
        """Closes what it serves itself: a number that is free again is somebody else's port."""
        run_in_real_time()
        with contextlib.suppress(OSError, ValueError, termios.error):
            while wake not in select.select([master, wake], [], [])[0]:
                self._receive(master, os.read(master, 4096))
        os.close(master)
        os.close(slave)

    def power(self, on: bool) -> None:
        """Switch the regulator's supply. Off, it holds its pressure; on again, it starts from a set-point of zero."""
        if on and self.trouble.power_off:
            self._regulator.forget()
        self.trouble.power_off = not on

    def _receive(self, master: int, data: bytes) -> None:
        """The bytes are through when the wire has carried them; an idle wire starts now."""
        self._free_s = max(self._free_s, time.monotonic()) + len(data) * self._byte_s
        _sleep_until(self._free_s)
        if self.trouble.power_off:
            return
        if (found := _clients_baud(master)) != self._baud:
            self._send(
                master,
                bytes(
                    self._random.randrange(128, 256)
                    for _ in range(max(1, len(data) * self._baud // max(found, 1) // 4))
                ),
            )
            return
        before = self._regulator.set_point
        answer = self._regulator.receive(data)
        if self._regulator.set_point != before:
            self.writes = [*self.writes[-999:], (time.monotonic_ns(), self._regulator.set_point)]
        if answer:
            self._answer(master, answer)

    def _answer(self, master: int, answer: bytes) -> None:
        trouble = self.trouble
        _sleep_until(time.monotonic() + self._turnaround_s + trouble.late_s)
        if trouble.silence:
            return
        if trouble.garble and self._random.random() < trouble.garble:
            at = self._random.randrange(len(answer))
            answer = answer[:at] + bytes([answer[at] ^ (1 << self._random.randrange(8)) or 0xFF]) + answer[at + 1 :]
        self._send(master, answer[: len(answer) - trouble.cut_answers] + trouble.noise)

    def _send(self, master: int, data: bytes) -> None:
        """In two pieces at their times, as a receiver sees a slow line."""
        began = time.monotonic()
        half = len(data) // 2
        for piece, through in ((data[:half], half), (data[half:], len(data))):
            _sleep_until(began + through * self._byte_s)
            if piece:
                os.write(master, piece)


def _clients_baud(master: int) -> int:
    """The rate to which the client has set the port: both ends of a pty share one setting."""
    return _RATES.get(termios.tcgetattr(master)[5], 0)


def _sleep_until(then_s: float) -> None:
    while (left := then_s - time.monotonic()) > 0:
        time.sleep(left)
