"""What experiments say moves between the effects, and leaves whether there is one."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.gap.evidence.posterior import parted

NATS = st.floats(-30.0, 30.0)
LOGS = st.fixed_dictionaries({"none": NATS, "unknown": NATS, "delay": NATS, "valve_lag": NATS, "leak": NATS})
SAID = st.dictionaries(st.sampled_from(["delay", "valve_lag"]), NATS)


def chances(logs: dict[str, float]) -> dict[str, float]:
    total = np.logaddexp.reduce(list(logs.values()))
    return {name: float(np.exp(value - total)) for name, value in logs.items()}


@given(LOGS, SAID)
def test_none_unknown_and_what_they_say_nothing_of_stay_as_likely(
    logs: dict[str, float], said: dict[str, float]
) -> None:
    before, after = chances(logs), chances(parted(logs, said))
    for name in ("none", "unknown", "leak"):
        assert after[name] == pytest.approx(before[name], rel=1e-6, abs=1e-12)


@given(LOGS, NATS, NATS)
def test_the_effects_take_from_each_other_what_was_said(logs: dict[str, float], one: float, other: float) -> None:
    after = parted(logs, {"delay": one, "valve_lag": other})
    moved = (after["delay"] - after["valve_lag"]) - (logs["delay"] - logs["valve_lag"])
    assert moved == pytest.approx(one - other, abs=1e-9)


def test_without_experiments_nothing_moves() -> None:
    assert parted({"none": 1.0, "delay": 2.0}, {}) == {"none": 1.0, "delay": 2.0}
