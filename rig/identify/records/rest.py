"""About which P0 records lie that do not say it: by their measured pressures, where these lie around several."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from rig.conditions import MEASURED_REST, commanded_rest
from rig.errors import RecordError
from rig.identify.records.monitors import dead_monitor
from rig.record import Record

SHIFTED_MPA: Final = 0.03
"""Measured P0s that lie this far apart are two P0s, MPa: three times what regulators and monitors differ by between
days; laboratories set P0 in steps of 50 kPa. Within a day they were commanded; between days, or beside a model, both
pressures may be shifted. Less: a fault of one record is taken for another P0."""
_LEAST_MPA: Final = 0.001
"""Less than any regulator holds, MPa."""
REST_DIGITS: Final = 2
"""P0 is set in whole 10 kPa, so a measured one is rounded to them."""


def measured_rest(record: Record) -> float | None:
    """P0 by the measured pressures, MPa; None where one of them was not measured, or its monitor is not heard."""
    if record.p1_mpa is None or record.p2_mpa is None or dead_monitor(record):
        return None
    return float(np.nanmedian(0.5 * (record.p1_mpa + record.p2_mpa)))


def known_rest(record: Record) -> float | None:
    """P0 as the record says it, else by its measured pressures, MPa; None where neither tells."""
    commanded = commanded_rest(record)
    return commanded if commanded is not None else measured_rest(record)


def unsaid_rests(records: Sequence[Record]) -> dict[int, float]:
    """The measured P0 (MPa) of each record that does not say its own, by the record's place; empty where they are one
    P0, or nobody knows."""
    found = {
        k: rest
        for k, record in enumerate(records)
        if record.channels.has_valves and commanded_rest(record) is None and (rest := measured_rest(record)) is not None
    }
    return found if found and max(found.values()) - min(found.values()) > SHIFTED_MPA else {}


def far_from_all(p0_mpa: float, records: Sequence[Record]) -> str:
    """That no record lies around this P0, by its commands or its pressures, and around which they do; empty where one
    does, or nobody knows."""
    known = (known_rest(record) for record in records if record.channels.has_valves)
    rests = [rest for rest in known if rest is not None]
    if not rests or min(abs(rest - p0_mpa) for rest in rests) <= SHIFTED_MPA:
        return ""
    around = " and ".join(sorted({f"{rest:.{REST_DIGITS}f}" for rest in rests}))
    return f"P0 is {p0_mpa:g} MPa, as --p0 says; the pressures of these records lie around {around} MPa: is it right?"


def require_rest(p0_mpa: float, who: str) -> None:
    """RecordError for a P0 about which no muscle moves, as `who` says it: regulators are told apart by what they add to
    it, and a model without it is not a number."""
    if p0_mpa < _LEAST_MPA:
        raise RecordError(
            f"P0 is {p0_mpa:g} MPa, as {who} says; where pressures were measured it is {_LEAST_MPA:g} MPa and more; "
            "--p0 says another"
        )


def taken_for(record: Record, rest_mpa: float) -> Record:
    """The record, taken to be commanded around that P0."""
    return replace(record, facts={**record.facts, MEASURED_REST: round(rest_mpa, REST_DIGITS)})


def at_own_rest(records: Sequence[Record]) -> tuple[list[Record], str]:
    """Records of a rig as it is: where they lie around several P0s and do not say so, each is taken to be commanded
    around its measured one; and a line that says so, empty where nothing was taken."""
    rests = unsaid_rests(records)
    taken = [taken_for(record, rests[k]) if k in rests else record for k, record in enumerate(records)]
    return taken, rest_note([taken[k] for k in rests]) if rests else ""


def rest_note(records: Sequence[Record]) -> str:
    """Around which P0s these records are taken to be commanded."""
    rests = [f"{rest:.2f}" for rest in sorted({float(record.facts[MEASURED_REST]) for record in records})]
    listed = " and ".join([", ".join(rests[:-1]), rests[-1]] if len(rests) > 1 else rests)
    return (
        f"P0 stands in no record and is read from the measured pressures: {listed} MPa; p1_cmd_mpa and p2_cmd_mpa, or "
        "the fact p0_mpa of a mapping, would say it"
    )
