"""Pauses before a process that died is started anew, and what a daemon may open."""

import resource
import signal

import pytest

from rig.service import processes
from rig.service.processes import DESCRIPTORS, STEADY_S, RestartDelays, allow_descriptors, start_process

PAUSES_S = (0.0, 2.0, 10.0)


class Clock:
    """One that is turned by hand, in place of the monotonic one."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_s = 1000.0
        monkeypatch.setattr(processes.time, "monotonic", lambda: self.now_s)

    def lives(self, pauses: RestartDelays, lived_s: float) -> float:
        """The pause after a process that lived so long."""
        pauses.began()
        self.now_s += lived_s
        return pauses.next_s()


@pytest.mark.parametrize(("before", "expected_s"), [(0, [2.0, 10.0, 10.0]), (-1, [0.0, 2.0, 10.0, 10.0])])
def test_the_pause_grows_with_every_death_in_a_row(
    before: int, expected_s: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, pauses = Clock(monkeypatch), RestartDelays(PAUSES_S, before)
    assert [clock.lives(pauses, 1.0) for _ in expected_s] == expected_s


@pytest.mark.parametrize(("lived_s", "pause_s"), [(STEADY_S, 10.0), (STEADY_S + 0.1, 0.0)])
def test_one_that_lived_for_long_did_not_die_in_a_row(
    lived_s: float, pause_s: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    clock, pauses = Clock(monkeypatch), RestartDelays(PAUSES_S)
    assert [clock.lives(pauses, 1.0) for _ in range(3)] == [2.0, 10.0, 10.0]
    assert clock.lives(pauses, lived_s) == pause_s


class StruckAsItStarts:
    """A process; while it is given what it is started with, the one that starts it is told to end."""

    def __init__(self, number: signal.Signals) -> None:
        self._number, self.is_whole = number, False

    def start(self) -> None:
        signal.raise_signal(self._number)
        self.is_whole = True


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_process_is_started_whole_whatever_tells_the_other_one_to_end(number: signal.Signals) -> None:
    """It ended by a traceback at the terminal, for want of what it was to be given."""

    def told(*_: object) -> None:
        raise KeyboardInterrupt

    before, process = signal.signal(number, told), StruckAsItStarts(number)
    try:
        with pytest.raises(KeyboardInterrupt):
            start_process(process)  # type: ignore[arg-type]
    finally:
        signal.signal(number, before)
    assert process.is_whole


@pytest.mark.parametrize(
    ("soft", "hard", "taken", "warned"),
    [
        (80, 4096, [(DESCRIPTORS, 4096)], False),
        (80, resource.RLIM_INFINITY, [(DESCRIPTORS, resource.RLIM_INFINITY)], False),
        (80, 200, [(200, 200)], True),
        (2000, 4096, [], False),
    ],
)
def test_a_daemon_takes_the_descriptors_that_it_may_have(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, soft: int, hard: int, taken: object, warned: bool
) -> None:
    """With 80, of which its shell had left it no more, fifty clients kept an emergency stop from being heard."""
    limits: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (soft, hard))
    monkeypatch.setattr(resource, "setrlimit", lambda _, both: limits.append(both))
    allow_descriptors()
    assert limits == taken
    assert bool(caplog.messages) is warned
