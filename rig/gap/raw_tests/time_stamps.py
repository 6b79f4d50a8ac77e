"""Jitter, gaps and rate of the time stamps."""

from collections.abc import Sequence

import numpy as np

from rig.gap.raw_tests.settings import JITTER, STAMP_GAP
from rig.gap.raw_tests.signature import Signature
from rig.record import Record


def time_stamps(cases: Sequence[Record], sessions: Sequence[Sequence[Record]]) -> Signature:
    """The test; `value` is the number of gaps."""
    gaps = sum(int(np.sum(np.diff(record.t_s) > STAMP_GAP * record.period_s)) for record in cases)
    jitter = float(np.median([np.std(np.diff(record.t_s)) / record.period_s for record in cases]))
    rate = 100 * (_period_s(cases) / _period_s(sessions[0]) - 1.0) if sessions else 0.0
    against = f", mean period {rate:+.3g} % against the baselines" if sessions else ""
    text = f"{gaps} gaps in the time stamps, jitter {100 * jitter:.2g} % of the period{against}"
    return Signature("time stamps", None, gaps > 0 or jitter > JITTER, float(gaps), 0.0, "1", text)


def _period_s(records: Sequence[Record]) -> float:
    return float(np.median([np.mean(np.diff(record.t_s)) for record in records]))
