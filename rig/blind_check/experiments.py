"""What recommended experiments made of the answers of one mode: before, and after each round.

A case that recommended nothing keeps its answer, so that every figure stands on the same cases.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from rig.blind_check.rates import Rate
from rig.blind_check.statistics import CLEAR, SIZED

Row = Mapping[str, Any]


def told_by_experiments(rows: Sequence[Row]) -> dict[str, Any]:
    """`rounds`: figures before any experiment and after each, for single effects and pairs from CLEAR on; what the
    goals ask of them after the last; and `parted`: experiments that told apart what they were to tell apart."""
    last = max((len(_rounds(row)) for row in rows), default=0)
    stages = [_figures([_after(row, number) for row in rows]) for number in range(last + 1)]
    asked = [one for row in rows for one in _rounds(row)]
    return {
        "rounds": stages,
        "exact_after_two": stages[-1]["exact_first"],
        "pairs_after_two": stages[-1]["pairs_both"],
        "parted": Rate.of(one["parted"] for one in asked if one["parted"] is not None).to_json(),
        "experiments": {
            "asked": Rate.of(bool(_rounds(row)) for row in rows).to_json(),
            "minutes": _mean([one["minutes"] for one in asked]),
            "minutes_most": max((sum(one["minutes"] for one in _rounds(row)) for row in rows), default=0.0),
            "promised": _mean([one["promised"] for one in asked]),
        },
    }


def _after(row: Row, number: int) -> Row:
    """The row with the answer after so many experiments."""
    made = _rounds(row)
    return {**row, **made[min(number, len(made)) - 1]} if number and made else row


def _rounds(row: Row) -> Sequence[Row]:
    """The answers after each experiment; none in a check of before there were any."""
    found: Sequence[Row] = row.get("rounds", [])
    return found


def _figures(rows: Sequence[Row]) -> dict[str, Any]:
    clear = [row for row in rows if row["ratio"] >= CLEAR]
    single = [row for row in clear if row["kind"] == "single" and not row["absorbed"]]
    pair = [row for row in clear if row["kind"] == "pair" and row["weakest"] >= SIZED * CLEAR]
    return {
        "exact_first": _rate(single, "exact"),
        "truth_in_set": _rate(single, "in_set"),
        "set_size": _mean([len(row["set"]) for row in single if row["set"]]),
        "ties": Rate.of(len(row["set"]) > 1 for row in single).to_json(),
        "pairs_both": _rate(pair, "both"),
        "false_alarms": _rate([row for row in rows if row["kind"] == "none"], "detected"),
    }


def _rate(rows: Sequence[Row], key: str) -> dict[str, Any]:
    return Rate.of(bool(row[key]) for row in rows).to_json()


def _mean(values: Sequence[float]) -> float | None:
    return math.fsum(values) / len(values) if values else None
