"""What simulators usually lack is fitted on healthy rigs, and written with where it comes from."""

from hil.reference.names import NAMES
from rig.app.gap.levels import FittingPlan
from rig.app.gap.study import usual
from rig.app.gap.study.usual import STEPS, with_usual
from rig.gap.hypotheses.library import LIBRARY
from rig.gap.settings import fitted

PLAN = FittingPlan((NAMES[0],), 1, 302, workers=1)


def test_one_rig_is_asked_beside_its_own_simulator_and_anothers() -> None:
    told: list[int] = []
    levels, found = with_usual(fitted(), PLAN, told.append)
    assert told[-1] == STEPS
    assert set(found) == {"simulator", "sister"}
    for name, shares in found.items():
        assert levels.levels[name].usual == shares
        assert set({} if shares is None else shares.scales) <= set(LIBRARY)
        made = levels.provenance.of(f"levels.{name}.usual")
        assert made is not None
        assert made.seeds == [302]
        assert made.families == [NAMES[0]]
        assert f"{len(usual.DAYS)} healthy days" in made.fitted_on
    assert levels.levels["session"] == fitted().levels["session"]
