"""Where no two effects look alike it is said how many would be seen at all: of the others nothing is known."""

import numpy as np
import pytest

from rig.app.gap.planning import none_alike
from rig.gap.plan.capability import Capability


@pytest.mark.parametrize(
    ("seen", "said"),
    [
        ((9.0, 9.0, 9.0), "all are told apart at usual sizes"),
        ((9.0, 1.0, 9.0), "2 of 3 would be seen at usual sizes, and these are told apart"),
        ((1.0, 1.0, 1.0), "at usual sizes hardly any would be seen: nothing is said of which are told apart"),
    ],
)
def test_that_all_are_told_apart_is_said_of_those_that_would_be_seen(seen: tuple[float, ...], said: str) -> None:
    assert none_alike(Capability((), (), ("delay", "creep", "backlash"), np.diag(seen), 5.0)) == said
