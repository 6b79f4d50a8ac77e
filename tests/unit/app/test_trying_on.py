"""Who has lost a device under pressure tries on: for how long, what is said meanwhile, and what ends it."""

import itertools
from collections.abc import Callable

import pytest

from rig.app.trying_on import TRYING_ON_S, TryingOn


class Turned:
    """A clock that somebody turns by waiting."""

    def __init__(self) -> None:
        self.now_s, self.attempts = 0.0, 0

    def wait(self, seconds: float) -> None:
        self.now_s += seconds

    def attempt(self) -> None:
        self.attempts += 1

    def after(self, seconds: float) -> Callable[[], bool]:
        return lambda: self.now_s >= seconds

    def trying(self, given_up: Callable[[], bool] = bool, elsewhere: Callable[[], str] = str) -> TryingOn:
        return TryingOn((0.15, 0.2), given_up, elsewhere, lambda: self.now_s, self.wait)


def test_it_goes_on_until_the_device_takes_it_and_says_so_as_it_goes(capsys: pytest.CaptureFixture[str]) -> None:
    clock = Turned()
    assert clock.trying().go_on(clock.after(25.0), clock.attempt) == ", after 25 s of trying"
    assert clock.attempts > 100
    first, *others = capsys.readouterr().err.splitlines()
    assert first.startswith("NOT SAFE as far as is known: the device does not take the safe state.")
    assert "0.15 and 0.2 MPa: keep clear of the joint" in first
    assert "Tried for 60 s, Ctrl-C gives it up" in first
    assert [line.rpartition(": ")[2] for line in others] == [
        "tried for 10 s; for 50 s more, or until Ctrl-C",
        "tried for 20 s; for 40 s more, or until Ctrl-C",
    ]


def test_it_has_a_bound() -> None:
    clock = Turned()
    assert clock.trying().go_on(bool, clock.attempt) == "; given up after 60 s of trying"
    assert clock.now_s == pytest.approx(TRYING_ON_S, abs=0.1)


def test_ctrl_c_ends_it() -> None:
    clock = Turned()
    how = clock.trying(given_up=clock.after(3.0)).go_on(bool, clock.attempt)
    assert how == "; given up by Ctrl-C or a signal after 3 s of trying"


def test_a_rig_that_somebody_else_drives_by_now_is_left_to_him() -> None:
    """The device is back, and another command has opened it: the safe state would be written over its set-points."""
    clock = Turned()
    other = itertools.chain(["", ""], itertools.repeat("modbus is driven by process 12 (pamrig run)"))
    how = clock.trying(elsewhere=lambda: next(other)).go_on(bool, clock.attempt)
    assert how == "; given up after 0 s of trying, for modbus is driven by process 12 (pamrig run)"
    assert clock.attempts == 2
