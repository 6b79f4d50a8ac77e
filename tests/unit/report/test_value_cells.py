"""How many digits of a parameter are told beside its standard deviation."""

import pytest

from rig.report.fit_files import value_cell


@pytest.mark.parametrize(
    ("value", "std", "said"),
    [
        (0.9637004717, 0.0235, "0.964"),
        (2.06441, 3.2, "2.1"),
        (-0.0156449, 0.013, "-0.016"),
        (1234.5, 320.0, "1230"),
        (0.12345678, 1e-9, "0.123457"),
        (-0.25, None, "-0.25"),
        (0.0, 0.1, "0"),
        (1.5, float("nan"), "1.5"),
    ],
)
def test_a_value_ends_at_the_second_digit_of_its_deviation(value: float, std: float | None, said: str) -> None:
    assert value_cell(value, std) == said
