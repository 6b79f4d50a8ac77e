"""Pieces of work over processes and over a real local Dask cluster, one of whose workers is killed in the middle."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from functools import partial
from multiprocessing import active_children
from pathlib import Path

import pytest
from conftest import ROOT
from support.cluster_work import die, fail, leave_trace

from rig.errors import RigError
from rig.parallel import each, executor

PIECES = 16
TESTS = str(ROOT / "tests")


def test_local_processes_do_every_piece_once(tmp_path: Path) -> None:
    seen: list[int] = []
    with executor(workers=2) as pool:
        results = sorted(each(pool, partial(leave_trace, str(tmp_path)), range(PIECES), seen.append))
    assert results == list(range(PIECES))
    assert seen == list(range(1, PIECES + 1))
    assert len({path.read_text() for path in tmp_path.glob("*.tries")}) == 2, "both processes worked"


def test_a_failing_piece_ends_the_work_with_its_own_error() -> None:
    with executor(workers=1) as pool, pytest.raises(ValueError, match="cannot be done"):
        list(each(pool, fail, range(3)))


def test_a_killed_worker_loses_nothing_and_counts_nothing_twice(tmp_path: Path) -> None:
    """Out of memory, say: the kernel kills one, which breaks the pool."""
    seen: list[int] = []

    def kill_one(done: int) -> None:
        seen.append(done)
        if done in (3, 9):
            os.kill(active_children()[0].pid or 0, signal.SIGKILL)

    with executor(workers=2) as pool:
        results = sorted(each(pool, partial(leave_trace, str(tmp_path)), range(PIECES), kill_one))
    assert results == list(range(PIECES))
    assert seen == list(range(1, PIECES + 1))


def test_a_piece_that_always_kills_its_worker_is_one_clear_line() -> None:
    with executor(workers=1) as pool, pytest.raises(RigError, match=r"1 of 1 pieces .* died 3 times in a row"):
        list(each(pool, die, range(1)))


POOL = """with executor(workers=2) as pool:
            list(each(pool, partial(write_and_stay, sys.argv[1]), range(12)))"""
MEASURED_APART = "measured_apart(begin_and_stay, sys.argv[1], 0)"
INTERRUPTED = """
import signal, sys
from functools import partial
from support.cluster_work import begin_and_stay, write_and_stay
from rig.parallel import each, executor
from rig.qualify.benchmarks.log_peers import measured_apart
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # whoever runs the tests may have had it ignored
    try:
        WORK
    except KeyboardInterrupt:
        sys.exit(130)
"""


@pytest.mark.parametrize(("work", "pieces"), [(POOL, 2), (MEASURED_APART, 1)])
def test_ctrl_c_ends_pieces_that_never_would_and_says_nothing(work: str, pieces: int, tmp_path: Path) -> None:
    script = tmp_path / "work.py"
    script.write_text(INTERRUPTED.replace("WORK", work))
    environment = os.environ | {"PYTHONPATH": TESTS}
    process = subprocess.Popen(
        [sys.executable, str(script), str(tmp_path)],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    while len(list(tmp_path.glob("*.begun"))) < pieces:
        assert process.poll() is None
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)
    try:
        _, said = process.communicate(timeout=60)
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    assert process.returncode == 130
    assert said == ""
    assert {path.suffix for path in tmp_path.iterdir()} == {".py", ".begun"}, "nothing is left half written"


def test_a_killed_dask_worker_loses_nothing_and_counts_nothing_twice(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    place = tmp_path / "scheduler.json"
    scheduler = _started(
        tmp_path, "dask_scheduler", "--no-show", "--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(place)
    )
    ours = ("--scheduler-file", str(place), "--nworkers", "1", "--nthreads", "1", "--no-nanny")
    workers = [_started(tmp_path, "dask_worker", *ours) for _ in range(2)]
    try:
        address = _address(place)
        killed = []

        def kill_one(done: int) -> None:
            if done == 3:
                workers[0].send_signal(signal.SIGKILL)
                killed.append(workers[0].pid)

        with executor(dask=address) as pool:
            results = sorted(each(pool, partial(leave_trace, str(tmp_path)), range(PIECES), kill_one))
        assert killed
        assert results == list(range(PIECES)), "nothing lost, nothing twice"
        assert sorted(int(path.stem) for path in tmp_path.glob("*.done")) == list(range(PIECES))
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait(timeout=10)


def test_a_cluster_that_is_not_there_is_one_clear_line(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("rig.parallel.SCHEDULER_PATIENCE_S", 1.0)
    with pytest.raises(RigError, match=r"^--dask 127\.0\.0\.1:1: no scheduler answers"), executor(dask="127.0.0.1:1"):
        pytest.fail("no cluster is there")


def _started(folder: Path, tool: str, *options: str) -> "subprocess.Popen[bytes]":
    """One process of the cluster, quiet, that can import the tests' work."""
    environment = os.environ | {"PYTHONPATH": TESTS}
    call = [sys.executable, "-m", f"distributed.cli.{tool}", "--no-dashboard", *options]
    return subprocess.Popen(call, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment, cwd=folder)


def _address(place: Path) -> str:
    """The scheduler's address once it has written it down and both workers are there."""
    import distributed

    for _ in range(300):
        if place.exists() and place.stat().st_size:
            break
        time.sleep(0.1)
    address: str = json.loads(place.read_text())["address"]
    with distributed.Client(address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    return address


TERMINAL_THAT_CLOSES = """
import os, signal
from multiprocessing import resource_tracker
from rig.parallel import executor
with executor(workers=1) as pool:
    pool.submit(int).result()
    os.kill(resource_tracker._resource_tracker._pid, signal.SIGHUP)
"""


def test_the_end_of_a_terminal_makes_no_tracebacks_of_the_pools_own_helper() -> None:
    """It hears all of a terminal's signals; `pamrig gap design 2> log` had eight tracebacks in its log."""
    command = [sys.executable, "-c", TERMINAL_THAT_CLOSES]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stderr) == (0, "")
