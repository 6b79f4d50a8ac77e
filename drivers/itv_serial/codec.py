"""What an ITV regulator speaks on RS-232C: bytes <-> commands, and how long they take on the wire. No I/O.

The command set of the serial variants is unconfirmed, so every part of it is a field of `Dialect`, which stands in the
rig's config. INC and DEC are left out on purpose: a relative command that is lost or repeated leaves the valve
elsewhere.
"""

import re
from dataclasses import dataclass, field
from math import isfinite
from string import Formatter
from typing import NamedTuple

from rig.fields import bounded


class ReplyError(ValueError):
    """A reply that is not what the dialect allows; the message is for a person."""


@dataclass(frozen=True)
class Dialect:
    """The command set of one regulator. The defaults are what is known of SMC's RS-232C variants, unconfirmed."""

    set_command: str = "SET {count}"
    monitor_command: str = "MON"
    terminator: str = "\r\n"
    reply_terminator: str = "\r\n"
    set_reply: str = r"(?P<count>\d{1,4})"
    """Pattern of the whole reply to a set-point, without its terminator. A group `count` must repeat the set-point.
    Empty: no reply."""
    monitor_reply: str = r"(?P<count>\d{1,4})"
    """Pattern of the reply to the monitor command; its group `count` is the pressure."""
    error_replies: list[str] = field(default_factory=lambda: ["UNKNOWN COMMAND", "OUT OF RANGE"])
    """Beginnings of replies that mean: refused."""
    echo: bool = False
    """The regulator sends every command back before its reply."""
    full_scale_counts: int = bounded(1, 1_000_000, "counts", default=1023)
    full_scale_mpa: float = bounded(0.01, 1.0, "MPa", default=0.5)
    turnaround_s: float = bounded(0.0, 1.0, "s", default=0.0)
    """From the last byte of a command to the first of its reply."""

    def __post_init__(self) -> None:
        try:
            fields = [name for _, name, _, _ in Formatter().parse(self.set_command) if name is not None]
            self.set_command.format(count=1)
        except (ValueError, KeyError, IndexError):
            fields = []
        if fields != ["count"]:
            raise ValueError(
                f"set_command must contain {{count}}, or {{count:04d}} for leading zeros, got {self.set_command!r}"
            )
        for name in ("set_command", "monitor_command", "terminator", "reply_terminator"):
            text = getattr(self, name)
            if not text or not text.isascii():
                raise ValueError(f"{name} must be ASCII text, and not empty: got {text!r}")
        for name in ("set_reply", "monitor_reply"):
            _compiled(name, getattr(self, name), needs_count=name == "monitor_reply")


def _compiled(name: str, pattern: str, needs_count: bool) -> re.Pattern[str]:
    try:
        compiled = re.compile(pattern)
    except re.error as error:
        raise ValueError(f"{name}: {pattern!r} is not a regular expression: {error}") from None
    if needs_count and "count" not in compiled.groupindex:
        raise ValueError(f"{name}: {pattern!r} needs a group (?P<count>...)")
    return compiled


class Codec:
    """Commands as bytes, and replies as counts, in one dialect."""

    def __init__(self, dialect: Dialect) -> None:
        self.dialect = dialect
        self._set_reply = _compiled("set_reply", dialect.set_reply, needs_count=False)
        self._monitor_reply = _compiled("monitor_reply", dialect.monitor_reply, needs_count=True)
        self.end = dialect.reply_terminator.encode()
        self.monitor = (dialect.monitor_command + dialect.terminator).encode()
        self.answers_set = bool(dialect.set_reply)
        self.repeats_set = "count" in self._set_reply.groupindex
        """The reply to a set-point repeats it."""

    def to_count(self, number: float) -> int:
        """A set-point in counts: rounded, inside 0..full scale. ValueError when it is not finite."""
        if not isfinite(number):
            raise ValueError(f"a set-point of {number} cannot be sent")
        return min(max(round(number), 0), self.dialect.full_scale_counts)

    def set(self, count: int) -> bytes:
        """The command that sets `count`."""
        return (self.dialect.set_command.format(count=count) + self.dialect.terminator).encode()

    def check_set(self, reply: bytes, count: int) -> None:
        """ReplyError unless `reply` (terminator removed) confirms `count`."""
        match = self._match(self._set_reply, reply)
        found = match.groupdict().get("count")
        if found is not None and _whole(found) != count:
            raise ReplyError(f"answered {found} to a set-point of {count}")

    def monitored(self, reply: bytes) -> int:
        """The pressure in counts; ReplyError when the reply is something else or lies above full scale by more than 10
        %."""
        count = _whole(self._match(self._monitor_reply, reply)["count"])
        if count > 1.1 * self.dialect.full_scale_counts:
            raise ReplyError(f"monitor reads {count}, above the full scale of {self.dialect.full_scale_counts}")
        return count

    def _match(self, pattern: re.Pattern[str], reply: bytes) -> re.Match[str]:
        try:
            text = reply.decode("ascii")
        except UnicodeDecodeError:
            raise ReplyError(f"garbled reply {reply!r}: wrong baud rate or noise") from None
        for refusal in self.dialect.error_replies:
            if text.startswith(refusal):
                raise ReplyError(f"refused: {text!r}")
        if not (match := pattern.fullmatch(text)):
            raise ReplyError(f"unexpected reply {text!r}: another dialect, or noise")
        return match


def _whole(text: str | None) -> int:
    """Counts in a reply; ReplyError for what a pattern of one's own lets through."""
    try:
        return int(text or "")
    except ValueError:
        raise ReplyError(f"answered {text!r} where counts are expected: does the dialect's pattern fit?") from None


class Pace(NamedTuple):
    """What the wire allows at best; C: computed from bytes, baud rate and turnaround alone."""

    set_s: float
    """One set-point with its reply."""
    monitor_s: float
    """One monitor reading with its reply; 0 when monitoring is off."""

    @property
    def round_s(self) -> float:
        """From one set-point to the next when each is followed by a monitor reading."""
        return self.set_s + self.monitor_s

    @property
    def rate_hz(self) -> float:
        """Set-points a second that the valve really gets."""
        return 1.0 / self.round_s

    def summary(self, baud: int, period_s: float) -> str:
        """One line for the operator and the log."""
        share = f"one of {self.round_s / period_s:.1f} ticks" if self.round_s > period_s else "every tick"
        return (
            f"{baud} baud: set-point {self.set_s * 1e3:.1f} ms, monitor {self.monitor_s * 1e3:.1f} ms: "
            f"{self.rate_hz:.1f} set-points/s reach the valve, {share}"
        )


def pace(dialect: Dialect, baud: int, bits_per_byte: int, monitor: bool) -> Pace:
    """Wire time of the longest set-point and monitor exchange; `bits_per_byte` counts start, data, parity and stop
    bits."""
    codec = Codec(dialect)
    top = dialect.full_scale_counts
    digits = len(str(top)) + len(dialect.reply_terminator)
    byte_s = bits_per_byte / baud

    def exchange(command: bytes, answered: bool) -> float:
        sent = len(command) * (2 if dialect.echo else 1)
        return byte_s * (sent + (digits if answered else 0)) + (dialect.turnaround_s if answered else 0.0)

    return Pace(exchange(codec.set(top), codec.answers_set), exchange(codec.monitor, True) if monitor else 0.0)
