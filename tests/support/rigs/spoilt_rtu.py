"""A Modbus RTU module on a pty of its own whose replies can be spoilt one by one: bytes by hand, for what no Modbus
server would send."""

import os
import select
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from pymodbus.framer.rtu import FramerRTU

from hil.emulators.pty import plugged_pty

UNIT: Final = 1
OUTPUTS: Final = 0x0400
"""Two of them, written by function 16 and read back by 3."""
IDENTITY: Final = 0x2012
MAP: Final = f"""\
name: counting module
source: tests
inputs: {{function: 4, address: 0, channels: 2, counts: [0, 65535]}}
outputs: {{address: {OUTPUTS}, channels: 2, counts: [0, 65535]}}
read_back: {{function: 3, address: {OUTPUTS}}}
identity: {{function: 3, address: {IDENTITY}, count: 1, registers: [352]}}
"""
QUICK: Final = ("crc", "cut", "pieces", "unit", "silent", "deaf", "before", "after", "exception", "of another", "echo",
                "echo alone", "twice", "garbled", "zeros")  # fmt: skip
"""Ways that are over when the next request comes."""
AFTERWARDS: Final = ("twice, a little later", "noise, a little later", "late")
"""Ways that are not."""


_PIECES_S: Final = 0.001
_PUNCTUAL_S: Final = 0.002
"""Well below the silence between two frames at 9600 baud, of 4 ms."""


def framed(pdu: bytes, unit: int = UNIT) -> bytes:
    """A whole frame."""
    body = bytes([unit]) + pdu
    return body + FramerRTU.compute_CRC(body).to_bytes(2, "big")


@dataclass
class SpoiltModule:
    """Serves until `stop`. Its first input counts its readings, from 1."""

    device: Path
    late_s: float
    """What "late" is: longer than anybody waits for a reply, and shorter than he then waits for silence."""
    ways: deque[str] = field(default_factory=deque)
    """How the next replies are spoilt; then they are right again."""
    mute: bool = False
    """It obeys, and no reply arrives any more."""
    outputs: list[int] = field(default_factory=lambda: [0, 0])
    sampled_ns: list[int] = field(default_factory=lambda: [0])
    """When each reading was taken, by its number."""
    overdue: bool = False
    """This machine stood still: something came later than it was to come."""

    def __post_init__(self) -> None:
        self.ended = threading.Event()
        self.plug()

    def plug(self) -> None:
        self._ended = threading.Event()
        self.master, self.slave = plugged_pty(self.device)
        self._thread = threading.Thread(target=self._serve, args=(self.master, self._ended), daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """The port is gone; `plug` brings it back."""
        self._ended.set()
        self._thread.join()
        os.close(self.master)
        os.close(self.slave)
        self.device.unlink(missing_ok=True)

    stop = unplug

    def _serve(self, master: int, ended: threading.Event) -> None:
        came = b""
        while not ended.is_set():
            if not select.select([master], [], [], 0.02)[0]:
                continue
            came += os.read(master, 4096)
            while (size := _size(came)) and len(came) >= size:
                request, came = came[:size], came[size:]
                assert framed(request[1:-2], request[0]) == request
                began = time.monotonic()
                way = "silent" if self.mute else self.ways.popleft() if self.ways else "right"
                due_s = self._answer(master, request, way)
                self.overdue |= time.monotonic() - began - due_s > _PUNCTUAL_S

    def _answer(self, master: int, request: bytes, way: str) -> float:
        """Returns how long it is to take, in seconds."""
        if way == "deaf":
            return 0.0
        pdu = self._obeyed(request)
        whole = framed(pdu)
        half = len(whole) // 2
        other = {3: 16, 4: 3, 16: 4, 23: 3}[request[1]]
        now = {
            "crc": whole[:-1] + bytes([whole[-1] ^ 1]),
            "cut": whole[:half],
            "unit": framed(pdu, UNIT + 1),
            "silent": b"",
            "before": b"\xff\x00\xf0" + whole,
            "after": whole + b"\x00\xff",
            "exception": framed(bytes([request[1] | 0x80, 4])),
            "of another": framed(bytes([other | 0x80, 4])),
            "echo": request + whole,
            "echo alone": request,
            "twice": whole + whole,
            "garbled": bytes(byte ^ 0x55 for byte in whole),
            "zeros": bytes(len(whole)),
            "late": b"",
        }.get(way, whole)
        if way == "pieces":
            os.write(master, whole[:half])
            time.sleep(_PIECES_S)
            now = whole[half:]
        os.write(master, now)
        more = {"late": (self.late_s, whole), "twice, a little later": (_PIECES_S, whole),
                "noise, a little later": (_PIECES_S, b"\x01\x04\x04")}  # fmt: skip
        if way not in more:
            return _PIECES_S if way == "pieces" else 0.0
        time.sleep(more[way][0])  # a module does one thing at a time: what is asked meanwhile waits
        os.write(master, more[way][1])
        return more[way][0]

    def _obeyed(self, request: bytes) -> bytes:
        function, address, count = request[1], int.from_bytes(request[2:4], "big"), int.from_bytes(request[4:6], "big")
        if function == 16:
            for place in range(count):
                self.outputs[address - OUTPUTS + place] = int.from_bytes(request[7 + 2 * place : 9 + 2 * place], "big")
            return request[1:6]
        if function == 3:
            registers = [352] if address == IDENTITY else self.outputs[address - OUTPUTS :][:count]
        else:
            registers = [len(self.sampled_ns), 7][:count]
            self.sampled_ns.append(time.monotonic_ns())
        return bytes([function, 2 * count]) + b"".join(one.to_bytes(2, "big") for one in registers)


def _size(came: bytes) -> int:
    """Of the request that begins there; 0: not known yet."""
    if len(came) < 7:
        return 0
    return 9 + came[6] if came[1] == 16 else 8
