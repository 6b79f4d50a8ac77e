"""A plant's joint that rings with a mass on it, weighed once for all who look at the answer."""

from functools import lru_cache

from hil.reference.cases import Purpose, bench_of, draw_sheet, realise
from rig.blind_check.source import records_of
from rig.gap.evidence.posterior import Posterior
from rig.gap.pipeline import Question, weigh
from rig.gap.reference.build import Kind


@lru_cache
def weighed() -> tuple[Posterior, ...]:
    """What competes beside its healthy days, the regulators first."""
    case = draw_sheet(Purpose.DEVELOPMENT, 994001, 60, "mckibben")[58]
    assert case.effects == ("inertia",)
    bench = bench_of(case)
    days = [records_of(day) for day in bench.baselines[: case.baselines]]
    return weigh(Question(None, records_of(realise(case, bench).records), days, Kind.SESSIONS))[2]
