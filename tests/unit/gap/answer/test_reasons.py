"""Reasons for a cause that may go either way say which they are for."""

import pytest

from rig.gap.answer.words.effects import EFFECT_WORDS


@pytest.mark.parametrize(
    ("effect", "ways"),
    [
        ("valve_lag", ("later: ", "; sooner: ")),
        ("coulomb_friction", ("more: ", "; less: ")),
        ("viscous_friction", ("more: ", "; less: ")),
    ],
)
def test_reasons_are_told_by_the_way_it_goes(effect: str, ways: tuple[str, str]) -> None:
    """Regulators that answer sooner were told to have long hoses or a clogged filter."""
    first, second = ways
    reasons = EFFECT_WORDS[effect].reasons
    assert reasons.startswith(first)
    assert second in reasons
