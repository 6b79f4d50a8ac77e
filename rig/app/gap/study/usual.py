"""What `pamrig gap study usual` does: what a simulator usually lacks of a healthy rig, its own or a sister, from
healthy days of development units of several plant families.

Beside a simulator alone, each effect of the library is asked how much of a healthy day it would explain.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from hil.reference.cases import Case
from rig.app.gap.levels import FittingPlan, days_of, first_cases, identified, next_of, origin, reported
from rig.errors import ModelError
from rig.gap.evidence.posterior import Posterior, judge
from rig.gap.hypotheses.inverse_problems import angle_problem, pressure_problem
from rig.gap.hypotheses.library import NONE, chosen
from rig.gap.pipeline import expected_given
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import SISTER, Kind, expect
from rig.gap.reference.own_days import pressure_days
from rig.gap.settings import Fitted, UsualShares
from rig.gap.usual import Shown, fit_usual
from rig.model.parameters import Model
from rig.parallel import executor

DAYS = (1, 4)
"""Healthy days after the first, on which the unit is identified."""
STEPS = 2
"""Rounds over the rigs: identified, their days."""


@dataclass(frozen=True)
class HealthyDay:
    """What each effect would explain of one healthy day beside a simulator."""

    family: str
    reference: str
    factors: tuple[Mapping[str, Shown], Mapping[str, Shown]]
    """Of the pressures and of the angle."""


def with_usual(
    levels: Fitted, plan: FittingPlan, report: Callable[[int], None] = lambda done: None
) -> tuple[Fitted, dict[str, UsualShares | None]]:
    """The levels with what simulators usually lack of these families' rigs, judged by the same levels; `report` is told
    how many of STEPS times the rigs are done."""
    sheets = [first_cases(name, plan) for name in plan.families]
    rigs = [case for sheet in sheets for case in sheet]
    with executor(None, plan.workers) as pool:
        models = list(reported(pool.map(identified, rigs), report, 0))
        asked = [(case, models[k], models[next_of(k, sheets)], levels) for k, case in enumerate(rigs)]
        days = [day for some in reported(pool.map(_of_rig, asked), report, len(rigs)) for day in some]
    found = {name: _fitted(days, name, levels) for name in (Kind.SIMULATOR.value, SISTER)}
    changed = {name: replace(levels.levels[name], usual=shares) for name, shares in found.items()}
    command = f"pamrig gap study usual --units {plan.units} --seed {plan.seed}"
    made = origin(command, [plan.seed], plan.families, f"{len(rigs)} rigs, {len(rigs) * len(DAYS)} healthy days")
    provenance = levels.provenance.renewed({f"levels.{name}.usual": made for name in found})
    return replace(levels, levels={**levels.levels, **changed}, provenance=provenance), found


def _fitted(days: Sequence[HealthyDay], reference: str, levels: Fitted) -> UsualShares | None:
    told = [day for day in days if day.reference == reference]
    families = dict.fromkeys(day.family for day in told)
    return fit_usual([[day.factors for day in told if day.family == name] for name in families], levels.prior)


def _of_rig(rig: tuple[Case, Model, Model, Fitted]) -> list[HealthyDay]:
    """The unit's days beside both simulators; one that runs away under them tells nothing."""
    case, own, sister, levels = rig
    bare = {name: replace(one, usual=None) for name, one in levels.levels.items()}
    return list(_shown(case, [(False, own), (True, sister)], replace(levels, levels=bare)))


def _shown(case: Case, simulators: Sequence[tuple[bool, Model]], settings: Fitted) -> Iterator[HealthyDay]:
    effects = [effect for effect in chosen(None) if not effect.signature]
    days = days_of(case)
    for number in DAYS:
        for is_sister, model in simulators:
            bare = replace(model, fingerprint=None)
            try:
                expected = expect(Kind.SIMULATOR, is_sister, bare, pair_up(days[number], [], model.p0_mpa))
            except ModelError:
                continue
            ahead = judge(effects, pressure_problem(expected, settings))
            read = expected_given(ahead, NONE, expected, pressure_days(expected.contexts), settings)
            behind = judge(effects, angle_problem(read, settings))
            yield HealthyDay(case.family, expected.levels, (_each(ahead), _each(behind)))


def _each(posterior: Posterior) -> dict[str, Shown]:
    bare = posterior.plain.factor.healthy.log_density(posterior.plain.factor.gap_lines)
    return {name: Shown(fit.log_evidence - bare, fit.share) for name, fit in posterior.fits.items()}
