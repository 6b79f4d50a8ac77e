"""What is expected of a rig without a gap, and how surely, as the two factors of the likelihood.

The pressures under the commands, and the angle under the pressures. What is unsure of each is a set of patterns with
their usual sizes, and a residual with a spectrum. Where the expected columns come from is in
`rig.gap.reference.build`; no effect is known here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.columns import rms
from rig.gap.likelihood.gaussian import Gaussian
from rig.gap.likelihood.lines import Lines, lines_of
from rig.gap.priors import BuildSpread, FactorLevels, Prior
from rig.gap.records.pairs import Pair
from rig.gap.reference.patterns import ANGLE_PATTERNS, BANK, REGULATOR_PATTERNS, VALVE_PATTERNS, VISCOUS
from rig.gap.response.propagate import RecordContext
from rig.gap.settings import (
    ENVELOPE_EVEN,
    ENVELOPE_HZ,
    FRICTION_DOUBT,
    LEAST_EFFECTIVE,
    MEAN_DOUBT,
    MISSED_STEPS,
    MOST_MISSED,
    SESSION_S,
    TOP_HZ,
    UNEVEN_CODES,
    UNKNOWN_EVEN,
    VOLUME_DOUBT,
)
from rig.model.compiled.response import RESPONSE_TERMS, regulated, response_terms
from rig.model.effect_stages.valve import ATMOSPHERE_MPA
from rig.model.equations.drive import LEAST_SHARE
from rig.model.response.model import ResponseModel, regulator_terms
from rig.record import Column

REGULATOR_STEP = 0.1
"""Relative change of a time constant by which the patterns of both regulators are taken."""
VISCOUS_STEP_S = 1e-3
"""Viscous friction over stiffness by whose change the pattern is taken."""
LOOP_STEP = 0.02
"""Share of the joint's friction by whose change the pattern is taken; a smaller one is lost in the
balance's own precision."""
CODE_PARTS = (0.0, 0.25, 0.5, 0.75)
"""Where the codes of a converter may lie, in steps."""


@dataclass(frozen=True)
class Factor:
    """One factor of the likelihood: its residual without any cause, and how residuals are judged."""

    lines: Lines
    gap: Column
    """(n,) measured minus expected."""
    healthy: Gaussian
    floor: float
    """Rms that a gap has when there is none, in the columns' unit."""

    @cached_property
    def gap_lines(self) -> Column:
        """(l,) lines of the gap: every law is judged by what it leaves of them."""
        return self.lines.of(self.gap)

    def rms(self, column: Column) -> float:
        """Root mean square of (n,) over the rows that were measured."""
        return rms(column, self.lines.used)

    def rms_of_lines(self, lines: Column) -> float:
        """Root mean square, over the rows that were measured, of a column that has these lines (l,)."""
        return float(np.sqrt(np.sum(lines**2) / max(float(self.lines.used.sum()), 1.0)))

    def doubting(self, patterns: Column) -> "Factor":
        """The same with further patterns (n, m) that may be there without being a gap, at one standard deviation."""
        return replace(self, healthy=self.healthy.with_patterns(self.lines.of(patterns)))

    def less_sure(self, times: Column, noise: Column) -> "Factor":
        """The same where each line (l,) is known so many `times` less surely, and its patterns as well; the variance
        that is `noise` (l,) stays."""
        known = self.healthy
        variance = known.variance + np.maximum(known.variance - noise, 0.0) * (times**2 - 1.0)
        return replace(self, healthy=replace(known, variance=variance, patterns=known.patterns * times[:, None]))

    def noisier(self, mean_square: float) -> "Factor":
        """The same with so much more power, on all lines alike."""
        more = mean_square * float(self.lines.used.sum()) / len(self.healthy.variance)
        healthy = self.healthy.with_variance(np.full_like(self.healthy.variance, more))
        return replace(self, healthy=healthy, floor=float(np.hypot(self.floor, np.sqrt(mean_square))))

    def rounded_to(self, step: float, column: Column) -> "Factor":
        """The same where a converter rounds a column (n,) to a step: by the spectrum of what that leaves, wherever the
        codes lie. It comes with the motion, and stays where a joint moves within one step."""
        off = [step * (np.round(column / step + part) - part) - column for part in CODE_PARTS]
        power = np.mean([self.lines.envelope(self.lines.of(one), ENVELOPE_HZ, ENVELOPE_EVEN) for one in off], axis=0)
        healthy = self.healthy.with_variance(UNEVEN_CODES * power)
        mean_square = UNEVEN_CODES * float(np.mean([self.rms(one) ** 2 for one in off]))
        return replace(self, healthy=healthy, floor=float(np.hypot(self.floor, np.sqrt(mean_square))))

    def at_least(self, rms: float) -> "Factor":
        """The same for a reference that misses the records it was fitted to by `rms`: it misses these by no less.

        The variance is scaled up to that, so that it stays in the lines in which the reference answers. (Spread evenly
        over all lines, the same mean square would hide what lies between the lines of the excitation, and leave those
        as sure as before.) That level is this rig's own, so it adds LEAST_EFFECTIVE degrees of freedom to the usual
        ones.
        """
        variance = self.healthy.variance
        scale = rms**2 * float(self.lines.used.sum()) / float(variance.sum())
        if scale <= 1.0:
            return self
        degrees = self.healthy.degrees + LEAST_EFFECTIVE
        healthy = replace(self.healthy, variance=scale * variance, degrees=degrees)
        return replace(self, healthy=healthy, floor=max(self.floor, rms))

    def of_its_class(self, settled: "Factor", spread: BuildSpread) -> "Factor":
        """The same for a simulator whose class may miss this build by more than is usual.

        No simulator's class holds a rig exactly, and by how much it misses one, and at which frequencies, differs from
        build to build. So a second variance competes with the usual one (`Gaussian.as_well`): the residual's own
        spectrum, blurred as that of something unknown is, at the likeliest level if there is no gap. Nothing and
        something unknown then differ by size alone. `settled`: the factor with which that level is sought.
        """
        healthy, gap = settled.healthy, settled.gap_lines
        shape = self.lines.envelope(gap, ENVELOPE_HZ, UNKNOWN_EVEN)
        usual = float(np.sum(healthy.variance)) / max(float(np.sum(shape)), 1e-300) * shape
        times = np.exp(np.linspace(0.0, MOST_MISSED, MISSED_STEPS))
        log_chances = spread.log_chance(np.log(times))
        wider = [healthy.with_variance((more**2 - 1.0) * usual).log_density(gap) for more in times]
        best = int(np.argmax(wider + log_chances))
        if best == 0:
            return self
        more = (times[best] ** 2 - 1.0) * usual
        return replace(self, healthy=replace(self.healthy, as_well=more, log_chance=float(log_chances[best])))

    def of_any_build(self, spread: BuildSpread | None) -> "Factor":
        """The same for a rig of a build on which the levels were not fitted: their patterns are known with as many
        degrees of freedom as there were builds."""
        return self if spread is None else replace(self, healthy=replace(self.healthy, pattern_degrees=spread.degrees))

    def standing_off(self, rms: float) -> "Factor":
        """The same where each record may be offset as a whole, by `rms`. That is so of records that each took their own
        zero; and of a reference that misses the records it was fitted to by so much, for where a joint with hysteresis
        rests depends on what came before, and is the first thing that a model of it gets wrong."""
        if rms == 0.0:
            return self
        off = self.lines.of(np.full(sum(self.lines.rows), rms))[:, None]
        patterns = off * (self.lines.record[:, None] == np.arange(len(self.lines.rows)))
        return replace(self, healthy=self.healthy.with_patterns(patterns))


@dataclass(frozen=True)
class Parts:
    """A factor before its levels are known."""

    lines: Lines
    gap: Column
    columns: Column
    """(l, m) patterns in lines, for a size of 1."""
    names: tuple[str, ...]
    """(m,) what each is; several may share a name, and with it their size."""
    envelope: Column
    """(l,) power of the response, blurred."""
    span: float
    """How far the columns move."""
    noise: Column
    """(l,) variance of the sensor's own noise."""

    def rms(self, column: Column) -> float:
        """Root mean square of (n,) over the rows that were measured."""
        return rms(column, self.lines.used)

    def without(self, name: str) -> "Parts":
        """The same where nothing of this name is unsure."""
        kept = [one != name for one in self.names]
        return replace(self, columns=self.columns[:, kept], names=tuple(one for one in self.names if one != name))

    def factor(self, levels: FactorLevels, prior: Prior) -> Factor:
        """The factor at these levels."""
        spread = np.array([levels.patterns[name] for name in self.names])
        variance = levels.share**2 * self.envelope + (levels.even * self.span) ** 2 + self.noise
        return Factor(
            self.lines,
            self.gap,
            Gaussian(variance, self.columns * spread, self._effective(prior), prior.degrees, len(self.names)),
            levels.floor * self.span,
        )

    def _effective(self, prior: Prior) -> float:
        """How many independent lines these records have: fewer than a whole session's where they are shorter."""
        channels = 2 if self.names[: len(VALVE_PATTERNS)] == VALVE_PATTERNS else 1
        seconds = sum(rows * dt for rows, dt in zip(self.lines.rows, self.lines.dt_s, strict=True)) / channels
        return max(prior.effective * min(1.0, seconds / SESSION_S), LEAST_EFFECTIVE)


def pressure_parts(contexts: Sequence[RecordContext], p0_mpa: float, response: ResponseModel) -> Parts:
    """Both monitors against what the reference's regulators give under the commands; valve 1 of every record, then
    valve 2."""
    pairs = [context.pair for context in contexts]
    rows, dt_s, used = [len(p) for p in pairs], [p.dt_s for p in pairs], [p.used for p in pairs]
    lines, of_a_valve = lines_of(rows * 2, dt_s * 2, used * 2, TOP_HZ), lines_of(rows, dt_s, used, TOP_HZ)
    expected = [context.reference.p1_mpa for context in contexts] + [context.reference.p2_mpa for context in contexts]
    monitors = [pair.case.p1_mpa for pair in pairs] + [pair.case.p2_mpa for pair in pairs]
    measured = [column for column in monitors if column is not None]
    blocks = [
        regulator_terms(column, p0_mpa, pair.dt_s)[:, : len(VALVE_PATTERNS)]
        for column, pair in zip(expected, pairs * 2, strict=True)
    ]
    first, second = (of_a_valve.of(np.concatenate(own)) for own in (blocks[: len(pairs)], blocks[len(pairs) :]))
    zero = np.zeros_like(first)
    alike = np.concatenate([regulator_patterns(context, response, valve) for valve in (0, 1) for context in contexts])
    columns = np.hstack([np.vstack([first, zero]), np.vstack([zero, second]), lines.of(alike)])
    noise = [line_noise(pair.raw.p1_mpa, pair) for pair in pairs] + [
        line_noise(pair.raw.p2_mpa, pair) for pair in pairs
    ]
    moving = lines.of(np.concatenate([column - p0_mpa for column in expected]))
    return Parts(
        lines,
        np.concatenate(measured) - np.concatenate(expected),
        columns,
        VALVE_PATTERNS * 2 + REGULATOR_PATTERNS,
        lines.envelope(moving, ENVELOPE_HZ, ENVELOPE_EVEN),
        max(float(np.ptp(np.concatenate(expected))), 1e-4),
        np.square(noise)[lines.record],
    )


def regulator_patterns(context: RecordContext, response: ResponseModel, valve: int) -> Column:
    """(n, 2) of one valve in the order of REGULATOR_PATTERNS."""
    pair, (dead_s, fill_s, exhaust_s) = context.pair, response.regulators[valve]
    u = pair.u1_mpa if valve == 0 else pair.u2_mpa
    more, less = 1.0 + REGULATOR_STEP, 1.0 - REGULATOR_STEP
    here = regulated(u, dead_s, fill_s, exhaust_s, pair.dt_s)
    slower = regulated(u, dead_s, more * fill_s, more * exhaust_s, pair.dt_s)
    uneven = regulated(u, dead_s, less * fill_s, more * exhaust_s, pair.dt_s)
    return np.column_stack([slower - here, uneven - here]) / REGULATOR_STEP


def angle_parts(
    contexts: Sequence[RecordContext], base: Sequence[Column], response: ResponseModel, driven: bool
) -> Parts:
    """The angle against what is expected under its drive: the measured pressures when `driven`, else the
    reference's."""
    pairs = [context.pair for context in contexts]
    lines = lines_of([len(p) for p in pairs], [p.dt_s for p in pairs], [p.used for p in pairs], TOP_HZ)
    together = np.concatenate(list(base))
    span = max(float(np.ptp(together)), 1e-3)
    drives = [driving(context, driven) for context in contexts]
    named = [
        _angle_patterns(context.pair, angle - response.zero_deg, drive, response, span)
        for context, angle, drive in zip(contexts, base, drives, strict=True)
    ]
    terms = [_bank(*drive, response, context.pair.dt_s) for context, drive in zip(contexts, drives, strict=True)]
    bank = lines.of(np.concatenate(terms))
    size = np.sqrt(np.sum(bank**2, axis=0) / max(float(lines.used.sum()), 1.0))
    columns = _each_by_itself(np.hstack([lines.of(np.concatenate(named)), bank * (span / np.maximum(size, 1e-9))]))
    noise = [line_noise(pair.raw.angle_deg, pair) for pair in pairs]
    return Parts(
        lines,
        np.concatenate([pair.case.angle_deg for pair in pairs]) - together,
        columns,
        (*ANGLE_PATTERNS, *[BANK] * bank.shape[1]),
        lines.envelope(lines.of(together - response.zero_deg), ENVELOPE_HZ, ENVELOPE_EVEN),
        span,
        np.square(noise)[lines.record],
    )


def _each_by_itself(columns: Column) -> Column:
    """(l, m) patterns of the angle, each without what those before it do: a wider loop at the same gain, of viscous
    friction what is neither that nor a lag, and of the response model's terms what is neither gain nor loop. Each holds
    some of the others else, and levels that all but undo each other grow without end (docs/decisions/0596)."""
    gain, lag, loop, viscous = (ANGLE_PATTERNS.index(name) for name in ("gain", "lag_s", "loop", VISCOUS))
    bank = range(len(ANGLE_PATTERNS), columns.shape[1])
    found = columns.copy()
    for some, before in (([loop], [gain]), ([viscous], [gain, lag, loop]), (bank, [gain, loop])):
        known = np.linalg.qr(found[:, before])[0]
        found[:, some] -= known @ (known.T @ found[:, some])
    return found


def mean_doubt(contexts: Sequence[RecordContext], base: Sequence[Column], response: ResponseModel) -> Column:
    """(n, 4) what one standard deviation of the law of the mean pressure is worth in the angle, where the measured mean
    is not the expected one: of what the difference counts for, evenly, towards one end and towards both, and of what
    the joint's friction does."""
    parts, ends_deg = [], max(float(np.max(np.abs(np.concatenate(list(base)) - response.zero_deg))), 1e-3)
    for context, expected in zip(contexts, base, strict=True):
        (p1, p2), reference, angle = driving(context, True), context.reference, expected - response.zero_deg
        least = LEAST_SHARE * response.p0_mpa
        ratio = np.maximum(p1 + p2, least) / np.maximum(reference.p1_mpa + reference.p2_mpa, least)
        rubbed = response.balanced(angle, np.zeros_like(angle), ratio**FRICTION_DOUBT, context.pair.dt_s) - angle
        otherwise, out = MEAN_DOUBT * angle * np.log(ratio), angle / ends_deg
        parts.append(np.column_stack([otherwise, otherwise * out, otherwise * out**2, rubbed]))
    return np.concatenate(parts)


def motion_doubt(contexts: Sequence[RecordContext], base: Sequence[Column], response: ResponseModel) -> Column:
    """(2 n, 2) what a joint that moves otherwise than under these pressures (`base`, deg, of each record) does to both
    monitors, valve 1 of every record and then valve 2: one muscle's air is pressed and the other's drawn, and a
    regulator makes up for it, at once or as late as it follows its set-point (of the air that a reference rig pushes
    back, the latter alone leaves 40 %, both 20)."""
    span = max(float(np.ptp(np.concatenate([context.reference.angle_deg for context in contexts]))), 1e-3)
    parts = []
    for valve, sign in enumerate((1.0, -1.0)):
        takes_s = max(response.regulators[valve][1:])
        for context, angle in zip(contexts, base, strict=True):
            expected = context.reference.p1_mpa if valve == 0 else context.reference.p2_mpa
            otherwise = np.gradient(context.pair.case.angle_deg - angle, context.pair.dt_s) / span
            late = regulated(otherwise, 0.0, takes_s, takes_s, context.pair.dt_s)
            pushed = sign * VOLUME_DOUBT * takes_s * (expected + ATMOSPHERE_MPA)
            parts.append(np.column_stack([pushed * otherwise, pushed * late]))
    return np.concatenate(parts)


def driving(context: RecordContext, driven: bool) -> tuple[Column, Column]:
    """Both pressures (n,), MPa, that move the joint: the measured ones when `driven`, else the reference's."""
    case = context.pair.case
    if driven and case.p1_mpa is not None and case.p2_mpa is not None:
        return case.p1_mpa, case.p2_mpa
    return context.reference.p1_mpa, context.reference.p2_mpa


def _angle_patterns(
    pair: Pair, angle: Column, drive: tuple[Column, Column], response: ResponseModel, span: float
) -> Column:
    """(n, 12) in the order of ANGLE_PATTERNS; `angle` from where its sensor has its zero."""
    dt, p0, (p1, p2) = pair.dt_s, response.p0_mpa, drive
    here = response.angle(p1, p2, dt)
    step, share = 0.005 * p0, 0.01
    through = [
        (response.angle(p1 + step, p2, dt) - here) / step,
        (response.angle(p1, p2 + step, dt) - here) / step,
        (response.angle(p1 + share * (p1 - p0), p2, dt) - here) / share,
        (response.angle(p1, p2 + share * (p2 - p0), dt) - here) / share,
    ]
    mean = np.maximum(p1 + p2, LEAST_SHARE * p0) / (2.0 * p0)
    elapsed = (pair.t_s - pair.t_s.mean()) / max(float(np.ptp(pair.t_s)), 1e-9)
    massless = replace(response, balance=replace(response.balance, inertia_s=0.0))
    more = np.full_like(angle, 1.0 + LOOP_STEP)
    loop = (massless.balanced(angle, np.zeros_like(angle), more, dt) - angle) / LOOP_STEP
    slower = -VISCOUS_STEP_S * np.gradient(angle, dt)
    viscous = (massless.balanced(angle, slower, np.ones_like(angle), dt) - angle) / VISCOUS_STEP_S
    return np.column_stack(
        [
            np.full_like(angle, span),
            angle,
            -np.gradient(angle, dt),
            loop,
            viscous,
            *through,
            angle * np.log(mean),
            span * elapsed,
            angle * elapsed,
        ]
    )


def _bank(p1: Column, p2: Column, response: ResponseModel, dt_s: float) -> Column:
    """(n, 13) the response model's terms beside the drive itself: its powers, what low-passes and plays leave of it."""
    terms = np.empty((len(p1), RESPONSE_TERMS))
    response_terms(np.ascontiguousarray(p1), np.ascontiguousarray(p2), response.p0_mpa, response.exponent, dt_s, terms)
    drive, slow = terms[:, [1]], terms[:, [5]]
    return np.hstack([terms[:, 2:4], terms[:, 4:10] - drive, terms[:, 12:] - slow])


def line_noise(column: Column | None, pair: Pair) -> float:
    """Standard deviation that the own white noise of a column (n,) has on every line of the pair's grid; by medians of
    third differences.

    Not `rig.columns.white_noise`, which counts rows that stand still: here they are left out while most rows move, and
    the shipped priors were fitted to lines with this noise in them. One estimator for both needs them fitted anew.
    """
    known = np.zeros(0) if column is None else column[np.isfinite(column)]
    third = np.diff(known, 3)
    moved = third[third != 0.0]
    if len(moved) < len(third) // 4:  # a coarse converter stands still more often than it moves
        moved = third
    white = float(np.median(np.abs(moved))) / (0.6745 * np.sqrt(20.0)) if len(moved) else 0.0
    return white * float(np.sqrt(min(pair.raw.period_s / pair.dt_s, 1.0)))
