"""How far: the interval holds what as many further records show, as often as it says."""

import numpy as np
import pytest

from rig.gap.answer.held_out import LEVEL, widening


def test_fewer_records_widen_more() -> None:
    widths = [widening(count) for count in (2, 3, 7, 20, 1000)]
    assert widths == sorted(widths, reverse=True)
    assert widths[-1] == pytest.approx(np.sqrt(2.0), rel=0.01)


def test_one_record_says_nothing_of_the_spread() -> None:
    assert widening(1) == 1.0


@pytest.mark.parametrize("count", [4, 7, 15])
def test_the_interval_holds_what_further_records_show(count: int) -> None:
    """Records whose mean squares scatter by a third, resampled as the answer does."""
    random = np.random.default_rng(count)
    held, trials = 0, 400
    for _ in range(trials):
        seen, further = random.lognormal(0.0, 0.35, (2, count))
        drawn = np.sqrt(seen[random.integers(count, size=(200, count))].mean(axis=1))
        middle = np.sqrt(seen.mean())
        low, high = middle * (np.quantile(drawn, (0.5 - LEVEL / 2, 0.5 + LEVEL / 2)) / middle) ** widening(count)
        held += bool(low <= np.sqrt(further.mean()) <= high)
    assert held / trials == pytest.approx(LEVEL, abs=0.05)
