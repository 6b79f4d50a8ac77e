"""What recommended experiments made of the answers of one mode: before, and after each round.

A case that recommended nothing keeps its answer, so that every figure stands on the same cases.
"""

from collections.abc import Sequence
from typing import Any

from rig.blind_check.rates import Rate
from rig.blind_check.row import Row
from rig.blind_check.statistics import mean, rate


def figures_by_experiments(rows: Sequence[Row]) -> dict[str, Any]:
    """`rounds`: figures before any experiment and after each, for single effects and pairs from CLEAR on; what the
    goals ask of them after the last; and `parted`: experiments that told apart what they were to tell apart."""
    last = max((len(row.rounds) for row in rows), default=0)
    stages = [_figures([_after(row, number) for row in rows]) for number in range(last + 1)]
    asked = [one for row in rows for one in row.rounds]
    return {
        "rounds": stages,
        "exact_after_two": stages[-1]["exact_first"],
        "pairs_after_two": stages[-1]["pairs_both"],
        "parted": Rate.of(one.parted for one in asked if one.parted is not None).to_json(),
        "experiments": {
            "asked": rate(rows, lambda row: row.rounds),
            "minutes": mean(one.minutes for one in asked),
            "minutes_most": max((sum(one.minutes for one in row.rounds) for row in rows), default=0.0),
            "promised": mean(one.promised for one in asked),
        },
    }


def _after(row: Row, number: int) -> Row:
    """The case as it was answered after so many experiments."""
    return row.rounds[min(number, len(row.rounds)) - 1].row if number and row.rounds else row


def _figures(rows: Sequence[Row]) -> dict[str, Any]:
    single = [row for row in rows if row.is_nameable]
    pair = [row for row in rows if row.is_clear and row.is_sized_pair]
    return {
        "exact_first": rate(single, lambda row: row.exact),
        "truth_in_set": rate(single, lambda row: row.in_set),
        "set_size": mean(len(row.names) for row in single if row.names),
        "ties": rate(single, lambda row: len(row.names) > 1),
        "pairs_both": rate(pair, lambda row: row.both),
        "false_alarms": rate((row for row in rows if not row.has_cause), lambda row: row.detected),
    }
