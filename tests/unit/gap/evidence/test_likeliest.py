"""What is believed of one factor: none, or the likeliest of what is something."""

import pytest

from rig.gap.evidence.posterior import likeliest


@pytest.mark.parametrize(
    ("probability", "name"),
    [
        ({"none": 0.51, "unknown": 0.0, "delay": 0.49}, "none"),
        ({"none": 0.49, "unknown": 0.0, "delay": 0.3, "valve_lag": 0.21}, "delay"),
        ({"none": 0.4, "unknown": 0.35, "delay": 0.25}, "unknown"),
        ({"none": 1.0}, "none"),
    ],
)
def test_none_stands_where_it_is_likelier_than_everything_else_together(
    probability: dict[str, float], name: str
) -> None:
    assert likeliest(probability) == name
