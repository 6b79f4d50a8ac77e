"""What `pamrig gap study usual` does: what a simulator's class usually lacks of a healthy rig, from healthy days of
development units of several plant families beside each unit's own simulator.

Each effect of the library is asked how much of such a day it would explain. Beside another rig's simulator days show as
well what rigs of a build differ by; that is the levels' matter, and the class lacks no more there.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import repeat

from hil.reference.cases import Case
from rig.app.gap.calibrating import FittingPlan, days_of, identified, origin, reported, rigs_of
from rig.errors import ModelError
from rig.gap.both_factors import expected_given
from rig.gap.evidence.posterior import Posterior, judge
from rig.gap.hypotheses.inverse_problems import angle_problem, pressure_problem
from rig.gap.hypotheses.library import NONE, chosen
from rig.gap.prior_fitting.usual_sizes import Factors, Shown, fit_usual
from rig.gap.priors import Fitted, UsualSizes
from rig.gap.records.pairs import pair_up
from rig.gap.reference.build import expect
from rig.gap.reference.expected import SISTER
from rig.gap.reference.kinds import ReferenceKind
from rig.gap.reference.own_days import pressure_days
from rig.model.parameters import Model
from rig.parallel import executor
from rig.record import Record

IDENTIFIED_DAYS = (1, 4)
"""Healthy days after the first, on which the unit is identified."""
USUAL_BESIDE = (ReferenceKind.SIMULATOR.value, SISTER)
"""Beside which it is usual."""


def with_usual(
    levels: Fitted, plan: FittingPlan, report: Callable[[int], None] = lambda done: None
) -> tuple[Fitted, UsualSizes | None]:
    """The levels with what simulators usually lack of these families' rigs, judged by the same levels; `report` is told
    how many rigs are done."""
    without = {name: replace(one, usual=None) for name, one in levels.levels.items()}
    bare = replace(levels, levels=without)
    rigs = rigs_of(plan)
    with executor(None, plan.workers) as pool:
        days = list(reported(pool.map(_of_rig, rigs, repeat(bare)), report, 0))
    healthy_days = [(rig.family, day) for rig, some in zip(rigs, days, strict=True) for day in some]
    found = fit_usual([[day for family, day in healthy_days if family == name] for name in plan.families], levels.prior)
    command = f"pamrig gap study usual --units {plan.units} --seed {plan.seed}"
    made = origin(command, [plan.seed], plan.families, f"{len(rigs)} rigs, {len(healthy_days)} healthy days")
    changed = {name: replace(levels.levels[name], usual=found) for name in USUAL_BESIDE}
    provenance = levels.provenance.renewed({f"levels.{name}.usual": made for name in USUAL_BESIDE})
    return replace(levels, levels={**levels.levels, **changed}, provenance=provenance), found


def _of_rig(case: Case, settings: Fitted) -> list[Factors]:
    """What each effect would explain of the unit's days, on the pressures and on the angle; a simulator that runs away
    under them tells nothing."""
    model, days, found = identified(case), days_of(case), []
    for number in IDENTIFIED_DAYS:
        try:
            found.append(_shown(replace(model, fingerprint=None), days[number], settings))
        except ModelError:
            continue
    return found


def _shown(model: Model, day: Sequence[Record], settings: Fitted) -> Factors:
    effects = [effect for effect in chosen(None) if not effect.signature]
    expected = expect(ReferenceKind.SIMULATOR, False, model, pair_up(day, [], model.p0_mpa))
    ahead = judge(effects, pressure_problem(expected, settings))
    read = expected_given(ahead, NONE, expected, pressure_days(expected.contexts), settings)
    return _each(ahead), _each(judge(effects, angle_problem(read, settings)))


def _each(posterior: Posterior) -> dict[str, Shown]:
    bare = posterior.plain.factor.healthy.log_density(posterior.plain.factor.gap_lines)
    return {name: Shown(fit.log_evidence - bare, fit.share, fit.floors) for name, fit in posterior.fits.items()}
