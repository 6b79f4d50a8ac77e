"""Which missed periods were the machine's: what the loop recorded beside what a witness on its core went through.

A period is lost to the machine only when the witness, at a priority above the loop's and on its core, was itself held
up across the time at which the loop was due, and that explains the loop's lateness but for OWN_NS. Everything else
stays the loop's.
"""

import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, NamedTuple

from rig.errors import RecordError
from rig.log.mcap.reader import McapLog
from rig.number_text import counted
from rig.qualify.witness import LATE_NS, SLEEP_NS, Account, Stall

OWN_NS: Final = SLEEP_NS + LATE_NS
"""Lateness that needs no witness: one sleep, in which it cannot see a stall begin, and a wake that it still calls
punctual. Less than a period, so that without the stall the period would not have been missed."""
_BLACK_BOX: Final = "blackbox_"


class Miss(NamedTuple):
    """One late wake of the loop, for which it skipped periods."""

    due_ns: int
    """When the first of them was due."""
    woken_ns: int
    """When the loop woke."""
    periods: int


@dataclass
class Place:
    """Where the loop runs and how urgently the rig does, as the kernel says; of several one after another all cores and
    the most urgent."""

    cores: set[int] = field(default_factory=set)
    priority: int = 0
    """The highest real-time priority of the rig's processes; the supervisor's is above the loop's."""

    def see(self, pid: int, is_loop: bool) -> None:
        """Look at one process of the rig."""
        if is_loop:
            self.cores |= os.sched_getaffinity(pid)
        if os.sched_getscheduler(pid) in (os.SCHED_FIFO, os.SCHED_RR):
            self.priority = max(self.priority, os.sched_getparam(pid).sched_priority)


@dataclass(frozen=True)
class Recorded:
    """What one record says of itself."""

    misses: tuple[Miss, ...]
    blemished: bool
    """Not valid for something else than missed periods: a fault, samples that were dropped."""


def held_ns(miss: Miss, stalls: Iterable[Stall]) -> int:
    """How much of the loop's lateness the witness of one core, whose stalls are given, was held up; 0 when it ran as
    the loop was due."""
    near = [stall for stall in stalls if stall.ran_ns <= miss.woken_ns and stall.until_ns > miss.due_ns]
    if not any(stall.ran_ns <= miss.due_ns for stall in near):
        return 0
    return sum(max(min(stall.until_ns, miss.woken_ns) - max(stall.due_ns, miss.due_ns), 0) for stall in near)


def is_held_up(miss: Miss, stalls: Iterable[Stall]) -> bool:
    """Whether the witness was held up across the time at which the loop was due, and until just before the loop
    woke."""
    return miss.woken_ns - miss.due_ns - held_ns(miss, stalls) <= OWN_NS


def judge(place: Place, accounts: Sequence[Account], records: Sequence[Recorded], not_valid: int) -> dict[str, Any]:
    """The result: what of `not_valid` records and of the periods missed in `records` the machine is to blame for."""
    loop_accounts = [one for one in accounts if one.core in place.cores]
    why_not = _why_not(place, loop_accounts)
    misses = [miss for record in records for miss in record.misses]
    excused = {miss for miss in misses if not why_not and any(is_held_up(miss, one.stalls) for one in loop_accounts)}
    forgiven = sum(
        1 for record in records if record.misses and not record.blemished and excused.issuperset(record.misses)
    )
    lengths_ns = [stall.until_ns - stall.due_ns for one in loop_accounts for stall in one.stalls]
    return {
        "cores": sorted(place.cores),
        "rig_priority": place.priority,
        "witness_priority": min((one.priority for one in loop_accounts), default=0),
        "nothing_excused_because": why_not,
        "stalls": len(lengths_ns),
        "longest_stall_ms": max(lengths_ns, default=0) / 1e6,
        "missed_in_records": sum(miss.periods for miss in misses),
        "missed_in_stalls": sum(miss.periods for miss in excused),
        "not_valid": not_valid,
        "not_valid_otherwise": max(not_valid - forgiven, 0),
        "misses": [_plain(miss, loop_accounts, miss in excused) for miss in misses],
    }


def _plain(miss: Miss, loop_accounts: Sequence[Account], in_stall: bool) -> dict[str, Any]:
    """One miss for whoever looks for its reason."""
    return {
        "due_ns": miss.due_ns,
        "periods": miss.periods,
        "late_ms": (miss.woken_ns - miss.due_ns) / 1e6,
        "witness_held_ms": max((held_ns(miss, one.stalls) for one in loop_accounts), default=0) / 1e6,
        "in_stall": in_stall,
    }


def _why_not(place: Place, loop_accounts: Sequence[Account]) -> str:
    """Why nothing may be excused; empty when witnesses may be believed."""
    if not loop_accounts:
        return "no witness on the loop's core"
    doubts = [
        f"core {one.core}: {one.why_not or f'the witness ran at priority {one.priority}, the rig at {place.priority}'}"
        for one in loop_accounts
        if one.why_not or one.priority <= place.priority
    ]
    return "; ".join(doubts)


def summary(found: dict[str, Any]) -> list[str]:
    """For a person."""
    cores = f"core{'s' * (len(found['cores']) > 1)} {' or '.join(map(str, found['cores']))}"
    lines = [
        f"{counted(found['missed_in_records'], 'period')} missed in the records, {found['missed_in_stalls']} of them "
        "in a stall of the machine",
        f"{counted(found['not_valid'], 'record')} not valid, {found['not_valid_otherwise']} of them for another "
        "reason than a stall of the machine",
    ]
    if found["nothing_excused_because"]:
        return [*lines, f"no stall could be witnessed: {found['nothing_excused_because']}"]
    above = f"the witness ran at priority {found['witness_priority']}, the rig at {found['rig_priority']} at most"
    longest = f"the longest of {found['longest_stall_ms']:.1f} ms"
    return [
        *lines,
        f"{counted(found['stalls'], 'stall')} of more than {LATE_NS / 1e6:g} ms on the loop's {cores}, "
        f"{longest}; {above}",
    ]


def recorded_in(folder: Path) -> list[Recorded]:
    """What the finished records below a folder say; black boxes repeat what others hold, and are left out."""
    return [_recorded(file) for file in sorted(folder.rglob("*.mcap")) if not file.name.startswith(_BLACK_BOX)]


def _recorded(file: Path) -> Recorded:
    try:
        with McapLog(file) as log:
            samples, run, result = log.samples(), log.run_facts, log.result_facts
    except RecordError:
        return Recorded((), blemished=True)
    rows = samples.rows(samples["missed"] > 0)
    period_ns = int(run["period_ns"])
    columns = (rows[name].tolist() for name in ("scheduled_ns", "woken_ns", "missed"))
    misses = tuple(
        Miss(due_ns - missed * period_ns, woken_ns, missed) for due_ns, woken_ns, missed in zip(*columns, strict=True)
    )
    counted = sum(miss.periods for miss in misses) == result.get("missed")
    return Recorded(misses, blemished=bool(result.get("fault") or result.get("dropped")) or not counted)
