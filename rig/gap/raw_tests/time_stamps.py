"""The time stamps: rows that are missing, and how regular they are."""

from collections.abc import Sequence

import numpy as np

from rig.gap.raw_tests.settings import JITTER, STAMP_GAP
from rig.gap.raw_tests.signature import Signature
from rig.gap.records.pairs import Pair
from rig.number_text import counted
from rig.record import Record

LEAST_JITTER = 1e-4
"""Share of a period below which jitter is told as less than that: what numbers are rounded to makes some, too."""


def time_stamps(pairs: Sequence[Pair], sessions: Sequence[Sequence[Record]]) -> Signature:
    """The test; `value` is the number of gaps. Jitter is that of the rows between them."""
    gaps, jitters = 0, []
    for pair in pairs:
        periods = np.diff(pair.stamps_s) / pair.raw.period_s
        gaps += int(np.sum(periods > STAMP_GAP))
        jitters.append(float(np.std(periods[periods <= STAMP_GAP])))
    jitter = float(np.median(jitters))
    rate = 100 * (_period_s([pair.raw for pair in pairs]) / _period_s(sessions[0]) - 1.0) if sessions else 0.0
    against = f", mean period {rate:+.3g} % against the earlier days" if sessions else ""
    shown = f"{100 * jitter:.2g} %" if jitter > LEAST_JITTER else f"less than {100 * LEAST_JITTER:g} %"
    text = f"{counted(gaps, 'gap')} in the time stamps, jitter {shown} of the period{against}"
    return Signature("time stamps", None, gaps > 0 or jitter > JITTER, float(gaps), 0.0, "1", text)


def _period_s(records: Sequence[Record]) -> float:
    """Of records whose holes have rows."""
    return float(np.median([np.mean(np.diff(record.t_s)) for record in records]))
