"""The daemon's better place in the scheduler is the session's, and is given back: the shell that it was started from
lives on."""

import os
import sys
from pathlib import Path

import pytest

from rig.service.daemon import attention


@pytest.fixture(autouse=True)
def as_before(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing of this process itself is changed."""
    monkeypatch.setattr(os, "setpriority", lambda *_: None)
    monkeypatch.setattr(sys, "setswitchinterval", lambda _: None)


def interrupted(session: Path) -> None:
    """A daemon that ends by Ctrl-C while it has its place."""
    with attention(session):
        assert int(session.read_text(encoding="ascii")) < 0
        raise KeyboardInterrupt


def test_a_sessions_place_is_given_back_however_the_daemon_ends(tmp_path: Path) -> None:
    session = tmp_path / "autogroup"
    session.write_text("/autogroup-7 nice 3\n", encoding="ascii")
    with pytest.raises(KeyboardInterrupt):
        interrupted(session)
    assert session.read_text(encoding="ascii") == "3"


def test_where_the_kernel_shares_by_processes_nothing_is_asked_of_a_session(tmp_path: Path) -> None:
    with attention(tmp_path / "none"):
        pass
    assert not list(tmp_path.iterdir())


def test_a_session_without_a_place_is_left_as_it_is(tmp_path: Path) -> None:
    session = tmp_path / "autogroup"
    session.touch()
    with attention(session):
        assert session.read_bytes() == b""
    assert session.read_bytes() == b""


def test_without_the_right_to_it_nothing_is_touched(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: int) -> None:
        raise PermissionError

    monkeypatch.setattr(os, "setpriority", refused)
    session = tmp_path / "autogroup"
    session.write_text("/autogroup-7 nice 0\n", encoding="ascii")
    with attention(session):
        pass
    assert session.read_text(encoding="ascii") == "/autogroup-7 nice 0\n"
