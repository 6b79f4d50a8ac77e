"""Cookies, form keys, tokens and the limit on guessing them; who commands. Clocks are turned by hand."""

import hmac

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import StateError
from rig.service.web.access.command_holder import AWAY_S, CommandHolder
from rig.service.web.access.visitors import FORGET_S, GUESSES, LASTS_S, Guesses, Visitors

KEY, TOKEN = b"k" * 32, "0123456789abcdef"


class Clock:
    def __init__(self) -> None:
        self.now = 1e9

    def __call__(self) -> float:
        return self.now


def test_a_cookie_is_recognised_until_it_is_old_or_key_or_token_are_others() -> None:
    clock = Clock()
    visitors = Visitors(KEY, TOKEN, clock)
    visitor = visitors.new(trusted=True)
    cookie = visitors.cookie(visitor)
    assert visitors.recognised(cookie) == visitor
    assert Visitors(b"x" * 32, TOKEN, clock).recognised(cookie) is None
    assert Visitors(KEY, "another token 16", clock).recognised(cookie) is None
    clock.now += LASTS_S - 1
    assert visitors.recognised(cookie) == visitor
    clock.now += 2
    assert visitors.recognised(cookie) is None


@given(st.text(max_size=200))
def test_nothing_else_is_a_cookie(text: str) -> None:
    assert Visitors(KEY, TOKEN).recognised(text) is None


def test_trust_cannot_be_written_into_a_cookie() -> None:
    visitors = Visitors(KEY, TOKEN)
    id_, trusted, made, signature = visitors.cookie(visitors.new(trusted=False)).split(".")
    assert trusted == "0"
    assert visitors.recognised(f"{id_}.1.{made}.{signature}") is None


@given(st.text(max_size=100))
def test_only_the_token_fits_and_without_one_nothing_does(text: str) -> None:
    assert Visitors(KEY, TOKEN).token_fits(text) is (text == TOKEN)
    assert not Visitors(KEY, "").token_fits(text)


def test_a_form_key_is_its_visitors_own() -> None:
    visitors = Visitors(KEY, TOKEN)
    one, other = visitors.new(trusted=False), visitors.new(trusted=False)
    assert visitors.is_form_key(one, visitors.form_key(one))
    assert not visitors.is_form_key(one, visitors.form_key(other))
    assert not visitors.is_form_key(one, "ä")


def test_whatever_is_secret_is_compared_in_constant_time(monkeypatch: pytest.MonkeyPatch) -> None:
    visitors, compared, compare = Visitors(KEY, TOKEN), [], hmac.compare_digest
    visitor = visitors.new(trusted=True)
    cookie, form_key = visitors.cookie(visitor), visitors.form_key(visitor)
    monkeypatch.setattr(hmac, "compare_digest", lambda a, b: compared.append((a, b)) or compare(a, b))
    for ask in (
        lambda: visitors.token_fits(TOKEN),
        lambda: visitors.recognised(cookie) is not None,
        lambda: visitors.is_form_key(visitor, form_key),
    ):
        before = len(compared)
        assert ask()
        assert len(compared) == before + 1
        assert compared[-1][0] == compared[-1][1]  # the whole of it, and nothing looked at before
    assert all(TOKEN.encode() not in pair for pair in compared)  # whose length would tell something, too


def test_who_guesses_wrong_waits_and_others_do_not() -> None:
    clock = Clock()
    guesses = Guesses(clock)
    for _ in range(GUESSES):
        assert guesses.wait_s("a") == 0
        guesses.wrong("a")
    assert guesses.wait_s("a") == pytest.approx(FORGET_S)
    assert guesses.wait_s("b") == 0
    clock.now += FORGET_S
    assert guesses.wait_s("a") == 0


def test_many_addresses_together_have_a_limit_too() -> None:
    guesses = Guesses(Clock())
    for number in range(10 * GUESSES):
        assert guesses.wait_s("new") == 0
        guesses.wrong(f"10.0.0.{number}")
    assert guesses.wait_s("new") > 0


def test_one_commands_until_he_gives_up_or_is_away() -> None:
    clock, visitors = Clock(), Visitors(KEY, "")
    command_holder, one, other = CommandHolder(clock), visitors.new(trusted=False), visitors.new(trusted=False)
    with pytest.raises(StateError, match="take the command first"):
        command_holder.require(one)
    command_holder.come(one)
    command_holder.take(one)
    command_holder.require(one)
    with pytest.raises(StateError, match=f"browser {one.name} commands"):
        command_holder.take(other)
    clock.now += 100 * AWAY_S
    assert command_holder.holder == one  # as long as a page of his is open
    command_holder.go(one)
    clock.now += AWAY_S
    assert command_holder.holder == one  # a reload
    clock.now += 1
    command_holder.take(other)
    command_holder.give_up(one)
    assert command_holder.holder == other
    command_holder.give_up(other)
    assert command_holder.holder is None
