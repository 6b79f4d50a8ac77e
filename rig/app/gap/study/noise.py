"""What `pamrig gap study noise` does: the broadband noise of the angle that healthy rigs usually have, from one healthy
day of development units of several plant families."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.reference.cases import Case
from rig.app.gap.calibrating import FittingPlan, days_of, origin, reported, rigs_of
from rig.gap.prior_fitting.levels import wider_for_another
from rig.gap.priors import Fitted, UsualNoise
from rig.gap.raw_tests.noise import noise_beside_the_motion
from rig.gap.raw_tests.noise_levels import angles_of, span
from rig.parallel import executor
from rig.record import Record


@dataclass(frozen=True)
class HeardNoise:
    """White noise of an angle, one standard deviation, and its span."""

    noise_deg: float
    span_deg: float


def with_noise(
    levels: Fitted, plan: FittingPlan, report: Callable[[int], None] = lambda done: None
) -> tuple[Fitted, UsualNoise]:
    """The levels with the noise of these families' rigs; `report` is told how many rigs are done."""
    rigs = rigs_of(plan)
    with executor(None, plan.workers) as pool:
        noises = list(reported(pool.map(_of_rig, rigs), report, 0))
    found = fit_noise(
        [[one for case, one in zip(rigs, noises, strict=True) if case.family == name] for name in plan.families]
    )
    command = f"pamrig gap study noise --units {plan.units} --seed {plan.seed}"
    made = origin(command, [plan.seed], plan.families, f"{len(rigs)} rigs, a healthy day each")
    return replace(levels, noise=found, provenance=levels.provenance.renewed({"noise": made})), found


def fit_noise(families: Sequence[Sequence[HeardNoise]]) -> UsualNoise:
    """From the units of each family: a family is one draw of what builds differ by, and what its units differ by comes
    on top; for a build that is not among them."""
    logs = [np.log([one.noise_deg / one.span_deg for one in units]) for units in families]
    span_deg = float(np.exp(np.mean([np.mean(np.log([one.span_deg for one in units])) for units in families])))
    middles = np.array([np.mean(some) for some in logs])
    within = float(np.mean([np.var(some) for some in logs]))
    spread = float(np.hypot(np.std(middles), np.sqrt(within)))
    return UsualNoise(float(np.exp(np.mean(middles))), span_deg, wider_for_another(len(families)) * spread)


def _of_rig(case: Case) -> HeardNoise:
    return heard_noise(days_of(case)[0])


def heard_noise(day: Sequence[Record]) -> HeardNoise:
    """Of some records of one rig."""
    angles = angles_of(day)
    return HeardNoise(noise_beside_the_motion(day, angles, without_repeats=False), span(angles))
