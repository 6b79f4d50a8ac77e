"""An effect before its cause is told from one that is late, over the records of a session; what they do not tell is not
claimed."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import RecordError
from rig.gap.records.pairs import pair_up
from rig.identify.records.causality import before_command, before_pressures
from rig.record import Column, Record

T_S = np.arange(0.0, 20.0, 0.005)
HERTZ = (0.3, 0.8, 1.3)


def sine(hertz: float, angle_s: float = 0.12, pressures_s: float = 0.05, joint_s: float = 0.03) -> Record:
    """A sine whose pressures and angle come so much later, and further by a joint of one time constant."""

    def late(by_s: float, lag_s: float = 0.0) -> Column:
        omega = 2.0 * np.pi * hertz
        return np.sin(omega * (T_S - by_s) - np.arctan(omega * lag_s))

    p1, p2 = (0.2 + sign * 0.05 * late(pressures_s) for sign in (1.0, -1.0))
    return Record(
        f"sine_{hertz:g}hz",
        T_S,
        0.1 * late(0.0),
        angle_deg=15.0 * late(angle_s, joint_s) + 3.0,
        p1_mpa=p1,
        p2_mpa=p2,
    )


def session(angle_s: float = 0.12, pressures_s: float = 0.05) -> list[Record]:
    return [sine(hertz, angle_s, pressures_s) for hertz in HERTZ]


@given(st.floats(0.06, 0.8), st.floats(0.01, 0.4))
def test_what_is_late_is_not_early(angle_s: float, pressures_s: float) -> None:
    assert before_command(session(angle_s, pressures_s)) == ""


@given(st.floats(0.1, 0.8))
def test_an_angle_before_its_command_is_told_with_its_time(early_s: float) -> None:
    said = before_command(session(angle_s=-early_s))
    assert said.startswith("the angle comes ")
    told_s = float(said.split()[3])
    assert told_s == pytest.approx(early_s - 0.03, abs=0.02), "less what the joint is late by itself"


def test_pressures_before_their_command_are_told_first() -> None:
    said = before_command(session(angle_s=-0.1, pressures_s=-0.2))
    assert said.startswith("the measured p1 - p2 comes 0.2 s before its command")


def test_a_single_sine_does_not_tell_early_from_the_rest_of_its_period_late() -> None:
    assert before_command([sine(0.8, angle_s=-0.3)]) == ""
    assert before_command([sine(0.8, angle_s=-0.3), sine(0.8, angle_s=-0.3)]) == ""
    assert before_command(session(angle_s=-0.3)) != ""


def test_a_velocity_leads_its_position_and_is_not_early() -> None:
    for hertz in ((0.25,), HERTZ):
        ahead = [replace(one := sine(f), angle_deg=np.gradient(one.dp_cmd_mpa, T_S)) for f in hertz]
        assert before_command(ahead) == ""


@pytest.mark.parametrize("periods", [1, 2, 3])
def test_a_few_periods_of_a_friction_force_are_not_early(periods: int) -> None:
    """It leads the displacement by a sixth of a period, as a real damper's does with play before it."""
    last = round(2.0 * periods / (T_S[1] - T_S[0]))
    one = sine(0.5, angle_s=-0.31).rows(slice(0, last + 3))
    assert before_command([one, one]) == ""


def test_a_rig_that_turns_the_other_way_is_not_early() -> None:
    assert (
        before_command([replace(one, angle_deg=-one.angle_deg) for one in session() if one.angle_deg is not None]) == ""
    )


def test_records_that_tell_nothing_are_passed_over() -> None:
    still = replace(sine(0.3), dp_cmd_mpa=np.zeros(len(T_S)))
    short = sine(0.3).rows(T_S < 1.0)
    assert before_command([]) == before_command([still]) == before_command([short]) == ""


def test_a_session_whose_angle_is_early_is_refused_in_one_line() -> None:
    with pytest.raises(RecordError, match=r"the 3 records: the angle comes 0.27 s before its command"):
        pair_up(session(angle_s=-0.3), [], 0.2)


def test_a_day_whose_angle_is_early_is_no_healthy_day() -> None:
    pairing = pair_up(session(), [session(angle_s=-0.3), session(angle_s=0.125)], 0.2)
    assert pairing.day_count == 1
    assert any(note.startswith("baseline the 3 records: the angle comes") for note in pairing.notes)


def test_beside_pressures_that_come_after_the_angle_the_angle_is_used_alone() -> None:
    assert before_pressures(session()) == ""
    late = session(pressures_s=0.4)
    assert before_command(late) == ""
    pairing = pair_up(late, [], 0.2)
    assert not pairing.pressures
    (note,) = [note for note in pairing.notes if "before the measured p1 - p2" in note]
    assert note.endswith("the angle alone is used")
