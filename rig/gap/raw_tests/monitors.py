"""The pressure monitors: a shift of the mean pressure, and wires that carry nothing."""

from collections.abc import Sequence

import numpy as np

from rig.gap.raw_tests.settings import BELOW_ZERO_MPA, DAYS_MEAN_MPA, STANDS_OUT
from rig.gap.raw_tests.signature import MONITOR, Signature
from rig.gap.raw_tests.statistics import between_days, by_chance
from rig.identify.records.monitors import broken_monitor, monitor_trouble, nothing_answers
from rig.record import Record


def mean_pressure(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    """The test for a shift of the mean of both pressures."""
    measured = all(map(_heard, [*cases, *(record for session in sessions for record in session)]))
    if not measured or not sessions:
        return Signature("mean pressure", None, False, 0.0, 0.0, "MPa", "the mean pressure cannot be compared")
    days = [_mean_mpa(session) for session in sessions]
    shift = _mean_mpa(cases) - float(np.mean(days))
    spread, degrees = between_days(days, DAYS_MEAN_MPA)
    found = abs(shift) > STANDS_OUT * max(float(np.std(days)), DAYS_MEAN_MPA)
    text = f"the mean pressure lies {1e3 * shift:+.2f} kPa from that of the earlier days"
    return Signature(
        "mean pressure",
        None,
        found,
        shift,
        0.0,
        "MPa",
        text,
        p_value=2.0 * by_chance(abs(shift), spread, degrees, len(days)),
    )


def wires(cases: Sequence[Record]) -> list[Signature]:
    """Monitors that read nothing: below zero, or standing still under a moving command."""
    return [_wire(name, cases) for name in ("p1", "p2") if any(f"{name}_mpa" in record.columns() for record in cases)]


def _wire(name: str, cases: Sequence[Record]) -> Signature:
    columns = [record.columns().get(f"{name}_mpa", np.zeros(0)) for record in cases]
    middles = [np.nanmedian(column) for column in columns if np.isfinite(column).any()]
    middle = float(np.median(middles)) if middles else 0.0
    below = "reads below zero" if middle < BELOW_ZERO_MPA else None
    troubles = ((record, why) for record in cases if (why := monitor_trouble(record, name)))
    trouble = next((why for record, why in troubles if not nothing_answers(record)), below)
    state = f"{trouble} (a broken wire?)" if trouble else "is alive"
    return Signature(f"{MONITOR} {name}", None, bool(trouble), middle, 0.0, "MPa", f"the monitor of {name} {state}")


def _heard(record: Record) -> bool:
    return record.has_pressures and broken_monitor(record) is None


def _mean_mpa(records: Sequence[Record]) -> float:
    means = [
        np.nanmean(0.5 * (record.p1_mpa + record.p2_mpa))
        for record in records
        if record.p1_mpa is not None and record.p2_mpa is not None
    ]
    return float(np.mean(means))
