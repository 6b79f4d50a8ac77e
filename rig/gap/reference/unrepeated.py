"""What a rig does not repeat from one period of its excitation to the next: noise of any colour, regulators that hunt.

No cause explains it, and every day has it anew. Its spectrum is half the mean square by which successive periods of a
steady answer differ (sample variance over periods: Pintelon and Schoukens, System Identification, 2nd edition, Wiley
2012, chapter 2; by successive differences, so that what creeps or drifts does not count: von Neumann, Ann. Math. Stat.
12, 1941).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.columns import vertex_offset
from rig.gap.likelihood.lines import Lines, lines_of
from rig.gap.records.periods import period_rows
from rig.gap.reference.expectation import Parts
from rig.gap.response.lateness import Lateness, delayed
from rig.gap.response.propagate import RecordContext
from rig.gap.settings import ENVELOPE_HZ, TOP_HZ
from rig.record import Column

SETTLING = 1
"""First periods of a record that are left out, where two remain: the rig comes into its steady state."""
FEWEST = 2
"""Periods that can be compared."""
BESIDE = 2
"""Rows before and after a period that a column is read from between its rows."""
REACH = 2
"""Rows by which a multiple of a period may be off that is known from half as many."""
WHOLE = 1e-3
"""A row between the grid's counts as measured where its interpolated weight is 1 but for this: its neighbours were."""


@dataclass(frozen=True)
class Unrepeated:
    """What is not repeated of a column."""

    rms: float
    loudest_hz: float


def shown_by(contexts: Sequence[RecordContext], days_of: Callable[[Sequence[RecordContext]], Column]) -> Column:
    """(n, K) a factor's columns on the earlier days; without days, (n, 1) those of the case. `days_of` gives columns
    less what a model says of them: periods are compared whose rows do not lie at the same phases."""
    if contexts[0].pair.days:
        return days_of(contexts)
    return days_of([replace(context, pair=replace(context.pair, days=(context.pair.case,))) for context in contexts])


def with_unrepeated(parts: Parts, contexts: Sequence[RecordContext], shown: Column) -> Parts:
    """The same with the variance of what the rig does not repeat, as the columns `shown` (n, K) tell it. Beside earlier
    days it counts twice, for their mean and for the case; without days it is the case's own, which no simulator
    follows."""
    own = unrepeated(parts.lines, _commands(contexts), shown)
    noise = np.maximum(parts.noise, own)
    return replace(parts, noise=noise + own if contexts[0].pair.days else noise)


def of_contexts(contexts: Sequence[RecordContext], days_of: Callable[[Sequence[RecordContext]], Column]) -> Unrepeated:
    """By how much the case differs from the mean of the earlier days because the rig does not repeat itself; without
    days, from something that repeats exactly. In the columns' unit."""
    pairs, count, shown = (
        [context.pair for context in contexts],
        len(contexts[0].pair.days),
        shown_by(contexts, days_of),
    )
    every = pairs * (len(shown) // sum(map(len, pairs)))
    lines = lines_of([len(p) for p in every], [p.dt_s for p in every], [p.used for p in every], TOP_HZ)
    variance = unrepeated(lines, _commands(contexts), shown)
    mean_square = (1.0 + 1.0 / count if count else 1.0) * float(np.sum(variance)) / len(shown)
    return Unrepeated(math.sqrt(mean_square), float(lines.frequency_hz[np.argmax(variance)]))


def unrepeated(lines: Lines, commands: Sequence[Column], days: Column) -> Column:
    """(l,) variance that a day adds anew to each line, mean of the days' (n, K). `commands` are those of the records,
    of which `lines` may have each several times over; where one has no period, the mean of the others stands for it,
    and where none has, nothing is known: 0."""
    ends = np.cumsum(lines.rows)[:-1]
    each = [_periods(command) for command in commands] * (len(lines.rows) // len(commands))
    parts = zip(each, np.split(days, ends), np.split(lines.used, ends), lines.dt_s, strict=True)
    spectra = [_spectrum(*part, lines.top_hz) for part in parts]
    known = [spectrum for spectrum in spectra if spectrum is not None]
    if not known:
        return np.zeros_like(lines.frequency_hz)
    out = np.empty_like(lines.frequency_hz)
    for k, spectrum in enumerate(spectra):
        here = lines.record == k
        of_this = known if spectrum is None else [spectrum]
        out[here] = np.mean([np.interp(lines.frequency_hz[here], *one) for one in of_this], axis=0)
    return out


def _commands(contexts: Sequence[RecordContext]) -> list[Column]:
    return [context.pair.u1_mpa - context.pair.u2_mpa for context in contexts]


def _spectrum(
    periods_of: tuple[Column, int], days: Column, used: Column, dt_s: float, top_hz: float
) -> tuple[Column, Column] | None:
    """Frequencies (m,) and variance (m,) of a line of what the days (n, K) of one record do not repeat between the
    periods of its command, see `_periods`; None where it has none."""
    starts, rows = periods_of
    if len(starts) < FEWEST:
        return None
    measured = used[:, None]
    periods, there = (_cut(column, starts, rows) for column in (measured * days, measured))
    known = np.abs(there - 1.0) < WHOLE
    both = (known[1:] & known[:-1]).astype(float)
    later = np.diff(periods, axis=0)
    drift = np.sum(both * later, axis=(0, 1)) / max(float(np.sum(both)), 1.0)
    apart = (both * (later - drift)).reshape(-1, days.shape[1])
    own = lines_of([len(apart)], [dt_s], [np.ones(len(apart))], top_hz)
    power = 0.5 * np.mean(own.of(apart) ** 2, axis=1) / max(float(np.mean(both)), 1e-9)
    return own.frequency_hz, own.blurred(power, ENVELOPE_HZ, 0.0)


def _periods(command: Column) -> tuple[Column, int]:
    """Where whole periods of a command start, in rows, without those in which the rig settles, and how many rows of
    each are compared; none where it has no period."""
    nearest = period_rows(command)
    if nearest is None:
        return np.zeros(0), 0
    exact = _exact(command, nearest)
    count = int((len(command) + 0.5) // exact)
    first = SETTLING if count >= SETTLING + FEWEST else 0
    return exact * np.arange(first, count, dtype=np.float64), int(exact)


def _cut(columns: Column, starts: Column, rows: int) -> Column:
    """(p, rows, K) of columns (n, K) from each start on, which lies between rows: on straight lines a sine of twelve
    rows would be 3 % smaller there, and every other period another one."""
    return np.array([_from(columns, float(start), rows) for start in starts])


def _from(columns: Column, start: float, rows: int) -> Column:
    """(rows, K) of columns (n, K) from a start on."""
    whole = int(start)
    before = min(whole, BESIDE)
    near = np.ascontiguousarray(columns[whole - before : whole + rows + BESIDE].T)
    sooner = Lateness(whole - start)
    return np.column_stack([delayed(column, sooner, 1.0)[before : before + rows] for column in near])


def _exact(command: Column, rows: int) -> float:
    """A period in rows, which is no whole number: over twice as many periods each time, to as many as there are but
    one. (Of a fast sine one period more or less lies within what a whole row is worth over all of them.)"""
    exact, times = _returned(command, rows), 1
    while (further := min(2 * times, int(len(command) / exact) - 1)) > times:
        times = further
        exact = _returned(command, round(times * exact)) / times
    return exact


def _returned(command: Column, near: int) -> float:
    """After how many rows, by the vertex of a parabola, a command differs least from itself, within REACH of `near`."""
    lags = range(max(near - REACH, 1), min(near + REACH, len(command) - 2) + 1)
    off = [float(np.mean((command[lag:] - command[:-lag]) ** 2)) for lag in lags]
    best = int(np.argmin(off))
    return lags[best] + vertex_offset(np.array(off), best)
