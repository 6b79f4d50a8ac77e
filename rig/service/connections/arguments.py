"""What the arguments of the daemon's commands must be, beyond their kind."""

import os
from typing import Any, Final

from rig.service.connections.protocol import Code, Refused

LINE_CHARACTERS: Final = 200
"""Longest text of one line (an operator's name, a note)."""
MOST_PAUSE_S: Final = 86_400.0
"""Between two records of a `start`: a day. A pause that is longer is a typing error, and holds the queue meanwhile."""


def check_start(sweeps: list[Any], pause_s: float, before: str) -> None:
    """Refused when the arguments of `start` are not what they should be."""
    if not 0 <= pause_s <= MOST_PAUSE_S:
        raise Refused(Code.BAD_ARGUMENT, f"start: pause_s: {pause_s:g} s is outside 0 .. {MOST_PAUSE_S:g} s")
    if not all(isinstance(sweep, str) and os.path.isabs(sweep) for sweep in sweeps):
        raise Refused(Code.BAD_ARGUMENT, "start: sweeps: expected a list of absolute paths")
    if before not in ("", "first", "leave"):
        raise Refused(Code.BAD_ARGUMENT, f"start: before: {before!r}; allowed: first, leave")
    if before and not sweeps:
        raise Refused(Code.BAD_ARGUMENT, "start: before: only with sweeps; without any, the queue goes on")


def check_line(where: str, text: str) -> None:
    """Refused for what is no line of text."""
    if not text.strip() or len(text) > LINE_CHARACTERS or not text.isprintable():
        raise Refused(Code.BAD_ARGUMENT, f"{where}: expected a line of 1 to {LINE_CHARACTERS} characters")
