"""Numbers for people: in a sentence, beside a standard deviation in a table, in a file; how many of something."""

import pytest

from rig.number_text import counted, parameter_text, rounded, to_digits


@pytest.mark.parametrize(
    ("value", "width", "text"),
    [
        (0.0102, 0.0, 0.01),
        (12.34, 0.01, 12.0),
        (12.34, 3.0, 12.0),
        (12.34, 30.0, 10.0),
        (0.751, 0.0, 0.75),
        (0.0, 0.0, 0.0),
        (1234.0, 0.0, 1200.0),
    ],
)
def test_no_more_digits_than_they_are_worth(value: float, width: float, text: float) -> None:
    assert float(rounded(value, width)) == pytest.approx(text)


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
        (0.001, 300.0, "0.001"),
    ],
)
def test_a_value_ends_at_the_second_digit_of_its_deviation(value: float, std: float | None, said: str) -> None:
    assert parameter_text(value, std) == said


def test_one_end_of_a_move_has_the_digits_of_the_move() -> None:
    assert rounded(0.4237, move=0.02) == "0.424"
    assert rounded(99.04, move=-1.04) == "99.0"
    assert rounded(float("nan")) == "unknown"


def test_a_number_of_a_file_stays_a_number() -> None:
    assert to_digits(0.0123456, 3) == 0.0123
    assert to_digits(-98765.0, 2) == -99000.0


@pytest.mark.parametrize(("count", "said"), [(0, "0 records"), (1, "1 record"), (2, "2 records")])
def test_one_is_one(count: int, said: str) -> None:
    assert counted(count, "record") == said


@pytest.mark.parametrize(("count", "said"), [(0, "0 ticks were"), (1, "1 tick was"), (2, "2 ticks were")])
def test_a_verb_goes_with_it(count: int, said: str) -> None:
    assert counted(count, "tick was", "ticks were") == said
