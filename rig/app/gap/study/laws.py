"""How rough the library's laws are: every effect of a plant put onto a healthy day of its own, by the plant's law and
without noise of its own, and what the library's best law leaves of it; and how rough the description of a rig is in
what the pressures that an effect changes do to the angle.

What `pamrig gap study laws` does; nothing is diagnosed, and no case of a check is looked at.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from statistics import median

import numpy as np

from hil.reference.cases import Case, DrawnKind, bench_of, realise
from rig.app.gap.calibrating import FittingPlan, origin, reported, rigs_of
from rig.blind_check.source import records_of
from rig.columns import rms
from rig.errors import RigError
from rig.gap.hypotheses.fit import Fit, fit_effect
from rig.gap.hypotheses.inverse_problems import (
    InverseProblem,
    acts_ahead,
    angle_problem,
    other_pressures,
    pressure_problem,
)
from rig.gap.hypotheses.library import LIBRARY, Effect
from rig.gap.priors import Fitted, fitted
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expectation import Factor
from rig.gap.reference.expected import Expected
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.response.propagate import as_late_as_measured
from rig.gap.settings import MOST_ROUGH
from rig.parallel import executor
from rig.record import Column, Record

RATIOS = (4.0, 2.5, 8.0)
"""Gap over what the rig's days differ by at which effects are put in, rig by rig in turn."""
NOT_A_COPY = 1e-9
"""By so much, relatively, the healthy records are off: those of an effect that does not show in them would be taken for
copies."""
PARALLEL = 1e-2
"""Patterns that differ by less than this share of the strongest count as one."""
LEAST_ROUGH = 0.01
"""No usual error is less: no law is exact on another rig."""
ALL = 1.0
"""Share that a law leaves which leaves all: one that fits nothing has a change of any size, and its share says no
more."""
ERROR_POINTS = 5
"""Points by which the distribution of laws' errors on another build is told. More: slower, its tail a little farther
out."""

MOSTLY = 0.5
"""Share of what is off in the angle (rms) that other pressures must change, but for their coming later, for an effect
to say how rough the description is in that. Less: effects that are late, or behind the monitors, count as well."""
REACHED = 0.5
"""Share of the size asked for that an effect of a unit must have at least, and one over it at most: a supply that
hardly sags however narrow its hose, or breaks down as soon as it does, says nothing of how a law fits one of that size.
Less: laws count as rougher than they are."""


@dataclass(frozen=True)
class LawError:
    """What the best law of an effect leaves on one rig."""

    family: str
    effect: str
    share: float
    """Of its own change, rms, beside what days differ in."""
    answer: float | None = None
    """By how many times the share by which the description of the rig misses the angles that it was made from it misses
    what the effect's pressures change in the angle (rms); None where it changes none."""


def with_laws(
    levels: Fitted,
    plan: FittingPlan,
    report: Callable[[int], None] = lambda done: None,
    effects: Sequence[str] = (),
) -> tuple[Fitted, dict[str, float]]:
    """The levels with how rough each effect's law usually is on these families' rigs, and how far another build may be
    off that; `report` is told how many rigs are done. `effects`: fit these and keep the others; all without."""
    rigs = rigs_of(plan)
    errors_of = partial(of_rig, effects=tuple(effects or LIBRARY))
    with executor(None, plan.workers) as pool:
        errors = [error for some in reported(pool.map(errors_of, range(len(rigs)), rigs), report, 0) for error in some]
    return with_errors(levels, plan, errors, effects)


def with_errors(
    levels: Fitted, plan: FittingPlan, errors: Sequence[LawError], effects: Sequence[str] = ()
) -> tuple[Fitted, dict[str, float]]:
    """The levels with what these errors, of the plan's rigs, say is usual; an effect of which none tells keeps its own,
    and so does what only all effects together say, where but some `effects` were asked."""
    found, before = usual_errors(errors), levels.prior
    answer = usual_answer(errors)
    prior = replace(
        before,
        laws={**before.laws, **found},
        law_shares=before.law_shares if effects else shares_of_usual(errors, before.law_shares),
        answer=answer or before.answer,
    )
    renewed = ["laws", *([] if effects else ["law_shares"]), *(["answer"] if answer else [])]
    command = " ".join(
        [f"pamrig gap study laws --units {plan.units} --seed {plan.seed}", *(f"--effect {name}" for name in effects)]
    )
    made = origin(command, [plan.seed], plan.families, f"{plan.units * len(plan.families)} rigs")
    untouched = [f"prior.laws.{name}" for name in before.laws if name not in found]
    provenance = levels.provenance.renewed({f"prior.{name}": made for name in renewed}, untouched)
    return replace(levels, prior=prior, provenance=provenance), found


def of_rig(number: int, case: Case, effects: Collection[str] = LIBRARY.keys()) -> list[LawError]:
    """The errors of these effects' laws on the unit of a case; `number` says which size and sign. Effects that the unit
    cannot have at that size, or that no law fits, are left out."""
    bench, settings, healthy = bench_of(case), fitted(), _healthy(case)
    p0_mpa = bench.excitations[0].p0_mpa
    ratio, sign = RATIOS[number % len(RATIOS)], 1 - 2 * (number % 2)
    found = []
    for name in bench.family.effects:
        if name not in effects or LIBRARY[name].signature:
            continue
        signed = sign if bench.family.laws[name].signed else 1
        asked = replace(case, kind=DrawnKind.SINGLE, effects=(name,), signs=(signed,), wanted_ratios=(ratio,))
        with suppress(RigError):
            made = realise(asked, bench)
            if not REACHED * ratio <= made.ratio_angle <= ratio / REACHED:
                continue
            pairing = pair_up(records_of(made.records), [healthy], p0_mpa)
            effect, expected = LIBRARY[name], expect(ReferenceKind.SESSION, False, None, pairing)
            angle = angle_problem(expected, settings)
            share = _left(effect, angle, expected, settings)
            if share is not None:
                found.append(LawError(case.family, name, share, _answer(effect, angle.forward.factor, expected)))
    return found


def usual_errors(found: Sequence[LawError]) -> dict[str, float]:
    """Effect -> root of the mean square over families of what is in the middle of each: another build may be as far
    from a law as any of them."""
    out = {}
    for effect in dict.fromkeys(one.effect for one in found):
        share = _usual((one.family, one.share) for one in found if one.effect == effect)
        out[effect] = min(max(share, LEAST_ROUGH), MOST_ROUGH)
    return out


def shares_of_usual(found: Sequence[LawError], usual: Sequence[float]) -> tuple[float, ...]:
    """How rough laws are on another build, over the usual errors of the other families: the points that share this
    distribution evenly; `usual` where there is but one family."""
    ratios = []
    for family in dict.fromkeys(one.family for one in found):
        others = usual_errors([one for one in found if one.family != family])
        ratios += [one.share / others[one.effect] for one in found if one.family == family and one.effect in others]
    if not ratios:
        return tuple(usual)
    middles = (np.arange(ERROR_POINTS) + 0.5) / ERROR_POINTS
    return tuple(float(ratio) for ratio in np.quantile(ratios, middles))


def usual_answer(found: Sequence[LawError]) -> float | None:
    """Root of the mean square over families of what is in the middle of each; None where none tells."""
    errors = [(one.family, one.answer) for one in found if one.answer is not None]
    return _usual(errors) if errors else None


def _usual(errors: Iterable[tuple[str, float]]) -> float:
    """Root of the mean square over families of what is in the middle of each, of numbers with their family."""
    by: dict[str, list[float]] = {}
    for family, number in errors:
        by.setdefault(family, []).append(number)
    return float(np.sqrt(np.mean(np.square([median(some) for some in by.values()]))))


def _healthy(case: Case) -> list[Record]:
    """The records of the case's day, with the same noise, and nothing wrong."""
    nothing = replace(case, kind=DrawnKind.NONE, effects=(), signs=(), wanted_ratios=())
    return [_nudged(record) for record in records_of(realise(nothing, bench_of(case)).records)]


def _nudged(record: Record) -> Record:
    """The record, and no copy of it."""
    first, second, angle = (
        None if column is None else (1.0 + NOT_A_COPY) * column
        for column in (record.p1_mpa, record.p2_mpa, record.angle_deg)
    )
    return replace(record, p1_mpa=first, p2_mpa=second, angle_deg=angle)


def _left(effect: Effect, angle: InverseProblem, expected: Expected, settings: Fitted) -> float | None:
    """What the effect's best law leaves on the factor of which it explains more; None where no law fits.

    A leak that makes a regulator hunt a little is heard by the monitors and told by the angle."""
    problems = [angle]
    if expected.driven:
        problems.append(pressure_problem(expected, settings))
    found = []
    for problem in problems:
        if any(problem.shows(law) for law in effect.laws):
            fit = fit_effect(effect, problem.forward, problem.shows, problem.screening)
            found += [] if fit is None else [_explained_and_left(problem, fit)]
    return min(max(found)[1], ALL) if found else None


def _answer(effect: Effect, angle: Factor, expected: Expected) -> float | None:
    """What `LawError.answer` says, of an effect ahead of the monitors; `angle`: what is expected of it."""
    if not expected.driven or not any(map(acts_ahead, effect.laws)):
        return None
    moved_deg, missed = other_pressures(expected, [as_late_as_measured(context) for context in expected.contexts])
    changed = angle.lines.of(moved_deg)
    whole = [context.pair.case.angle_deg - context.reference.angle_deg for context in expected.contexts]
    if rms(changed) < MOSTLY * rms(angle.lines.of(np.concatenate(whole))):
        return None
    left = beside(angle.gap_lines, angle.healthy.patterns[:, : angle.healthy.between_days])
    return rms(left) / max(missed * rms(changed), 1e-12)


def _explained_and_left(problem: InverseProblem, fit: Fit) -> tuple[float, float]:
    """By how much a fit makes chi square less, and the rms of what it leaves, beside what days differ in, over that of
    what it changes."""
    factor = problem.forward.factor
    change = factor.lines.of(fit.change)
    of_gap, of_left = (factor.healthy.chi_square(lines) for lines in (factor.gap_lines, factor.gap_lines - change))
    left = beside(factor.gap_lines - change, factor.healthy.patterns[:, : factor.healthy.between_days])
    return of_gap - of_left, rms(left) / max(rms(change), 1e-12)


def beside(column: Column, patterns: Column) -> Column:
    """What of a column (l,) lies along none of the patterns (l, m), whatever their sizes."""
    sizes = np.linalg.norm(patterns, axis=0)
    shown = sizes > 0.0
    directions, strengths, _ = np.linalg.svd(patterns[:, shown] / sizes[shown], full_matrices=False)
    kept = directions[:, strengths > PARALLEL * strengths[0]]
    out: Column = column - kept @ (kept.T @ column)
    return out
