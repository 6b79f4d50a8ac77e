"""Notes and shares for a person: what several records have alike is told once, and of what a share is."""

from dataclasses import replace

from support.records.told_answers import told

from rig.gap.answer.facts import Where
from rig.gap.answer.words.notes import folded
from rig.gap.answer.words.shares import shares_along

ASKED = "the model diverges under this input; left out"


def test_equal_notes_of_several_records_are_one_line() -> None:
    notes = [
        "P0 is 0.30 MPa: another P0?",
        *(f"sine_{k}: {ASKED}" for k in range(2)),
        "baseline sine_0: the command has holes",
        *(f"sine_{k}: the angle never moves; broken sensor or stuck joint" for k in range(7)),
        "baseline sine_1: the command has holes",
        "sine_8: the command has holes",
        "the model is driven by the command",
    ]
    assert folded(notes) == [
        "P0 is 0.30 MPa: another P0?",
        f"2 records (sine_0, sine_1): {ASKED}",
        "2 records of earlier days (sine_0, sine_1): the command has holes",
        "7 records (sine_0, sine_1, sine_2 and 4 more): the angle never moves; broken sensor or stuck joint",
        "sine_8: the command has holes",
        "the model is driven by the command",
    ]


def test_two_kinds_of_shares_are_told_apart() -> None:
    said = shares_along(told())
    assert said.startswith("A stage's share is what its causes close")
    assert said.endswith("90 % of the gap come through them and 10 % from behind them.")
    assert "pressures" not in shares_along(replace(told(), where=Where("joint")))
