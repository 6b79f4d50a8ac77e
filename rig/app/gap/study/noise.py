"""What `pamrig gap study noise` does: the broadband noise of the angle that healthy rigs usually have, from one healthy
day of development units of several plant families."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from hil.reference.cases import Case
from rig.app.gap.levels import FittingPlan, days_of, first_cases, origin, reported
from rig.gap.calibrate import wider_for_another
from rig.gap.raw_tests.levels import angles_of
from rig.gap.raw_tests.noise import noise_beside_the_motion
from rig.gap.settings import Fitted, UsualNoise
from rig.parallel import executor
from rig.record import Record


def with_noise(
    levels: Fitted, plan: FittingPlan, report: Callable[[int], None] = lambda done: None
) -> tuple[Fitted, UsualNoise]:
    """The levels with the noise of these families' rigs; `report` is told how many rigs are done."""
    sheets = [first_cases(name, plan) for name in plan.families]
    rigs = [case for sheet in sheets for case in sheet]
    with executor(None, plan.workers) as pool:
        shares = list(reported(pool.map(_of_rig, rigs), report, 0))
    of_each = [
        [share for case, share in zip(rigs, shares, strict=True) if case.family == name] for name in plan.families
    ]
    found = fit_noise(of_each)
    command = f"pamrig gap study noise --units {plan.units} --seed {plan.seed}"
    made = origin(command, [plan.seed], plan.families, f"{len(rigs)} rigs, a healthy day each")
    return replace(levels, noise=found, provenance=levels.provenance.renewed({"noise": made})), found


def fit_noise(families: Sequence[Sequence[float]]) -> UsualNoise:
    """From the shares of each family's units: a family is one draw of what builds differ by, and what its units differ
    by comes on top; for a build that is not among them."""
    logs = [np.log(np.asarray(shares)) for shares in families]
    middles = np.array([np.mean(some) for some in logs])
    within = float(np.mean([np.var(some) for some in logs]))
    spread = float(np.hypot(np.std(middles), np.sqrt(within)))
    return UsualNoise(float(np.exp(np.mean(middles))), wider_for_another(len(families)) * spread)


def _of_rig(case: Case) -> float:
    return noise_share(days_of(case)[0])


def noise_share(day: Sequence[Record]) -> float:
    """The white noise of the angle of some records, as a share of its span."""
    angles = angles_of(day)
    span_deg = max(float(np.nanmax(angle)) for angle in angles) - min(float(np.nanmin(angle)) for angle in angles)
    return noise_beside_the_motion(day, angles, without_repeats=False) / span_deg
