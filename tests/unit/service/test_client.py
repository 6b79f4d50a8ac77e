"""The client of a server that is crowded: an emergency stop is said again until somebody hears it."""

import itertools
import json
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from rig.errors import RigError
from rig.service import client
from rig.service.client import Client
from rig.service.connections import protocol
from rig.service.processes import DISK_PATIENCE_S


@contextmanager
def server(path: Path, sent_away: int, *, keeps_first: bool = True) -> Iterator[list[bytes]]:
    """The first caller is let in and not answered, or sent away; of those after him so many are sent away unheard, the
    next is answered. Yields what was heard."""
    heard: list[bytes] = []
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))
        listening.listen(8)

        def keep() -> None:
            first, _ = listening.accept()
            if not keeps_first:
                first.close()
            for number in range(sent_away + 1):
                caller, _ = listening.accept()
                with caller:
                    if number == sent_away:
                        heard.append(caller.recv(4096))
                        caller.sendall(protocol.answer(json.loads(heard[-1])["id"], {"words": "safe"}))
            first.close()

        thread = threading.Thread(target=keep)
        thread.start()
        yield heard
        thread.join(10.0)


@pytest.mark.parametrize("sent_away", [0, 1, 5])
def test_who_is_crowded_out_says_the_emergency_stop_again(tmp_path: Path, sent_away: int) -> None:
    with server(tmp_path / "s", sent_away) as heard, Client(tmp_path / "s") as caller:
        assert caller.estop() == {"words": "safe"}
    assert [json.loads(line)["command"] for line in heard] == ["estop"]


def test_who_is_crowded_out_again_and_again_rests_a_little_longer_each_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    rests: list[float] = []
    monkeypatch.setattr(time, "sleep", rests.append)
    with server(tmp_path / "s", 12), Client(tmp_path / "s") as caller:
        caller.estop()
    assert len(rests) == 12
    assert rests == sorted(rests)
    assert 0.0 < rests[0] <= 0.002
    assert rests[-2:] == [0.05, 0.05]


def test_everything_else_is_not_said_twice(tmp_path: Path) -> None:
    with server(tmp_path / "s", 0, keeps_first=False), Client(tmp_path / "s") as caller:
        with pytest.raises(RigError, match="the daemon hung up"):
            caller.call("start")
        assert caller.estop() == {"words": "safe"}


def test_a_reset_bears_with_a_recorder_that_waits_for_its_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    borne_s: list[float] = []
    set_timeout = socket.socket.settimeout

    def noted(this: socket.socket, value: float) -> None:
        borne_s.append(value)
        set_timeout(this, value)

    with server(tmp_path / "s", 0, keeps_first=False), Client(tmp_path / "s", timeout_s=7.0) as caller:
        monkeypatch.setattr(socket.socket, "settimeout", noted)
        with pytest.raises(RigError, match="the daemon hung up"):
            caller.reset()
        assert caller.estop() == {"words": "safe"}
    assert borne_s[0] > 7.0 + DISK_PATIENCE_S
    assert borne_s[1] == 7.0


def test_a_daemon_that_is_gone_meanwhile_is_said_to_be(tmp_path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen(1)
        caller = Client(tmp_path / "s")
    with caller, pytest.raises(RigError, match="the daemon behind this socket is gone"):
        caller.estop()


def test_where_nobody_ever_hears_it_the_caller_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    passed = itertools.count(step=2.0 * client.ESTOP_TIMEOUT_S)
    with server(tmp_path / "s", 1), Client(tmp_path / "s") as caller:
        with monkeypatch.context() as clock:
            clock.setattr(time, "monotonic", lambda: next(passed))
            with pytest.raises(RigError, match="the daemon hung up"):
                caller.estop()
        assert caller.estop() == {"words": "safe"}


def test_a_connection_that_was_not_answered_in_time_is_of_no_use_any_more_and_says_so(tmp_path: Path) -> None:
    """The second call ended in an error of Python's own."""
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(tmp_path / "s"))
        listening.listen(1)
        with Client(tmp_path / "s", timeout_s=0.01) as caller:
            for _ in range(2):
                with pytest.raises(RigError, match="the daemon does not answer"):
                    caller.status()
