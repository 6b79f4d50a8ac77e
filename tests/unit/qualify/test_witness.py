"""The witness's process: what it is granted, that it speaks at the end, and what is said of one that does not."""

import os
import signal
import time

import pytest

from rig.qualify.witness import Account, Witnesses

pytestmark = pytest.mark.real_time


@pytest.fixture
def allowed() -> None:
    """Skip where real-time priority is not permitted."""
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    except PermissionError:
        pytest.skip("real-time priority is not permitted here")
    os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


@pytest.mark.usefixtures("allowed")
def test_a_witness_stays_on_its_core_at_its_priority_and_gives_account() -> None:
    cores = os.sched_getaffinity(0)
    with Witnesses(cores) as witnesses:
        for core, process in witnesses.processes.items():
            assert os.sched_getaffinity(process.pid) == {core}
            assert os.sched_getscheduler(process.pid) == os.SCHED_FIFO
        priorities = {
            core: os.sched_getparam(process.pid).sched_priority for core, process in witnesses.processes.items()
        }
        accounts = witnesses.accounts()
    assert {one.core: one.priority for one in accounts} == priorities
    assert not any(one.why_not for one in accounts)


@pytest.mark.usefixtures("allowed")
def test_a_witness_that_is_stopped_has_seen_a_stall() -> None:
    core = min(os.sched_getaffinity(0))
    with Witnesses([core]) as witnesses:
        pid = witnesses.processes[core].pid
        os.kill(pid, signal.SIGSTOP)
        os.waitid(os.P_PID, pid, os.WSTOPPED)
        stopped_ns = time.monotonic_ns()
        time.sleep(0.01)
        going_on_ns = time.monotonic_ns()
        os.kill(pid, signal.SIGCONT)
        (account,) = witnesses.accounts()
    assert any(stall.ran_ns < stopped_ns and stall.until_ns > going_on_ns for stall in account.stalls)


def test_a_witness_that_was_killed_is_no_witness() -> None:
    core = min(os.sched_getaffinity(0))
    with Witnesses([core]) as witnesses:
        witnesses.processes[core].kill()
        (account,) = witnesses.accounts()
    assert account.why_not
    assert not account.stalls


def test_a_core_that_is_not_there_is_said() -> None:
    with Witnesses([1023]) as witnesses:
        (account,) = witnesses.accounts()
    assert account == Account(1023, why_not=account.why_not)
    assert "affinity denied" in account.why_not
