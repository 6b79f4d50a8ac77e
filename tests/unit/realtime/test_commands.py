"""The operator's mailbox and the script: every request once, stop words that nothing hides, and one decision per
state."""

import secrets
import time
from collections.abc import Iterator

import pytest
from support.scripted import program

from rig.errors import StateError
from rig.realtime.commands import CONTROL_PATIENCE_NS, Answer, Mailbox, Request, Script, program_name
from rig.realtime.faults import Fault
from rig.realtime.state import State

SESSION = 77


@pytest.fixture
def pair() -> Iterator[tuple[Mailbox, Mailbox]]:
    """The operator's end and the loop's end."""
    ours = Mailbox.create(f"test-{secrets.token_hex(8)}", SESSION)
    yield ours, Mailbox.attach(ours.block.path, SESSION)
    ours.block.unlink()


def ask(loop: Mailbox, state: State = State.DISARMED) -> Request:
    return loop.next(state, True)[0]


def test_a_request_is_seen_once_and_answered_by_its_ticket(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    ticket = operator.post(Request.ARM)
    assert operator.answered(ticket) is None
    assert [ask(loop), ask(loop)] == [Request.ARM, Request.NONE]
    loop.answer(Answer.NOT_READY)
    assert operator.answered(ticket) is Answer.NOT_READY


def test_the_same_request_twice_is_two_requests(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    first = operator.post(Request.RESET)
    assert ask(loop) is Request.RESET
    loop.answer(Answer.REFUSED)
    second = operator.post(Request.RESET)
    assert second != first
    assert operator.answered(second) is None
    assert ask(loop) is Request.RESET


def test_a_flood_leaves_the_newest(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    tickets = [operator.post(Request.ARM) for _ in range(500)] + [operator.post(Request.DISARM)]
    assert [ask(loop), ask(loop)] == [Request.DISARM, Request.NONE]
    loop.answer(Answer.DONE)
    assert operator.answered(tickets[-1]) is Answer.DONE
    assert operator.answered(tickets[0]) is None


def test_stop_and_estop_have_words_of_their_own(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    operator.stop()
    operator.estop()
    operator.post(Request.ARM)
    assert loop.stop_wanted()
    assert loop.estop_wanted() is Fault.ESTOP
    operator.stop(False)
    operator.estop(Fault.NONE)
    assert not loop.stop_wanted()
    assert loop.estop_wanted() is Fault.NONE


def test_words_that_nobody_knows_do_no_harm(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    operator.post(99)  # type: ignore[arg-type]
    assert ask(loop) is Request.NONE
    operator.block.words[Mailbox.ESTOP] = 250
    assert loop.estop_wanted() is Fault.ESTOP, "whatever it meant, it meant stop"


def test_a_start_brings_its_program(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    number = secrets.randbits(31)
    block = program(number, sweep=9).publish(program_name(SESSION, number), SESSION)
    try:
        operator.post(Request.START, number)
        request, found = loop.next(State.ARMED, True)
        assert request is Request.START
        assert found is not None
        assert (found.run, len(found.p1_cmd_mpa)) == (number, 9)
    finally:
        block.unlink()


def test_a_start_without_its_program_is_an_error_of_the_request(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    operator.post(Request.START, secrets.randbits(31))
    with pytest.raises(StateError, match="no such shared memory"):
        loop.next(State.ARMED, True)
    assert ask(loop) is Request.NONE, "it is not tried again"


def test_control_is_lost_only_after_it_has_promised_to_beat(
    pair: tuple[Mailbox, Mailbox], monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, loop = pair
    assert not loop.control_lost()
    operator.beat()
    begun = time.monotonic_ns()
    assert not loop.control_lost()
    looks_ns = range(begun, begun + CONTROL_PATIENCE_NS + 5_000_001, 5_000_000)
    lost = []
    for now_ns in looks_ns:
        monkeypatch.setattr(time, "monotonic_ns", lambda now_ns=now_ns: now_ns)
        lost.append(loop.control_lost())
    assert lost[-1]
    assert not any(lost[:-2]), "the beat was a little before"


def test_control_is_not_lost_when_the_machine_stood_still(
    pair: tuple[Mailbox, Mailbox], monkeypatch: pytest.MonkeyPatch
) -> None:
    operator, loop = pair
    operator.beat()
    assert not loop.control_lost()
    later_ns = time.monotonic_ns() + 3 * CONTROL_PATIENCE_NS
    monkeypatch.setattr(time, "monotonic_ns", lambda: later_ns)
    assert not loop.control_lost(), "the loop runs again first"
    operator.beat()
    assert not loop.control_lost()


def test_a_mailbox_forgets_what_was_asked_before_it_was_opened(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, _ = pair
    operator.post(Request.ARM)
    late = Mailbox.attach(operator.block.path, SESSION)
    assert ask(late) is Request.NONE, "a restarted loop never carries out an old request"


def decide(script: Script, state: State, resting: bool = True) -> Request:
    return script.next(state, resting)[0]


def test_a_script_arms_runs_everything_in_order_and_quits(pair: tuple[Mailbox, Mailbox]) -> None:
    script = Script([program(1), program(2)], pair[1])
    assert decide(script, State.DISARMED) is Request.ARM
    started = [script.next(State.ARMED, False)]
    assert decide(script, State.RUNNING) is Request.NONE
    assert decide(script, State.DONE, resting=False) is Request.NONE
    started.append(script.next(State.DONE, True))
    assert [(request, p.run if p else 0) for request, p in started] == [(Request.START, 1), (Request.START, 2)]
    assert decide(script, State.DONE) is Request.QUIT


def test_a_script_quits_on_a_fault_and_after_a_stop(pair: tuple[Mailbox, Mailbox]) -> None:
    operator, loop = pair
    assert decide(Script([program(1)], loop), State.FAULT) is Request.QUIT
    operator.stop()
    script = Script([program(1)], loop)
    assert script.stop_wanted()
    assert decide(script, State.RUNNING) is Request.NONE, "the loop ramps out first"
    assert decide(script, State.DONE, resting=False) is Request.NONE
    assert decide(script, State.DONE) is Request.QUIT
    assert decide(Script([program(1)], loop), State.DISARMED) is Request.QUIT
