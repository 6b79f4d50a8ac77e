"""The control protocol: JSON lines, one request and one answer each, in plain data. No sockets here.

A request is `{"v": 1, "id": 7, "command": "arm"}`, with the command's arguments beside it. The answer repeats the id:
`{"v": 1, "id": 7, "ok": true, "result": {...}}` or `{"v": 1, "id": 7, "ok": false, "error": {"code": "...", "message":
"..."}}`. Lines that nobody asked for, after `subscribe`, carry `"event"` instead of an id.
docs/reference/control_protocol.md is the long form.
"""

import json
import math
import sys
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any, Final, NamedTuple

from rig.config import shown, suggest
from rig.errors import RigError

PROTOCOL_VERSION: Final = 1
"""`v` of every message; another one is refused."""
MAX_LINE_BYTES: Final = 64 * 1024
"""A longer line is no request; the connection that sent it is closed."""
_SHORT_LINE_BYTES: Final = 512
_MOST_ITEMS: Final = 500
_MOST: Final = sys.float_info.max


class Code(StrEnum):
    """Why a request was not carried out, for programs; the message is for people."""

    BAD_REQUEST = "bad_request"
    WRONG_VERSION = "wrong_version"
    UNKNOWN_COMMAND = "unknown_command"
    BAD_ARGUMENT = "bad_argument"
    NOT_ALLOWED = "not_allowed"
    WRONG_STATE = "wrong_state"
    REFUSED = "refused"
    """The sweep does not fit, the device does not answer, the disk is full: see the message."""


class Refused(RigError):
    """A request that is not carried out."""

    def __init__(self, code: Code, message: str) -> None:
        super().__init__(message)
        self.code = code


class CommandSpec(NamedTuple):
    """One command: what it takes, whether a viewer may send it, and what it does."""

    arguments: dict[str, type | tuple[type, ...]]
    looking: bool
    meaning: str


COMMANDS: Final[dict[str, CommandSpec]] = {
    "status": CommandSpec({}, True, "everything there is to know now, without waiting for the loop"),
    "subscribe": CommandSpec(
        {"rate_hz": (int, float), "samples": bool},
        True,
        "a `status` event at `rate_hz` (0.1 to 50), with the samples since the last",
    ),
    "arm": CommandSpec(
        {"by": str},
        False,
        "take the measured pressures as set-points, ready to start; nothing moves. `by` says who arms, for the status",
    ),
    "mark": CommandSpec({"text": str}, False, "a line into the log of the record that runs"),
    "start": CommandSpec(
        {"sweeps": list, "pause_s": (int, float), "before": str},
        False,
        "put sweeps (absolute paths) at the end of the queue and work on it; none: go on. What an interrupted queue "
        "still holds "
        "must be decided on with `before`: `first` does it before them, `leave` leaves it where it is",
    ),
    "stop": CommandSpec({"after_current": bool}, False, "ramp down and hold the queue; while nothing runs: disarm"),
    "estop": CommandSpec({}, False, "safe state at once, in any state"),
    "reset": CommandSpec({}, False, "clear a fault whose cause is gone; does not arm"),
    "clear": CommandSpec({}, False, "take what waits, was stopped or failed out of the queue"),
}
"""Every command of version 1."""


@dataclass(frozen=True)
class ClientRequest:
    """One request, checked as far as its form goes."""

    id: int | str | None
    command: str
    arguments: dict[str, Any] = field(default_factory=dict)


def encode(message: dict[str, Any]) -> bytes:
    """One line; numbers that JSON lacks become null."""
    return as_json({"v": PROTOCOL_VERSION, **message}).encode() + b"\n"


def as_json(content: Any) -> str:
    """Plain data in ASCII; numbers that JSON lacks become null."""
    try:
        return json.dumps(content, allow_nan=False, separators=(",", ":"), default=str)
    except ValueError:
        return json.dumps(_without_nan(content), separators=(",", ":"), default=str)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def answer(to: int | str | None, result: Any) -> bytes:
    """The line for a request that was carried out."""
    return encode({"id": to, "ok": True, "result": result})


def refusal(to: int | str | None, code: Code, message: str) -> bytes:
    """The line for a request that was not."""
    return encode({"id": to, "ok": False, "error": {"code": code.value, "message": message}})


def decode(line: bytes) -> dict[str, Any]:
    """One line as a mapping; Refused when it is not one."""
    try:
        message = json.loads(line)
    except (ValueError, RecursionError):
        raise Refused(Code.BAD_REQUEST, "not a line of JSON") from None
    if not isinstance(message, dict):
        raise Refused(Code.BAD_REQUEST, 'expected a mapping such as {"v": 1, "id": 1, "command": "status"}')
    return message


def may_be_an_estop(line: bytes) -> bool:
    """A glance, for who decides what comes first: short, and with the word in it."""
    return len(line) <= _SHORT_LINE_BYTES and b'"estop"' in line


def request_id(message: dict[str, Any]) -> int | str | None:
    """What the answer repeats; None where the request has nothing usable."""
    given = message.get("id")
    return given if isinstance(given, int | str) and not isinstance(given, bool) else None


def parse(message: dict[str, Any]) -> ClientRequest:
    """The request in a message; Refused says what is wrong with it."""
    if message.get("v") != PROTOCOL_VERSION:
        raise Refused(
            Code.WRONG_VERSION,
            f"version {shown(message.get('v'))} is not spoken here; this is version {PROTOCOL_VERSION}",
        )
    name = message.get("command")
    if not isinstance(name, str) or name not in COMMANDS:
        raise Refused(Code.UNKNOWN_COMMAND, f"unknown command {shown(name)}; {suggest(str(name), list(COMMANDS))}")
    allowed = COMMANDS[name].arguments
    given = {key: value for key, value in message.items() if key not in ("v", "id", "command", "token")}
    for key, value in given.items():
        if key not in allowed:
            raise Refused(
                Code.BAD_ARGUMENT,
                f"{name}: unknown argument {shown(key)}; {suggest(key, list(allowed)) if allowed else 'it takes none'}",
            )
        if not isinstance(value, allowed[key]) or (isinstance(value, bool) and allowed[key] is not bool):
            raise Refused(
                Code.BAD_ARGUMENT, f"{name}: {key}: {shown(value)} is not what it should be; see the control protocol"
            )
        _check_usable(f"{name}: {key}", value)
    return ClientRequest(request_id(message), name, given)


def _check_usable(where: str, value: Any) -> None:
    """Refused for what JSON knows and nobody means, or nobody else can read: texts with a character 0 or of bytes that
    are no UTF-8, numbers that no float can hold."""
    if isinstance(value, list) and len(value) > _MOST_ITEMS:
        raise Refused(Code.BAD_ARGUMENT, f"{where}: {len(value)} of them; at most {_MOST_ITEMS}")
    for item in value if isinstance(value, list) else (value,):
        if isinstance(item, str) and "\0" in item:
            raise Refused(Code.BAD_ARGUMENT, f"{where}: {shown(item)} holds a character 0, which no text has")
        if isinstance(item, str) and not _encodable(item):
            raise Refused(
                Code.BAD_ARGUMENT,
                f"{where}: {shown(item)} is no UTF-8 text, and the daemon takes no other, for paths neither: rename "
                "the file, or the folder on its way",
            )
        if isinstance(item, int | float) and not -_MOST <= item <= _MOST:
            raise Refused(Code.BAD_ARGUMENT, f"{where}: {shown(item)} is not a number that can be worked with")


def _encodable(text: str) -> bool:
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
