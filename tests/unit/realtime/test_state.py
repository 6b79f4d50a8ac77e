"""The state table: what is possible, what is not, and the rules that must hold in any version of it."""

import pytest

from rig.errors import StateError
from rig.realtime.state import TABLE, Event, State, after


def test_a_fault_is_possible_everywhere_and_left_only_by_a_reset() -> None:
    assert all(after(state, Event.FAULT) is State.FAULT for state in State)
    out = {event for (state, event), then in TABLE.items() if state is State.FAULT and then is not State.FAULT}
    assert out == {Event.RESET}


def test_a_reset_does_not_arm() -> None:
    assert after(State.FAULT, Event.RESET) is State.DISARMED
    assert [state for state, event in TABLE if event is Event.RESET] == [State.FAULT]


def test_nothing_runs_that_was_not_armed() -> None:
    starts = {state for (state, event), then in TABLE.items() if then is State.RUNNING}
    assert starts == {State.ARMED, State.DONE}
    arms = {state for (state, event), then in TABLE.items() if then is State.ARMED}
    assert arms == {State.DISARMED, State.DONE}


def test_a_running_rig_is_neither_disarmed_nor_armed() -> None:
    assert {event for state, event in TABLE if state is State.RUNNING} == {Event.FINISH, Event.FAULT}


def test_every_state_can_be_reached_and_left() -> None:
    assert set(TABLE.values()) == set(State)
    assert {state for state, _ in TABLE} == set(State)


@pytest.mark.parametrize(("state", "event"), [(s, e) for s in State for e in Event if (s, e) not in TABLE])
def test_what_does_not_fit_is_refused_with_what_is_possible(state: State, event: Event) -> None:
    with pytest.raises(StateError) as refusal:
        after(state, event)
    line = str(refusal.value)
    assert "\n" not in line
    assert f"cannot {event.value} while {state.name.lower()}" in line
    assert all(e.value in line for s, e in TABLE if s is state and e is not Event.FAULT)
