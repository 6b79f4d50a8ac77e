"""A process for what may be large, slow or a trap: what becomes of it where the machine allows little."""

import asyncio
import errno
import os
import resource
import signal
import threading
import time
from multiprocessing.connection import Connection

import pytest

from rig.errors import RigError
from rig.service import helper_process
from rig.service.helper_process import HelperProcess
from rig.service.requests import serve_requests

GB = 1024**3


def serve_within(pipe: Connection, hard_bytes: int) -> None:
    """Entry of one whose user, or whose service, has a limit of its own."""
    resource.setrlimit(resource.RLIMIT_AS, (hard_bytes, hard_bytes))
    serve_requests(pipe, lambda: resource.getrlimit(resource.RLIMIT_AS), 2 * GB)


@pytest.mark.parametrize(("hard_gb", "soft_gb"), [(3, 2), (1, 1)])
def test_a_limit_that_is_there_already_is_kept(hard_gb: int, soft_gb: int) -> None:
    """It was lifted for root, and anybody else's process ended by that: no sweep could be started."""
    helper = HelperProcess(serve_within, (hard_gb * GB,), "pamrig-test")
    try:
        assert helper.ask((), 60.0) == (soft_gb * GB, hard_gb * GB)
    finally:
        helper.close()


def serve_its_pid(pipe: Connection) -> None:
    """Entry of one that says who it is."""
    serve_requests(pipe, os.getpid, 2 * GB)


def test_one_that_somebody_has_stopped_is_replaced() -> None:
    """A `start` waited for two minutes, and was told that its sweep is too large."""
    helper = HelperProcess(serve_its_pid, (), "pamrig-test")
    try:
        first = helper.ask((), 60.0)
        os.kill(first, signal.SIGSTOP)
        assert helper.ask((), 60.0) != first
        with pytest.raises(ProcessLookupError):
            os.kill(first, 0)
    finally:
        helper.close()


def serve_slowly(pipe: Connection) -> None:
    """Entry of one that answers when it is too late."""
    serve_requests(pipe, time.sleep, 2 * GB)


def test_who_is_cancelled_before_his_thread_has_begun_leaves_no_request_behind() -> None:
    """His thread started a process for nobody, whose answer the next request waited for, or took for its own."""
    helper = HelperProcess(serve_slowly, (), "pamrig-test")
    begin, over = threading.Event(), threading.Event()

    def exchange(request: tuple[float]) -> None:
        assert begin.wait(30.0)
        try:
            helper.ask(request, 60.0)
        finally:
            over.set()

    async def cancel() -> None:
        asked = asyncio.ensure_future(helper.asked((60.0,), exchange))
        await asyncio.sleep(0)
        asked.cancel()
        asyncio.get_running_loop().call_later(0.05, begin.set)
        with pytest.raises(asyncio.CancelledError):
            await asyncio.wait_for(asked, 30.0)

    try:
        asyncio.run(cancel())
        assert over.is_set()
        assert helper.process is None
    finally:
        helper.close()


def test_where_no_process_can_be_had_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """It ended the daemon, as an error in the daemon itself."""

    def full(_: object) -> None:
        raise OSError(errno.EAGAIN, "Resource temporarily unavailable")

    monkeypatch.setattr(helper_process, "start_process", full)
    helper = HelperProcess(serve_within, (GB,), "pamrig-test")
    with pytest.raises(RigError, match="pamrig-test: this machine gives no process for it: Resource temporarily"):
        helper.ask((), 1.0)
    helper.close()  # it was an error in the daemon itself at its end, which nothing came after
