"""How far the date of a record is to be believed. It was taken from a wall clock that may have stood in 1970, as that
of a small machine does until the network sets it; what is not believed makes no record old.

Asked are the clock since boot, which nobody sets, the record's neighbours in the ledger and its file.
"""

import os
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from rig.service.records.ledger import Entry, Moment

EARLIEST_S: Final = 1735689600.0
"""2025-01-01: pamrig has recorded nothing before."""
STEP_S: Final = 86400.0
"""A clock that is set by less makes nothing old; ages are told in days."""


def moment() -> Moment:
    """Now, by the wall clock and by the clock since boot (Linux; without it the boot has no name)."""
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        return Moment(time.time(), boot, time.clock_gettime(time.CLOCK_BOOTTIME))
    return Moment(time.time())


@dataclass(frozen=True)
class Doubt:
    """A record whose date is not believed, and why not."""

    entry: Entry
    why: str


def doubts(entries: Sequence[Entry], now: Moment) -> dict[str, Doubt]:
    """The records whose date cannot be right, by path; `entries` in the order in which they were recorded."""
    boots = _offsets(entries, now)
    found = zip(entries, _latest_before(entries, now), strict=True)
    asked = ((entry, _why(entry, latest_s, boots.get(entry.boot))) for entry, latest_s in found)
    return {entry.path: Doubt(entry, why) for entry, why in asked if why}


def _why(entry: Entry, latest_s: float, boot_began_s: float | None) -> str:
    """What stands against a record's date; empty for nothing."""
    if entry.recorded_s < EARLIEST_S:
        return f"there was no pamrig on {_day(entry.recorded_s)}"
    if boot_began_s is not None and abs(entry.recorded_s - entry.up_s - boot_began_s) > STEP_S:
        return "the clock has been set since, before the machine was started again"
    if entry.recorded_s < latest_s - STEP_S:
        return f"it was recorded after one of {_day(latest_s)}"
    with suppress(OSError):
        if abs(os.lstat(entry.path).st_mtime - entry.recorded_s) > STEP_S:
            return "its file has another date"
    return ""


def _offsets(entries: Iterable[Entry], now: Moment) -> dict[str, float]:
    """When each boot began by the wall clock, as it was known last."""
    began = {entry.boot: entry.recorded_s - entry.up_s for entry in entries if entry.boot}
    return began | ({now.boot: now.wall_s - now.up_s} if now.boot else {})


def _latest_before(entries: Iterable[Entry], now: Moment) -> Iterator[float]:
    """For each record the latest date of those before it, without dates that are yet to come."""
    latest_s = 0.0
    for entry in entries:
        yield latest_s
        if entry.recorded_s <= now.wall_s:
            latest_s = max(latest_s, entry.recorded_s)


def _day(wall_s: float) -> str:
    with suppress(OverflowError, OSError, ValueError):
        return f"{datetime.fromtimestamp(wall_s, UTC):%Y-%m-%d}"
    return "such a date"
