"""How much less surely a response is known under records that are faster than those that it is known from."""

from collections.abc import Iterable, Sequence

import numpy as np

from rig.gap.likelihood.lines import Lines
from rig.gap.records.pairs import Pair
from rig.gap.settings import EXCITED_POWER, USUAL_HZ
from rig.record import Column, Record


def known_hz(records: Iterable[Record]) -> float:
    """Up to which excitation a rig is known by these records as surely as levels say, Hz."""
    return known_by_hz((record.dp_cmd_mpa, record.period_s) for record in records)


def known_by_hz(commands: Iterable[tuple[Column, float]]) -> float:
    """The same by the commands (n,) with the time between two rows, s."""
    return max([USUAL_HZ, *(fastest_hz(dp_mpa, dt_s) for dp_mpa, dt_s in commands)])


def fastest_hz(dp_mpa: Column, dt_s: float) -> float:
    """The frequency below which lies nearly all that a command (n,) does; of a command at rest 0."""
    known = np.nan_to_num(dp_mpa)
    power = np.cumsum(np.abs(np.fft.rfft(known - known.mean())) ** 2)
    if not power[-1] > 0.0:
        return 0.0
    return float(np.fft.rfftfreq(len(known), dt_s)[int(np.searchsorted(power, EXCITED_POWER * power[-1]))])


def doubt(pairs: Sequence[Pair], lines: Lines, known: float) -> Column:
    """(l,) by how many times each line is known less surely: in proportion to how many times its record is faster than
    what is `known` (Hz).

    Healthy days of a plant under sines of 1.5, 2.5 and 4 Hz miss a description by days of the usual session by 1.6, 3.2
    and 4.2 times as many floors as under one of 0.5 Hz in the pressures, 1.8, 4.3 and 5.5 in the angle.
    """
    times = np.array([max(fastest_hz(pair.u1_mpa - pair.u2_mpa, pair.dt_s) / known, 1.0) for pair in pairs])
    blocks = np.tile(times, len(lines.rows) // len(pairs))
    out: Column = blocks[lines.record]
    return out
