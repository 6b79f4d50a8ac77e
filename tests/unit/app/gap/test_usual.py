"""What simulators usually lack is fitted on healthy rigs, and written with where it comes from."""

from hil.reference.names import NAMES
from rig.app.gap.calibrating import FittingPlan
from rig.app.gap.study import usual
from rig.app.gap.study.usual import with_usual
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.priors import fitted

PLAN = FittingPlan((NAMES[0],), 1, 302, workers=1)


def test_a_rig_is_asked_beside_its_own_simulator_for_both_kinds_of_it() -> None:
    told: list[int] = []
    levels, found = with_usual(fitted(), PLAN, told.append)
    assert told == [1]
    assert set({} if found is None else found.scales) <= set(LIBRARY)
    for name in usual.USUAL_BESIDE:
        assert levels.levels[name].usual == found
        made = levels.provenance.of(f"levels.{name}.usual")
        assert made is not None
        assert made.seeds == [302]
        assert made.families == [NAMES[0]]
        assert f"{len(usual.IDENTIFIED_DAYS)} healthy days" in made.fitted_on
    assert levels.levels["session"] == fitted().levels["session"]
