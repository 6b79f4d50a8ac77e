"""The process that reads sweeps: what comes out of it, and that what is sent to it cannot hold up or fill anything
else."""

import asyncio
import os
import signal
import threading
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from rig.app import compose
from rig.errors import RigError
from rig.realtime.commands import program_path
from rig.realtime.program import Program
from rig.realtime.shared import SharedBlock
from rig.service.helper_process import HelperProcess
from rig.service.queue.planner import Planner

RIG = compose.load(None)
SESSION = 0x1234567890ABCDEF
SWEEP = "settle_s: 0.1\nduration_s: 1.0\nrecords: [{sine: {frequency_hz: [0.5, 1], amplitude_mpa: 0.1}}]\n"


def asked(ask: Callable[[Planner], Awaitable[Any]], patience_s: float = 30.0) -> Any:
    """What a fresh planner answers."""

    async def run() -> Any:
        planner = Planner(RIG, patience_s)
        try:
            return await ask(planner)
        finally:
            planner.close()

    return asyncio.run(run())


@pytest.fixture
def sweep(tmp_path: Path) -> Iterator[Path]:
    path = tmp_path / "short.yaml"
    path.write_text(SWEEP)
    yield path
    program_path(SESSION, 7).unlink(missing_ok=True)


def test_the_text_of_a_sweep_is_kept_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "short.yaml").write_bytes(SWEEP.replace("\n", "\r\n").encode())
    assert asked(lambda planner: planner.check(tmp_path / "short.yaml")).text.count(b"\r\n") == SWEEP.count("\n")


def test_a_sweep_is_summed_up_and_a_record_s_program_lies_in_shared_memory(sweep: Path) -> None:
    async def talk(planner: Planner) -> Any:
        return await planner.open(sweep), await planner.publish(1, 7, SESSION)

    summary, record = asked(talk)
    assert (summary.records, summary.text) == (2, SWEEP.encode())
    assert summary.seconds == pytest.approx(2 * (0.1 + 0.5 + 0.5 + 1.0 + 1.0))
    assert (record.name, record.sweep_ticks, record.facts["frequency_hz"]) == ("sine_1hz_0.10mpa", 200, 1.0)
    block = SharedBlock.adopt(program_path(SESSION, 7), SESSION)
    program = Program.attach(block.path, SESSION)
    assert (program.ticks, len(program.p1_cmd_mpa)) == (record.ticks, 200)
    assert program.p1_cmd_mpa[50] - program.p2_cmd_mpa[50] == pytest.approx(0.1)
    assert block.words[1] == os.getpid(), "who adopted it is its owner"


def test_what_does_not_fit_is_refused_in_the_same_line_as_ever(tmp_path: Path) -> None:
    (tmp_path / "wide.yaml").write_text("records: [{sine: {frequency_hz: 1, amplitude_mpa: 0.9}}]")
    for name, said in (
        ("wide.yaml", "wide.yaml: sine_1hz_0.90mpa: set-point p2 would be"),
        ("none.yaml", "no such file"),
    ):
        with pytest.raises(RigError, match=said):
            asked(lambda planner, name=name: planner.check(tmp_path / name))


def test_one_that_takes_too_long_is_killed_and_the_next_is_served(tmp_path: Path, sweep: Path) -> None:
    slow = tmp_path / "slow.yaml"
    slow.write_text(
        "records: [{multisine: {amplitude_mpa: 0.1, low_hz: 0.1, high_hz: 20, period_s: 100}, duration_s: 80000}]"
    )

    async def talk(planner: Planner) -> Any:
        await planner.warm()
        with pytest.raises(RigError, match=r"slow.yaml: takes more than 3 s to read and expand; make it smaller"):
            await planner.check(slow)
        return await planner.check(sweep)

    assert asked(talk, 3.0).records == 2


def test_one_that_dies_is_told_and_replaced_and_does_not_pretend_to_know_the_sweep(sweep: Path) -> None:
    async def talk(planner: Planner) -> None:
        await planner.open(sweep)
        process: Any = planner.process
        os.kill(process.pid, signal.SIGKILL)
        process.join()
        with pytest.raises(RigError, match="the process that read the sweep was replaced; start the sweep again"):
            await planner.publish(0, 7, SESSION)

    asked(talk)


def test_the_end_of_the_daemon_waits_for_no_sweep(tmp_path: Path) -> None:
    slow = tmp_path / "slow.yaml"
    slow.write_text(
        "records: [{multisine: {amplitude_mpa: 0.1, low_hz: 0.1, high_hz: 20, period_s: 100}, duration_s: 80000}]"
    )

    async def talk(planner: Planner) -> float:
        await planner.warm()
        task = asyncio.create_task(planner.check(slow))
        await asyncio.sleep(0.2)
        began = time.monotonic()
        planner.close()
        with pytest.raises(RigError):
            await task
        return time.monotonic() - began

    assert asked(talk) < 5.0


def test_the_event_loop_does_not_wait_for_a_process_to_end(sweep: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An emergency stop is answered there; a process that is killed ends when it gets a processor."""
    ending, over = threading.Event(), threading.Event()

    def end_slowly(helper: HelperProcess) -> None:
        ending.set()
        assert over.wait(30.0)
        end(helper)

    end = HelperProcess.end
    monkeypatch.setattr(HelperProcess, "end", end_slowly)

    async def talk(planner: Planner) -> Any:
        await planner.warm()
        assert planner.process is not None
        os.kill(planner.process.pid or 0, signal.SIGSTOP)
        gone = asyncio.ensure_future(planner.check(sweep))
        after = asyncio.ensure_future(planner.check(sweep))
        await asyncio.sleep(0.05)
        gone.cancel()
        while not ending.is_set():  # the loop goes on
            await asyncio.sleep(0.001)
        gone.cancel()  # and again, as by a second stop
        await asyncio.sleep(0.01)
        assert not gone.done()
        over.set()
        return await asyncio.gather(gone, after, return_exceptions=True)

    gone, after = asked(talk)
    assert isinstance(gone, asyncio.CancelledError)
    assert after.records == 2
