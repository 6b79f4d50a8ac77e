"""Old records make room, when and only when the settings say so: off by default, announced a day before, logged after.

Only records of this daemon's own ledger may go, never the newest of a session (the folder of a sweep), never one that
somebody renamed or replaced, and never a folder. Everything else under the logs is somebody's and is not even looked
at. No wall clock is asked: a record is as old as the daemon has run since.
"""

import asyncio
import logging
import os
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from rig.errors import RigError
from rig.service.aside import DiskWork
from rig.service.records.ledger import Ledger, LedgerEntry
from rig.service.records.operating_time import OperatingTime

NOTICE_S: Final = 86400.0
"""From the announcement of a record to its end. Counted while the daemon runs: a restart announces anew, and a wall
clock that jumps gives nobody less time to object."""
_TURN_S: Final = 600.0
_LOG = logging.getLogger("pamrig")


@dataclass(frozen=True)
class Policy:
    """What is to be kept; None: everything."""

    keep_bytes: int | None = None
    keep_s: float | None = None
    """Of the daemon's operating time."""

    @property
    def off(self) -> bool:
        """Nothing ever goes."""
        return self.keep_bytes is None and self.keep_s is None

    def due(self, entries: Iterable[LedgerEntry], operating_s: float) -> list[LedgerEntry]:
        """The records that may go, in the order of recording, of a daemon that has run for `operating_s`: too old, or
        the first of too many bytes. The newest of each session stays."""
        present = [] if self.off else [entry for entry in entries if entry.ours]
        newest = _newest(present)
        surplus = sum(entry.size for entry in present) - (
            self.keep_bytes if self.keep_bytes is not None else float("inf")
        )
        due = []
        for entry in present:
            too_old = self.keep_s is not None and operating_s - entry.operating_s > self.keep_s
            if entry is not newest[entry.session] and (too_old or surplus > 0):
                due.append(entry)
                surplus -= entry.size
        return due


def _newest(present: Iterable[LedgerEntry]) -> dict[str, LedgerEntry]:
    """The last record of each session."""
    return {entry.session: entry for entry in present}


class Retention:
    """Announces what is due and removes what has been announced for a day."""

    def __init__(self, ledger: Ledger, policy: Policy, operating: OperatingTime, disks: DiskWork) -> None:
        self._ledger, self._policy, self._operating, self._disks = ledger, policy, operating, disks
        self._announced: dict[str, float] = {}
        """Path -> operating time of the announcement (s)."""

    async def run(self) -> None:
        """A turn every ten minutes, for ever; each removal stands in the log, a day ahead and once it is done."""
        while True:
            await self._disks.do(self.remember)
            try:
                await self._disks.do(self.turn)
            except RigError as error:
                _LOG.error("retention: %s", error)
            await asyncio.sleep(_TURN_S)

    def remember(self) -> None:
        """Keep how long the daemon has run; where that cannot be written, records grow old later, and the log says
        so."""
        try:
            self._operating.save()
        except RigError as error:
            _LOG.error("retention: %s", error)

    def turn(self) -> tuple[list[LedgerEntry], list[LedgerEntry]]:
        """What is announced now, and what has been removed now; the log has each before anything else can fail.

        A record that is not due any more loses its announcement. RigError when the ledger cannot be written.
        """
        if self._policy.off:
            return [], []
        now = self._operating.s()
        due = self._policy.due(self._ledger.entries, now)
        fresh = [entry for entry in due if entry.path not in self._announced]
        for entry in fresh:
            _LOG.warning(
                "retention: %s goes in %.0f h (keep_gb, keep_days in the settings)", entry.path, NOTICE_S / 3600
            )
        self._announced = {entry.path: self._announced.get(entry.path, now) for entry in due}
        removed = [entry for entry in due if now - self._announced[entry.path] >= NOTICE_S and _removed(entry)]
        if removed:
            self._announced = {
                path: at for path, at in self._announced.items() if path not in {entry.path for entry in removed}
            }
            self._ledger.forget([entry.path for entry in removed])
        return fresh, removed

    def to_json(self) -> dict[str, Any] | None:
        """For the status: how many records are announced and when the first of them goes; None while nothing is."""
        announced = self._announced  # replaced as a whole by the thread that turns
        if not announced:
            return None
        return {
            "announced": len(announced),
            "first_in_s": max(min(announced.values()) + NOTICE_S - self._operating.s(), 0.0),
        }


def _removed(entry: LedgerEntry) -> bool:
    if not entry.ours:
        return False
    try:
        os.unlink(entry.path)
    except OSError:
        return False
    _LOG.warning("retention: removed %s (%d bytes)", entry.path, entry.size)
    return True
