"""The page as the daemon keeps it: its socket, its key, and a daemon without the extra."""

import asyncio
import logging
import multiprocessing
import os
import socket
import stat
import threading
import time
from collections.abc import Callable, Coroutine
from multiprocessing.connection import Connection
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from rig.app import compose
from rig.errors import RigError, StateError
from rig.service.settings import Web
from rig.service.web import host
from rig.service.web.host import Page, bind, signing_key
from rig.service.web.page_setup import PageSetup


def setup(tmp_path: Path) -> PageSetup:
    return PageSetup(tmp_path / "s.sock", compose.load(None), True, tmp_path, tmp_path, local=True)


def test_a_port_that_nobody_asked_for_gives_way_and_one_that_was_asked_for_does_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        monkeypatch.setattr(host, "DEFAULT_PORT", port)
        with bind(Web()) as other:
            assert other.getsockname()[1] not in (0, port)
        with pytest.raises(StateError, match=f"127.0.0.1:{port}: the page cannot listen there"):
            bind(Web(port=port))
    with pytest.raises(StateError, match="cannot listen there"):
        bind(Web(host="no.such.host.invalid"))


def test_the_key_is_kept_for_the_user_alone_and_a_damaged_one_is_replaced(tmp_path: Path) -> None:
    key = signing_key(tmp_path)
    kept = tmp_path / "page.key"
    assert len(key) == 32
    assert signing_key(tmp_path) == key
    assert stat.S_IMODE(kept.stat().st_mode) == 0o600
    kept.write_bytes(b"short")
    assert len(signing_key(tmp_path)) == 32
    assert signing_key(tmp_path) != key


def test_a_link_in_the_keys_place_leads_nowhere(tmp_path: Path) -> None:
    target = tmp_path / "target"
    target.write_bytes(b"")
    (tmp_path / "page.new").symlink_to(target)
    assert len(signing_key(tmp_path)) == 32
    assert target.read_bytes() == b""


def test_off_is_off(tmp_path: Path) -> None:
    page = Page(Web(on=False), setup(tmp_path))
    page.open()
    assert (page.url, page.to_json()) == ("", None)
    page.close()


def test_without_the_extra_there_is_no_page_and_the_log_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(host, "missing_packages", lambda: ["starlette"])
    page = Page(Web(), setup(tmp_path))
    with caplog.at_level(logging.WARNING, "pamrig"):
        page.open()
    assert page.to_json() is None
    assert "pip install 'pamrig[web]'" in caplog.text


def test_a_token_that_is_too_short_is_refused_before_anything_listens(tmp_path: Path) -> None:
    token = tmp_path / "token"
    token.write_text("short")
    page = Page(Web(host="0.0.0.0", token_file=token), setup(tmp_path))
    with pytest.raises(RigError, match="at least 16 characters"):
        page.open()
    assert page.to_json() is None


class _SlowToEnd:
    """In place of a process that is lost, and ends only when it gets a processor."""

    pid = None

    def __init__(self, joined: threading.Event, over: threading.Event) -> None:
        self._joined, self._over = joined, over

    def is_alive(self) -> bool:
        return False

    def kill(self) -> None:
        pass

    def join(self) -> None:
        self._joined.set()
        assert self._over.wait(3.0)


def watch(folder: Path, seen: Callable[[Page, "asyncio.Future[None]"], Coroutine[Any, Any, None]]) -> None:
    """A page that is opened and watched, as in the daemon, while `seen` looks on."""
    page = Page(Web(), setup(folder))

    async def both() -> None:
        watching = asyncio.ensure_future(page.watch())
        await seen(page, watching)
        watching.cancel()
        with pytest.raises(asyncio.CancelledError):
            await watching

    page.open()
    try:
        asyncio.run(both())
    finally:
        page.close()


def test_every_page_of_a_daemon_has_the_date_at_which_the_first_was_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[PageSetup] = []

    def process(args: tuple[PageSetup, ...], **_: object) -> _SlowToEnd:
        told.append(args[0])
        return _SlowToEnd(threading.Event(), over)

    over = threading.Event()
    over.set()
    monkeypatch.setattr(host, "start_process", lambda process: None)
    monkeypatch.setattr(
        multiprocessing, "get_context", lambda _: SimpleNamespace(Pipe=multiprocessing.Pipe, Process=process)
    )
    dates = iter((1e9, *[2e9] * 100))
    monkeypatch.setattr(time, "time", lambda: next(dates))

    async def seen(page: Page, _: "asyncio.Future[None]") -> None:
        while not page.restarts:
            await asyncio.sleep(0.001)

    before_s = time.monotonic()
    watch(tmp_path, seen)
    assert len(told) > 2
    assert {setup.epoch_s for setup in told} == {told[0].epoch_s}
    assert 1e9 - time.monotonic() <= told[0].epoch_s <= 1e9 - before_s


def test_the_daemon_s_own_loop_does_not_wait_for_a_page_to_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    joined, over = threading.Event(), threading.Event()
    monkeypatch.setattr(host, "start_process", lambda process: None)
    context = SimpleNamespace(Pipe=multiprocessing.Pipe, Process=lambda **_: _SlowToEnd(joined, over))
    monkeypatch.setattr(multiprocessing, "get_context", lambda _: context)

    async def seen(_: Page, watching: "asyncio.Future[None]") -> None:
        try:
            while not joined.is_set() and not watching.done():
                await asyncio.sleep(0.001)
        finally:
            over.set()  # only a loop that goes on comes here in time
        await asyncio.sleep(0.01)

    watch(tmp_path, seen)
    assert joined.is_set(), "somebody waited for the process, and the loop went on"


class _Importing:
    """In place of the page's process: alive, and beats when it is told to."""

    pid = None

    def __init__(self, pipe: Connection) -> None:
        self.pipe = Connection(os.dup(pipe.fileno()))

    def is_alive(self) -> bool:
        return True

    def kill(self) -> None:
        self.pipe.close()

    def join(self) -> None:
        pass


def test_a_page_that_has_not_beaten_yet_imports_and_does_not_hang(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[_Importing] = []

    def process(args: tuple[Any, ...], **_: object) -> _Importing:
        made.append(_Importing(args[2]))
        return made[-1]

    for name, value in {"PAGE_SILENCE_S": 0.0, "PAGE_LOOK_S": 0.001, "start_process": lambda _: None}.items():
        monkeypatch.setattr(host, name, value)
    monkeypatch.setattr(host, "is_stopped", lambda _: False)
    context = SimpleNamespace(Pipe=multiprocessing.Pipe, Process=process)
    monkeypatch.setattr(multiprocessing, "get_context", lambda _: context)

    async def seen(page: Page, _: "asyncio.Future[None]") -> None:
        await asyncio.sleep(0.05)
        assert page.restarts == 0
        made[0].pipe.send_bytes(b".")  # from here on silence is a page that hangs
        for _ in range(3000):
            if page.restarts:
                break
            await asyncio.sleep(0.001)
        assert page.restarts == 1

    watch(tmp_path, seen)
