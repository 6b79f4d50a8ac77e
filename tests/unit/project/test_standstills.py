"""A test during which the machine stood still is run again, and one that fails without that is not for long (decision
0426)."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from support.standstill import RERUNS, STANDSTILLS, STOOD_S, Standstills

TESTS = Path(__file__).resolve().parents[2]
INSIDE = """
import os, signal, subprocess, sys
from pathlib import Path
import pytest

@pytest.mark.real_time
@pytest.mark.parametrize("kind", ["stands still", "is wrong"])
def test_it(kind):
    tries = Path(__file__).with_name(kind)
    count = len(tries.read_text()) + 1 if tries.exists() else 1
    tries.write_text("x" * count)
    if kind == "is wrong":
        raise AssertionError("as always")
    if count <= UNTIL:
        with subprocess.Popen(["sh", "-c", f"sleep 0.3; kill -CONT {os.getpid()}"]):
            os.kill(os.getpid(), signal.SIGSTOP)
        raise AssertionError("late")
"""


def test_attempts_in_which_the_machine_stood_still_count_as_none() -> None:
    seen = Standstills()
    assert [seen.may_run_again(attempts) for attempts in range(1, RERUNS + 2)] == [True] * RERUNS + [False]
    seen.longest_s = 2 * STOOD_S
    assert seen.may_run_again(RERUNS + 1), "this one"
    seen.begin()
    assert seen.may_run_again(RERUNS + 1), "the one before"
    assert not seen.may_run_again(RERUNS + 2)


def test_whoever_only_sleeps_does_not_stand_still_in_its_own_eyes() -> None:
    with Standstills() as seen:
        seen.begin()
        assert not seen.stood


def test_standing_still_is_told_from_failing(tmp_path: Path) -> None:
    until = RERUNS + 1
    (tmp_path / "test_inside.py").write_text(INSIDE.replace("UNTIL", str(until)))
    call = [sys.executable, "-m", "pytest", "-q", "-p", "conftest", "-p", "no:cacheprovider"]
    done = subprocess.run(
        [*call, "--rootdir", str(tmp_path), str(tmp_path)],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(TESTS)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert "1 failed, 1 passed" in done.stdout, done.stdout + done.stderr
    assert "test_it[stands still]: run again, the machine stood still for 0." in done.stdout
    assert len((tmp_path / "stands still").read_text()) >= until + 1
    assert RERUNS + 1 <= len((tmp_path / "is wrong").read_text()) <= RERUNS + STANDSTILLS + 1


@pytest.mark.real_time
def test_a_test_that_reads_the_clock_is_watched_over(request: pytest.FixtureRequest) -> None:
    (marker,) = request.node.iter_markers("flaky")
    assert marker.kwargs["condition"]()
