"""A plant's joint that rings with a mass on it, weighed once for all who look at the answer."""

from functools import lru_cache

from hil.reference.cases import Purpose, bench_of, draw_sheet, realise
from rig.blind_check.source import records_of
from rig.gap.evidence.posterior import Posterior
from rig.gap.pipeline import weigh
from rig.gap.question import Question
from rig.gap.reference.kinds import ReferenceKind

RIVALS = (
    *("inertia", "viscous_friction", "coulomb_friction", "stiffness", "creep", "sensor_gain", "sensor_lag"),
    *("delay", "valve_lag", "valve_gain", "valve_slew", "supply_droop", "leak"),
)


@lru_cache
def weighed() -> tuple[Posterior, ...]:
    """What competes beside three healthy days, the regulators first: effects of either that might stand for a mass."""
    case = draw_sheet(Purpose.DEVELOPMENT, 994001, 60, "mckibben")[58]
    assert case.effects == ("inertia",)
    bench = bench_of(case)
    days = [records_of(day) for day in bench.baselines[:3]]
    records = records_of(realise(case, bench).records)
    return weigh(Question(None, records, days, ReferenceKind.SESSIONS, library=RIVALS))[2]
