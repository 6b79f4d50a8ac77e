"""When the records of a session began, one after the other."""

from collections.abc import Sequence
from datetime import datetime
from typing import Final

import numpy as np

from rig.record import Column, Record

LONGEST_SESSION_S: Final = 4.0 * 3600.0
"""Records that lie further apart are of no one session: what warms through a session has cooled in a night. More: two
sessions of a day may pass for one."""


def begun_s(records: Sequence[Record]) -> Column:
    """(r,) seconds after the first began; all 0 where a record does not say when it did, where two of them ran at one
    time, or where they are of no single session."""
    unknown = np.zeros(len(records))
    found = [_started_s(record) for record in records]
    known = [at for at in found if at is not None]
    if len(known) < len(records):
        return unknown
    begun = np.array([at - min(known) for at in known])
    over = begun + [float(record.t_s[-1] - record.t_s[0]) for record in records]
    order = np.argsort(begun)
    if np.any(begun[order][1:] < over[order][:-1]) or np.max(over) > LONGEST_SESSION_S:
        return unknown
    return begun


def _started_s(record: Record) -> float | None:
    """Seconds since some day, the same for all records of one kind; None where nobody says."""
    started_ns, stamp = record.facts.get("started_ns"), record.facts.get("first_time")
    if isinstance(started_ns, int) and started_ns > 0:
        return started_ns * 1e-9
    try:
        return datetime.fromisoformat(str(stamp)).timestamp()  # without its zone as good: only differences count
    except ValueError:
        return None
