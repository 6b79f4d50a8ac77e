"""Where socket and locks lie: what somebody else put there is found out, not followed, waited for or removed."""

import errno
import os
import re
import secrets
import socket
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.errors import RigError, StateError
from rig.service.client import Client
from rig.service.connections import socket_access
from rig.service.settings import make_daemon_folder


@pytest.fixture
def own(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The user's folder where the system gives him none, below another root than /tmp."""
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path))
    for name in ("PAMRIG_SOCKET", "XDG_RUNTIME_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(socket_access, "SERVICE_SOCKET", tmp_path / "none" / "pamrig.sock")
    return tmp_path / f"pamrig-{os.getuid()}"


@pytest.fixture
def listening() -> Iterator[Path]:
    """A socket on which this process listens, under a path that is short enough."""
    with tempfile.TemporaryDirectory(prefix=secrets.token_hex(2)) as folder, socket.socket(socket.AF_UNIX) as server:
        server.bind(f"{folder}/s")
        server.listen()
        yield Path(folder) / "s"


def test_without_a_runtime_folder_the_socket_lies_in_a_folder_of_one_s_own(own: Path) -> None:
    assert socket_access.default_socket() == own / "pamrig.sock"
    socket_access.check_folder(own)  # a folder that is not there is no daemon, and no trap
    socket_access.check_folder(own, make=True)
    assert own.stat().st_mode & 0o777 == 0o700
    socket_access.check_folder(own, make=True)


@pytest.mark.parametrize("kind", ["open to others", "another user's", "a link", "a file"])
def test_a_folder_that_somebody_else_made_is_refused_on_both_ends(
    own: Path, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    uid = os.getuid()
    if kind == "a link":
        (own.parent / "theirs").mkdir(mode=0o700)
        own.symlink_to("theirs")
    elif kind == "a file":
        own.touch(0o600)
    else:
        own.mkdir(mode=0o700)
        own.chmod(0o755 if kind == "open to others" else 0o700)
    if kind == "another user's":
        monkeypatch.setattr(socket_access, "own_folder", lambda: own)
        monkeypatch.setattr(os, "getuid", lambda: uid + 1)
    for make in (False, True):
        with pytest.raises(
            StateError, match=r"is not a folder of yours alone .*: somebody else made it; set PAMRIG_SOCKET"
        ):
            socket_access.check_folder(own, make=make)
    with pytest.raises(StateError, match="is not a folder of yours alone"):
        Client()


def test_what_is_refused_at_another_user_s_place_says_whose_it_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    own, unknown = os.getuid(), 54321
    assert socket_access.owned_by(tmp_path / "pamrig.sock") == ""
    monkeypatch.setattr(os, "geteuid", lambda: unknown)
    name = f"; {tmp_path} is of user {socket_access.user_name(own)}"
    assert socket_access.owned_by(tmp_path / "hidden" / "pamrig.sock") == name
    assert str(own) in name
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(RigError, match=rf"{tmp_path}: cannot be written to{re.escape(name)}"):
        make_daemon_folder(tmp_path)

    def refused(*_: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(socket, "socket", type("Shut", (socket.socket,), {"connect": refused}))
    with pytest.raises(RigError, match=f"not allowed: that daemon is for its own user, root and .*{re.escape(name)}$"):
        Client(tmp_path / "pamrig.sock")
    monkeypatch.setattr(os, "open", refused)
    with pytest.raises(StateError, match=f"cannot be made: Permission denied{re.escape(name)}$"):
        socket_access.take_lock(tmp_path / "lock", "taken")


def test_a_user_without_a_name_is_a_number() -> None:
    assert socket_access.user_name(54321) == "54321"


def test_a_stale_socket_makes_way_and_neither_one_in_use_nor_a_file_of_somebody_s_does(
    listening: Path, tmp_path: Path
) -> None:
    with pytest.raises(StateError, match="another daemon is running, though its lock file is gone"):
        socket_access.remove_stale_socket(listening)
    assert listening.is_socket()
    stale = listening.with_name("stale")
    with socket.socket(socket.AF_UNIX) as gone:
        gone.bind(str(stale))
    socket_access.remove_stale_socket(stale)
    assert not stale.exists()
    socket_access.remove_stale_socket(stale)
    record = tmp_path / "record.mcap"
    record.write_bytes(b"measured")
    with pytest.raises(StateError, match=r"record.mcap: is there already and is no socket"):
        socket_access.remove_stale_socket(record)
    assert record.read_bytes() == b"measured"


def test_a_lock_follows_no_link_and_waits_for_no_pipe(tmp_path: Path) -> None:
    target = tmp_path / "target"
    (tmp_path / "link").symlink_to(target)
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(StateError, match="link: cannot be made: it is a symbolic link"):
        socket_access.take_lock(tmp_path / "link", "taken")
    with pytest.raises(StateError, match="pipe: is no regular file, as a lock is"):
        socket_access.take_lock(tmp_path / "pipe", "taken")
    assert not target.exists()


def test_a_lock_of_another_user_in_a_folder_of_everybody_s_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path.chmod(0o1777)
    (tmp_path / "lock").touch()
    monkeypatch.setattr(os, "geteuid", lambda: 12345)
    with pytest.raises(StateError, match=r"lock: belongs to user .*0.*, not to you"):
        socket_access.take_lock(tmp_path / "lock", "taken")


def test_a_lock_is_held_until_it_is_closed(tmp_path: Path) -> None:
    first = socket_access.take_lock(tmp_path / "lock", "taken")
    with pytest.raises(StateError, match=r"^taken$"):
        socket_access.take_lock(tmp_path / "lock", "taken")
    os.close(first)
    os.close(socket_access.take_lock(tmp_path / "lock", "taken"))


def test_a_folder_is_locked_by_every_path_that_leads_there_and_whatever_is_deleted_in_it(tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    (tmp_path / "link").symlink_to("state")
    first = socket_access.lock_folder(tmp_path / "state", "taken")
    assert first is not None
    for path in ("link", "state/../link", "state"):
        with pytest.raises(StateError, match=r"^taken$"):
            socket_access.lock_folder(tmp_path / path, "taken")
    os.close(first)
    again = socket_access.lock_folder(tmp_path / "link", "taken")
    assert again is not None
    os.close(again)


def test_the_kernel_says_who_listens_and_a_stranger_is_not_believed(
    listening: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Client(listening).close()
    with socket.socket(socket.AF_UNIX) as connection:
        connection.connect(str(listening))
        assert socket_access.peer_uid(connection) == os.getuid()
    monkeypatch.setattr(socket_access, "peer_uid", lambda _: 12345)
    with pytest.raises(
        StateError, match="who listens there is user 12345, neither you nor root: not a daemon to rely on"
    ):
        Client(listening)


def test_who_may_command_is_the_user_root_and_whom_the_group_has_let_in(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX) as any_socket:
        for uid, group, may in ((os.getuid(), "", True), (0, "", True), (12345, "", False), (12345, "pamrig", True)):
            monkeypatch.setattr(socket_access, "peer_uid", lambda _, uid=uid: uid)
            assert socket_access.may_command(any_socket, group) is may


@pytest.mark.parametrize(("umask", "left"), [(0o000, 0o002), (0o002, 0o002), (0o022, 0o022), (0o077, 0o077)])
def test_what_a_daemon_makes_is_not_everybody_s_to_write_to(umask: int, left: int) -> None:
    before = os.umask(umask)
    try:
        socket_access.keep_others_out()
    finally:
        assert os.umask(before) == left


def test_a_state_folder_is_its_owner_s_alone_to_write_to(tmp_path: Path) -> None:
    before = os.umask(0)
    try:
        make_daemon_folder(tmp_path / "state", socket_access.OWN_MODE)
    finally:
        os.umask(before)
    assert (tmp_path / "state").stat().st_mode & 0o777 == 0o755


@pytest.mark.parametrize("mode", [0o777, 0o775, 0o2777])
def test_a_folder_of_ones_own_is_closed_to_others_and_that_is_said(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, mode: int
) -> None:
    tmp_path.chmod(mode)
    socket_access.keep_others_from(tmp_path, "the queue")
    assert tmp_path.stat().st_mode & 0o7777 == mode & ~0o022
    (line,) = caplog.messages
    assert line.startswith(f"{tmp_path}: is to hold the queue, and others could write there (mode {mode:o})")
    socket_access.keep_others_from(tmp_path, "the queue")
    assert len(caplog.messages) == 1


def test_a_folder_of_another_users_holds_nothing_of_a_daemon(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    uid = os.geteuid()
    monkeypatch.setattr(os, "geteuid", lambda: uid + 1)
    with pytest.raises(StateError, match=rf"is to hold the queue, and is of user .*{uid}.*; give a folder of your own"):
        socket_access.keep_others_from(tmp_path, "the queue")


def test_where_everybody_has_something_the_socket_may_lie_and_no_queue(tmp_path: Path) -> None:
    tmp_path.chmod(0o1777)
    socket_access.keep_others_from(tmp_path, "the socket", among_others=True)
    with pytest.raises(StateError, match=r"is meant for everybody \(mode 1777\); give a folder of your own"):
        socket_access.keep_others_from(tmp_path, "the queue")
    assert tmp_path.stat().st_mode & 0o7777 == 0o1777


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to somebody else")
def test_what_others_have_put_into_an_open_folder_is_not_gone_by(tmp_path: Path) -> None:
    tmp_path.chmod(0o777)
    (tmp_path / "queue.json").touch()
    os.chown(tmp_path / "queue.json", 54321, -1)
    with pytest.raises(StateError, match=r"others have put something there \(queue.json, of user 54321\) \(mode 777\)"):
        socket_access.keep_others_from(tmp_path, "the queue")
    assert tmp_path.stat().st_mode & 0o777 == 0o777


def test_a_file_system_without_modes_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tmp_path.chmod(0o777)
    monkeypatch.setattr(Path, "chmod", lambda *_: None)
    with pytest.raises(StateError, match=r"others may write there .mode 777., which cannot be changed"):
        socket_access.keep_others_from(tmp_path, "the queue")
