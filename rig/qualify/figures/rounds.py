"""Several rounds of one benchmark as one: of each figure the middle round, and how far the rounds lie apart."""

from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any, Final

Row = Mapping[str, Any]
Figures = Mapping[str, Row]
"""Name of a figure -> its row, as `rig.qualify.benchmarks.figure` makes it."""
_MIDDLE: Final = ("value", "peer_value", "ratio", "limit_value", "low", "high")


def measured(run: Callable[[], Figures], rounds: int) -> dict[str, dict[str, Any]]:
    """`run` carried out so many times, as one."""
    return gathered([run() for _ in range(rounds)])


def gathered(rounds: Sequence[Figures]) -> dict[str, dict[str, Any]]:
    """Each figure's numbers as the middle of its rounds (of `value`, `peer_value` and `ratio` each its own), with the
    extremes of `value` and `ratio` where it was measured more than once."""
    names = dict.fromkeys(name for figures in rounds for name in figures)
    return {name: _of([figures[name] for figures in rounds if name in figures]) for name in names}


def _of(rows: Sequence[Row]) -> dict[str, Any]:
    made = dict(rows[0])
    for key in _MIDDLE:
        if known := [row[key] for row in rows if row.get(key) is not None]:
            made[key] = median(known)
    return (
        made if len(rows) == 1 else made | {"rounds": len(rows)} | _extremes(rows, "value") | _extremes(rows, "ratio")
    )


def _extremes(rows: Sequence[Row], key: str) -> dict[str, float]:
    known = [row[key] for row in rows if row.get(key) is not None]
    return {f"{key}_low": min(known), f"{key}_high": max(known)} if known else {}
