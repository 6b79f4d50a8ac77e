"""How far two commands differ once the later start of one, or the phase of a periodic one, is taken out."""

from dataclasses import dataclass

import numpy as np

from rig.columns import vertex_offset
from rig.gap.records.cleaning.dropouts import Rows
from rig.gap.records.periods import period_rows
from rig.gap.records.settings import (
    ALIGN_STEP_S,
    ALIGNED,
    LEAST_COVERED,
    LONGEST_GAP_S,
    MOST_SHIFT_S,
    OVERLAP,
    SAME_COMMAND,
    SHIFT_HELPS,
    SHORTEST_S,
    SPREAD_FACTOR,
)
from rig.record import Column, Record


@dataclass(frozen=True)
class Alignment:
    """The best fit of one command on another."""

    off: float
    """What stays different, rms or mean, as a share of the first command's spread."""
    shift_s: float
    """What is at t in the first stands at t + shift_s in the other, both from their own starts."""

    @property
    def same(self) -> bool:
        return self.off < SAME_COMMAND


NO_OVERLAP = Alignment(np.inf, 0.0)


def align(record: Record, other: Record) -> Alignment:
    """The shift with which the commands fit best; 0 where they fit as they are. `off` is infinite where they do not
    overlap enough."""
    length = min(_length_s(record), _length_s(other))
    if length < OVERLAP * max(_length_s(record), _length_s(other)) and length < SHORTEST_S:
        return NO_OVERLAP
    unshifted = Alignment(_off(record, other, 0.0), 0.0)
    if unshifted.off < ALIGNED or not _could_fit(record, other):
        return unshifted
    best = _finer(record, other, _best_shift(record, other, length))
    shifted = Alignment(_off(record, other, best), best)
    return shifted if shifted.off < SHIFT_HELPS * unshifted.off else unshifted


def on_clock_of(other: Record, alignment: Alignment) -> Column:
    """(n,) the other record's times on the first one's clock, which starts at 0."""
    times: Column = other.t_s - other.t_s[0] - alignment.shift_s
    return times


def _length_s(record: Record) -> float:
    return float(record.t_s[-1] - record.t_s[0])


def _command(record: Record, t_s: Column) -> Column:
    course: Column = np.interp(t_s, record.t_s - record.t_s[0], record.dp_cmd_mpa)
    return course


def covered(record: Record, t_s: Column) -> Rows:
    """(n,) true where a record has rows around t (n,), s after its start: what is interpolated over a hole is no
    command."""
    own = record.t_s - record.t_s[0]
    if float(np.max(np.diff(own), initial=0.0)) <= LONGEST_GAP_S:  # as in nearly every record
        return np.ones(len(t_s), dtype=bool)
    after = np.clip(np.searchsorted(own, t_s), 1, len(own) - 1)
    covered: Rows = own[after] - own[after - 1] <= LONGEST_GAP_S
    return covered


def _could_fit(record: Record, other: Record) -> bool:
    """Their spreads are alike: no shift changes those."""
    mine, theirs = float(np.std(record.dp_cmd_mpa)), float(np.std(other.dp_cmd_mpa))
    return abs(mine - theirs) < SPREAD_FACTOR * SAME_COMMAND * max(mine, theirs)


def _off(record: Record, other: Record, shift_s: float) -> float:
    start, end = max(0.0, -shift_s), min(_length_s(record), _length_s(other) - shift_s)
    if end - start < OVERLAP * min(_length_s(record), _length_s(other)):
        return np.inf
    t = np.arange(start, end, ALIGN_STEP_S)
    t = t[covered(record, t) & covered(other, t + shift_s)]
    if len(t) * ALIGN_STEP_S < LEAST_COVERED * (end - start):
        return np.inf
    mine = _command(record, t)
    rest = mine - _command(other, t + shift_s)
    return float(max(np.std(rest), abs(np.mean(rest))) / max(float(np.std(mine)), 1e-12))


def _best_shift(record: Record, other: Record, length_s: float) -> float:
    """The shift at the top of the cross-correlation, between its rows by a parabola."""
    t = np.arange(0.0, length_s, ALIGN_STEP_S)
    mine, theirs = (column - column.mean() for column in (_command(record, t), _command(other, t)))
    n = 2 * len(t)
    across = np.fft.irfft(np.conj(np.fft.rfft(mine, n)) * np.fft.rfft(theirs, n), n)
    most = _most_rows(mine, len(t))
    shifts = np.arange(-most, most + 1)
    overlap = across[shifts] / (len(t) - np.abs(shifts))
    k = int(np.argmax(overlap))
    return float(shifts[k] + vertex_offset(overlap, k)) * ALIGN_STEP_S


def _finer(record: Record, other: Record, shift_s: float) -> float:
    """The shift nearby that leaves least, by a parabola: a correlation over few periods peaks a little beside it."""
    shifts = shift_s + ALIGN_STEP_S * np.arange(-2.0, 2.5, 0.5)
    left = np.array([_off(record, other, float(one)) ** 2 for one in shifts])
    k = int(np.argmin(left))
    if not np.isfinite(left).all():
        return float(shifts[k])
    return float(shifts[k] + 0.5 * ALIGN_STEP_S * vertex_offset(left, k))


def _most_rows(command: Column, rows: int) -> int:
    period = period_rows(command)
    most = MOST_SHIFT_S / ALIGN_STEP_S if period is None else period / 2 + 1
    return int(min(most, (1.0 - OVERLAP) * rows))
