"""A test during which the machine stood still is run again, and one that fails without that is not for long (decision
0426)."""

import fcntl
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from support.standstill import PATIENCE_S, RERUNS, STANDSTILLS, STOOD_S, STOOD_SHARE, Standstills, Witness

TESTS = Path(__file__).resolve().parents[2]
STANDS_STILL = """
import os, signal, subprocess, sys, time
from pathlib import Path
import pytest
from conftest import witness

def attempt(kind):
    tries = Path(__file__).with_name(kind)
    count = len(tries.read_text()) + 1 if tries.exists() else 1
    tries.write_text("x" * count)
    return count

def stand_still():
    with subprocess.Popen(["sh", "-c", f"sleep 0.7; kill -CONT {witness().pid} {os.getpid()}"]):
        os.kill(witness().pid, signal.SIGSTOP)
        os.kill(os.getpid(), signal.SIGSTOP)
"""
INSIDE = (
    STANDS_STILL
    + """
@pytest.mark.real_time
def test_stands_still_for_a_while():
    if attempt("a while") <= UNTIL:
        stand_still()
        raise AssertionError("late")

@pytest.mark.real_time
def test_stands_still_always():
    attempt("always")
    stand_still()
    raise AssertionError("late")

@pytest.mark.real_time
def test_is_wrong():
    attempt("wrong")
    raise AssertionError("as always")

@pytest.mark.real_time
def test_holds_up_its_own_process():
    attempt("held up")
    sys.setswitchinterval(1.0)
    until_s = time.monotonic() + 0.7
    while time.monotonic() < until_s:
        pass
    sys.setswitchinterval(0.005)
    raise AssertionError("as always")
"""
)
BESIDE_OTHERS = (
    STANDS_STILL
    + """
@pytest.mark.real_time
def test_stands_still_beside_others(pytestconfig):
    if not pytestconfig.getoption("--alone"):
        stand_still()
        raise AssertionError("late")
    assert RIGHT
"""
)

AT_ONCE = """
import os
import pytest
import support.standstill

support.standstill.STOOD_S = 0.5

def pytest_configure(config):
    if not config.getoption("--alone"):
        support.standstill.STANDSTILLS = int(os.environ["STANDSTILLS"])

@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    for item in items:
        for again in item.iter_markers("flaky"):
            again.kwargs["reruns_delay"] = 0.1
"""
"""What counts is how often, not how long is waited between; and how the machine itself stands still, on a busy one for
tenths of a second, excuses nothing here."""


FEWER = 2
"""Standstills that excuse a test beside others, to make them shorter; alone all of them do."""


class Seen:
    """A witness that was told what it saw."""

    def __init__(self) -> None:
        self.stood_s = 0.0

    def longest_s(self, since_s: float) -> float:
        return self.stood_s


def test_attempts_in_which_the_machine_stood_still_count_as_none() -> None:
    witness = Seen()
    seen = Standstills(witness)
    assert [seen.failed(attempts) for attempts in range(1, RERUNS + 2)] == [False] * RERUNS + [True]
    witness.stood_s = 2 * STOOD_S
    assert not seen.failed(RERUNS + 1), "this one"
    seen.begin()
    witness.stood_s = 0.0
    assert not seen.failed(RERUNS + 1), "the one before"
    assert seen.failed(RERUNS + 2)


def test_given_up_is_what_cannot_be_judged_and_nothing_else() -> None:
    witness = Seen()
    seen = Standstills(witness)
    last = RERUNS + STANDSTILLS + 1
    assert not seen.given_up(last), "it failed"
    witness.stood_s = 2 * STOOD_S
    for _ in range(last - 1):
        seen.begin()
    assert not seen.given_up(last - 1)
    assert seen.given_up(last)


def test_a_test_that_takes_long_is_given_up_sooner(monkeypatch: pytest.MonkeyPatch) -> None:
    witness = Seen()
    witness.stood_s = 4 * STOOD_SHARE * PATIENCE_S
    seen = Standstills(witness)
    assert not seen.given_up(1)
    later_s = time.monotonic() + 2 * PATIENCE_S
    monkeypatch.setattr(time, "monotonic", lambda: later_s)
    assert seen.given_up(1)
    witness.stood_s = 0.0
    assert not seen.given_up(1), "without a standstill the test is what took long"


def test_a_standstill_that_is_short_beside_an_attempt_excuses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    witness = Seen()
    begun_s = time.monotonic()
    seen = Standstills(witness)
    monkeypatch.setattr(time, "monotonic", lambda: begun_s + 195.0)
    witness.stood_s = 2 * STOOD_S
    assert not seen.stood
    witness.stood_s = 1.1 * STOOD_SHARE * 195.0
    assert seen.stood


def test_the_witness_sees_what_holds_itself_up_and_no_other() -> None:
    witness = Witness()
    begun_s = time.monotonic()
    os.kill(witness.pid, signal.SIGSTOP)
    while (yet_s := witness.longest_s(begun_s)) < 3 * STOOD_S:
        pass
    os.kill(witness.pid, signal.SIGCONT)
    while time.monotonic() - witness.looked_s > STOOD_S:
        pass
    assert witness.longest_s(begun_s) >= yet_s, "also afterwards"
    assert witness.longest_s(time.monotonic()) < yet_s, "and not in what comes then"
    witness.end()


def run_of(folder: Path, tests: str, *words: str, standstills: int) -> subprocess.CompletedProcess[str]:
    """Of these tests as of those here, each run again at once."""
    (folder / "test_inside.py").write_text(tests)
    (folder / "at_once.py").write_text(AT_ONCE)
    here = {
        "PYTHONPATH": os.pathsep.join((str(TESTS), str(folder))),
        "PYTEST_ADDOPTS": "-p conftest -p at_once -p no:cacheprovider",
        "STANDSTILLS": str(standstills),
    }
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--rootdir", str(folder), *words, str(folder)],
        cwd=folder,
        env=os.environ | here,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


def test_standing_still_is_told_from_failing(tmp_path: Path) -> None:
    until = RERUNS + 1
    done = run_of(tmp_path, INSIDE.replace("UNTIL", str(until)), standstills=FEWER)
    assert done.returncode == pytest.ExitCode.TESTS_FAILED, done.stdout + done.stderr
    for wrong in ("test_is_wrong", "test_holds_up_its_own_process"):
        assert f"FAILED test_inside.py::{wrong}" in done.stdout
    assert "1 passed" in done.stdout
    assert "test_stands_still_for_a_while: run again, the machine stood still for " in done.stdout
    last = done.stdout.partition("not judged, not even alone")[2]
    assert last.splitlines()[1:] == ["test_inside.py::test_stands_still_always"], "said plainly, and left at that"

    def attempts(kind: str) -> int:
        return len((tmp_path / kind).read_text())

    assert attempts("a while") >= until + 1
    assert attempts("always") == (RERUNS + FEWER + 1) + (RERUNS + STANDSTILLS + 1), "in the run, and alone"
    assert all(RERUNS + 1 <= attempts(kind) <= RERUNS + FEWER + 1 for kind in ("wrong", "held up"))


@pytest.mark.parametrize(("right", "words"), [(True, ()), (False, ("-n", "1"))])
def test_what_could_not_be_judged_has_its_verdict_alone(tmp_path: Path, right: bool, words: tuple[str, ...]) -> None:
    done = run_of(tmp_path, BESIDE_OTHERS.replace("RIGHT", str(right)), *words, standstills=0)
    beside, alone = done.stdout.split("1 not judged yet, once more with nothing else on:")
    assert "1 skipped" in beside, done.stdout + done.stderr
    assert ("1 passed" if right else "1 failed") in alone
    assert (done.returncode == pytest.ExitCode.OK) == right


@pytest.mark.real_time
def test_a_test_that_reads_the_clock_is_watched_over(request: pytest.FixtureRequest) -> None:
    (marker,) = request.node.iter_markers("flaky")
    assert marker.kwargs["condition"]()


@pytest.mark.real_time
def test_nobody_else_reads_the_clock_meanwhile() -> None:
    with (TESTS / "conftest.py").open() as lane, pytest.raises(BlockingIOError):
        fcntl.flock(lane, fcntl.LOCK_EX | fcntl.LOCK_NB)
