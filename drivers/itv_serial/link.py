"""One serial regulator on one port, as its I/O process drives it: pyserial, one command at a time, newest set-point
first.

Runs inside the I/O process only, so it may wait for the wire. Every wait has an end.
"""

import contextlib
import errno
import termios
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import serial
from serial.tools import list_ports

from drivers.io_process.worker import Exchange
from drivers.itv_serial.codec import Codec, Dialect, ReplyError, pace
from drivers.serial_port import SerialPort
from rig.errors import DeviceError, DeviceLost
from rig.fields import bounded

_REFRESH_S: Final = 0.5
"""A set-point that does not change is sent again after this long, in case the regulator was off and on."""
_HELLOS: Final = 3


@dataclass(frozen=True)
class LinkSettings:
    """All that the I/O process of one valve must know."""

    name: str
    port: SerialPort
    dialect: Dialect = field(default_factory=Dialect)
    monitor: bool = True
    patience_s: float = bounded(0.001, 5.0, "s", default=0.03)
    """How long a reply may take beyond its wire time."""
    rescue: bool = False
    """Opened to make safe: a regulator that is not heard is told all the same."""


class ItvLink:
    """A `drivers.io_process.worker.WireLink`: output 0 is the set-point in counts, value 0 the monitored pressure in
    counts."""

    def __init__(self, settings: LinkSettings) -> None:
        self._settings = settings
        self._codec = Codec(settings.dialect)
        port = settings.port
        self._pace = pace(settings.dialect, port.baud, port.bits_per_byte, monitor=True)
        self._wire: Any = None
        self._was_up = False
        self._dirty = False
        self._monitor_next = False
        self._sent_s = 0.0
        self._where = f"{settings.name} on {port.device}"

    def connect(self) -> Mapping[str, str]:
        """Open the port and get one monitor reading: that proves port, baud rate and dialect, and moves nothing.
        After an outage, and for a rescue, it is tried once: the wire of the answers alone may be broken."""
        self._wire = self._open()
        last: DeviceError | None = None
        facts = {"port": self._settings.port.device, "baud": str(self._settings.port.baud)}
        unheard = self._was_up or self._settings.rescue
        for _ in range(1 if unheard else _HELLOS):
            try:
                if self._dirty:
                    self._quieten()
                self._monitor()
            except DeviceLost:
                raise
            except DeviceError as error:
                last = error
                self._dirty = True
                continue
            self._was_up = True
            return facts
        if unheard:
            return facts
        raise DeviceError(
            f"{last}; tried {_HELLOS} times at {self._settings.port.baud} baud: check power, port, baud rate and "
            "dialect"
        )

    def _open(self) -> Any:
        port = self._settings.port
        native = {"exclusive": True} if port.device.startswith("/") else {}
        try:
            return serial.serial_for_url(
                port.device, port.baud, bytesize=port.data_bits, parity=port.parity, stopbits=port.stop_bits,
                timeout=self._settings.patience_s, write_timeout=self._pace.round_s + self._settings.patience_s,
                **native,
            )  # fmt: skip
        except (OSError, ValueError, termios.error) as error:  # SerialException is an OSError; termios.error is not
            raise DeviceError(f"{self._where}: {_why_not(error)}") from None

    def exchange(self, outputs: tuple[float, ...] | None, fresh: bool, urgent: bool) -> Exchange:
        """A new set-point goes first, but never twice running without a monitor reading between, unless it is
        urgent."""
        if self._dirty:
            self._quieten()
        stale = outputs is not None and time.monotonic() - self._sent_s > _REFRESH_S
        if outputs is not None and (fresh or stale) and (urgent or not self._monitor_next):
            return self._set(outputs[0])
        self._monitor_next = False
        if not self._settings.monitor:
            return Exchange(busy=fresh)
        return Exchange(values={0: self._monitor()})

    def _set(self, number: float) -> Exchange:
        count = self._codec.to_count(number)
        reply, _ = self._ask(self._codec.set(count), self._codec.answers_set, self._pace.set_s)
        if self._codec.answers_set:
            self._parse(lambda: self._codec.check_set(reply, count))
        self._monitor_next = self._settings.monitor
        self._sent_s = time.monotonic()
        return Exchange(sent=True)

    def _monitor(self) -> tuple[float, int]:
        """The pressure and when it was taken. The regulator samples between command and reply: the earlier end is
        assumed."""
        reply, asked_ns = self._ask(self._codec.monitor, True, self._pace.monitor_s)
        return float(self._parse(lambda: self._codec.monitored(reply))), asked_ns

    def _parse(self, parse: Any) -> Any:
        try:
            return parse()
        except ReplyError as error:
            self._dirty = True
            raise DeviceError(f"{self._where}: {error}") from None

    def _ask(self, command: bytes, answered: bool, wire_s: float) -> tuple[bytes, int]:
        """Send, and read one line back; returns it without its end, and when the command had left."""
        try:
            if self._wire.in_waiting:
                self._dirty = True
                raise DeviceError(f"{self._where}: bytes came without being asked for: noise, or a late reply")
            self._wire.write(command)
            self._wire.flush()
            asked_ns = time.monotonic_ns()
            if self._codec.dialect.echo:
                self._read_line(command, wire_s)
            reply = self._read_line(None, wire_s) if answered else b""
            if reply and command.startswith(reply) and not self._codec.dialect.echo:
                self._dirty = True
                raise DeviceError(
                    f"{self._where}: the command {reply!r} came back: regulator or adapter echo; switch that off, or "
                    "set `echo: true` in the dialect"
                )
            if self._wire.in_waiting:
                self._dirty = True
                raise DeviceError(f"{self._where}: more came than one reply: which is the answer cannot be told")
            return reply, asked_ns
        except serial.SerialTimeoutException:
            self._dirty = True
            raise DeviceError(f"{self._where}: the port takes no more bytes") from None
        except (
            OSError,
            TypeError,
            termios.error,
        ) as error:  # pyserial raises TypeError when the port was closed under it
            raise DeviceLost(f"{self._where}: the port is gone: {error}") from None

    def _read_line(self, echo: bytes | None, wire_s: float) -> bytes:
        end = self._codec.end if echo is None else self._codec.dialect.terminator.encode()
        self._wire.timeout = wire_s + self._settings.patience_s
        line: bytes = self._wire.read_until(end, size=256)
        if not line:
            self._dirty = True
            raise DeviceError(f"{self._where}: no answer within {self._wire.timeout * 1e3:.0f} ms")
        if not line.endswith(end) or (echo is not None and line != echo):
            self._dirty = True
            raise DeviceError(
                f"{self._where}: {'a reply without its end' if echo is None else 'not the echo of the command'}: "
                f"{line!r}"
            )
        return line[: -len(end)]

    def _quieten(self) -> None:
        """Throw away what comes until the line is silent for as long as a reply takes, so that no late reply answers
        the next command."""
        silence_s = self._pace.round_s + self._settings.patience_s / 2
        give_up = time.monotonic() + 4 * silence_s
        try:
            self._wire.timeout = silence_s
            while self._wire.read(max(1, self._wire.in_waiting)) and time.monotonic() < give_up:
                pass
            self._wire.reset_input_buffer()
        except (OSError, TypeError, termios.error) as error:
            raise DeviceLost(f"{self._where}: the port is gone: {error}") from None
        self._dirty = False

    def close(self, settled: bool = False) -> None:
        """Let go of the port; a regulator has no watchdog, and keeps its pressure either way."""
        wire, self._wire = self._wire, None
        self._dirty = self._monitor_next = False
        if wire is not None:
            with contextlib.suppress(OSError):  # it went away before us
                wire.close()


def _why_not(error: Exception) -> str:
    number = getattr(error, "errno", None)
    if number == errno.ENOENT:
        known = ", ".join(sorted(found.device for found in list_ports.comports())) or "none"
        return f"there is no such port; this machine has: {known}"
    if number in (errno.EBUSY, errno.EAGAIN) or "exclusively lock" in str(error):
        return "the port is in use by another program"
    if number == errno.EACCES:
        return "not allowed to open the port; add the user to its group (often dialout)"
    return f"cannot be opened: {' '.join(str(error).split())}"


def link(settings: dict[str, Any]) -> ItvLink:
    """The link from plain JSON data, as the owner sends it."""
    return ItvLink(
        LinkSettings(**{**settings, "port": SerialPort(**settings["port"]), "dialect": Dialect(**settings["dialect"])})
    )
