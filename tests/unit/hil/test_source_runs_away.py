"""Records that a check asks for: one under which the joint leaves its range is missing, the others are there."""

from typing import Any

import numpy as np
import pytest

from hil.reference.source import played
from rig.errors import RigError

COMMANDS = {name: (np.full(5, level), np.full(5, 0.2), 0.005) for name, level in (("small", 0.25), ("large", 0.45))}


class Guarded:
    """A rig whose joint leaves its range from a pressure on."""

    def __init__(self, most_mpa: float) -> None:
        self._most_mpa = most_mpa

    def simulate(self, p1: Any, _p2: Any, _period_s: float, _day: Any, _wrong: Any, noise_seed: int) -> dict[str, Any]:
        if p1.max() > self._most_mpa:
            raise RigError(f"the joint runs away above {self._most_mpa} MPa")
        return {"seed": noise_seed}


def under_commands(most_mpa: float) -> Any:
    rig: Any = Guarded(most_mpa)
    return played(rig, None, None, COMMANDS, 7)  # type: ignore[arg-type]


def test_what_the_rig_can_do_is_recorded() -> None:
    assert under_commands(0.5) == {"small": {"seed": 7}, "large": {"seed": 8}}
    assert under_commands(0.3) == {"small": {"seed": 7}}


def test_where_nothing_can_be_done_it_says_why() -> None:
    with pytest.raises(RigError, match="runs away"):
        under_commands(0.2)
