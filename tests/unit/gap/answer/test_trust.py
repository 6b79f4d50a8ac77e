"""A name is believed half where a clipped sensor, or another commanded P0, may have done the same."""

import pytest

from rig.gap.answer.tell import trust
from rig.gap.records.pairs import Pairing
from rig.gap.settings import EITHER_CHANCE


@pytest.mark.parametrize(
    ("clipped", "elsewhere", "name", "left"),
    [
        ((), (), "co_contraction", 1.0),
        (("clipped?",), (), "sensor_nonlinearity", EITHER_CHANCE),
        ((), ("P0",), "co_contraction", EITHER_CHANCE),
        ((), ("P0",), "delay", 1.0),
        (("clipped?",), ("P0",), "none", 1.0),
    ],
)
def test_what_is_left_of_a_names_probability(
    clipped: tuple[str, ...], elsewhere: tuple[str, ...], name: str, left: float
) -> None:
    pairing = Pairing([], True, 0, 0.2, clipped=clipped, elsewhere=elsewhere)
    assert trust(pairing, name) == left
