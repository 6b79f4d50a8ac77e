"""Sensors that seem clipped: they repeat their end value while the command moves on."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from rig.gap.records.cleaning.outliers import IN_WORDS
from rig.gap.records.grid import Pair
from rig.gap.records.settings import CLIPPED, CLIPPED_OVER_NEXT
from rig.record import Record


def clipped_notes(pairs: Sequence[Pair]) -> Iterator[str]:
    """A note for each sensor that repeats its end value while the command moves on, and did not so on the earlier days:
    a joint that rests at an end of its sweep rested there then as well."""
    for pair in pairs:
        for name, (what, unit) in IN_WORDS.items():
            for word, stay in _stays(pair.raw, name).items():
                days = [_stays(day, name, stay.step) for day in pair.raw_days]
                before = min((day[word].share if word in day else 0.0 for day in days), default=0.0)
                if stay.share > max(CLIPPED + before, CLIPPED_OVER_NEXT * stay.beside):
                    yield (
                        f"{pair.name}: {what} stays at its {word} end, where it reads {stay.end:.4g} {unit}, for "
                        f"{100 * stay.share:.0f} % of the time: clipped?"
                    )


class _Stay(NamedTuple):
    """The end of a column, how far the value beside it is, and for which share of the time it stays at either."""

    end: float
    step: float
    share: float
    beside: float


def _stays(record: Record, name: str, within: float = 0.0) -> dict[str, _Stay]:
    """For how long a column of the record is at its upper and its lower end, or `within` so much of it, while it should
    move; empty where it has none, or one value. A sine on a coarse converter's steps is at its end 2.4 times as long as
    beside it."""
    column = getattr(record, name)
    if column is None:
        return {}
    known = np.isfinite(column)
    column, moves = column[known], (np.gradient(record.dp_cmd_mpa) != 0.0)[known]
    values = np.unique(column)
    if len(values) < 2:
        return {}
    ends = {"upper": (values[-1], values[-2]), "lower": (values[0], values[1])}
    return {
        word: _Stay(
            float(end), abs(float(end - beside)),
            *(float(np.mean(moves & (np.abs(column - value) <= within))) for value in (end, beside)),
        )
        for word, (end, beside) in ends.items()
    }  # fmt: skip
