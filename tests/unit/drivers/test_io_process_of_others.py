"""Mailboxes of other users: whose I/O process is reached, and what somebody puts where mailboxes lie."""

import errno
import os
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.io_process import lookup
from drivers.io_process import mailbox as mailboxes
from drivers.io_process.alarm import alarm, confirmed
from drivers.io_process.mailbox import IoMailbox, LinkState, OutputsMode, Report
from drivers.io_process.owner import IoProcess
from drivers.io_process.worker import WorkerSetup
from rig.errors import DeviceLost

STRANGER = 54321
"""A user who is in nobody's group."""


@pytest.fixture
def served_by_another() -> Iterator[tuple[str, Path, int]]:
    """A wire, the mailbox that another user's I/O process has for it, and the descriptor by which that one lives."""
    resource = f"a wire of process {os.getpid()}"
    own = lookup.path_for(resource)
    path = own.with_name(own.name.replace(f"-{os.getuid()}-", f"-{os.getuid() + 1}-"))
    descriptor = mailboxes.create(path)
    assert descriptor is not None
    yield resource, path, descriptor
    path.unlink()


def close_to_writers(monkeypatch: pytest.MonkeyPatch, path: Path) -> None:
    """As another user's file is; root would get past its mode."""
    opened = os.open

    def guarded(place: Any, flags: int, *more: Any) -> int:
        if place == path and flags & os.O_RDWR:
            raise PermissionError(errno.EACCES, "Permission denied")
        return opened(place, flags, *more)

    monkeypatch.setattr(os, "open", guarded)


def test_root_reaches_the_io_process_of_any_user(served_by_another: tuple[str, Path, int]) -> None:
    """By its own name alone root found none, opened the port beside it, and both wrote."""
    resource, path, descriptor = served_by_another
    found = lookup.find(resource)
    assert found is not None
    assert found[0] == path
    found[1].close()
    with pytest.raises(DeviceLost, match="in use by another I/O process of user "):
        IoProcess(resource, WorkerSetup("m", {}, (), 0), WorkerSetup("m", {}, (), 0), 1).start()
    os.close(descriptor)
    assert lookup.find(resource) is None


def test_another_users_io_process_is_named_and_takes_no_orders(
    served_by_another: tuple[str, Path, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    resource, path, descriptor = served_by_another
    close_to_writers(monkeypatch, path)
    assert path.stat().st_mode & 0o777 == 0o644
    for call in (
        lambda: alarm(resource, 0.0),
        lambda: confirmed(resource),
        lambda: IoProcess(resource, WorkerSetup("m", {}, (), 0), WorkerSetup("m", {}, (), 0), 1).start(),
    ):
        with pytest.raises(DeviceLost, match=r"served by an I/O process of user .*, which takes no orders from user "):
            call()
    os.close(descriptor)
    assert alarm(resource, 0.0) is False, "it is gone"


@pytest.fixture
def port(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[Path, Path]]:
    """A serial port, and a mailbox of a stranger's for it that he holds."""
    port = tmp_path / "ttyUSB0"
    port.touch()
    own = lookup.path_for(str(port))
    path = own.with_name(own.name.replace(f"-{os.getuid()}-", f"-{STRANGER}-"))
    descriptor = mailboxes.create(path)
    assert descriptor is not None
    found = os.lstat

    def lstat(place: Any, **more: Any) -> Any:
        return SimpleNamespace(st_uid=STRANGER) if place == path else found(place, **more)

    monkeypatch.setattr(os, "lstat", lstat)
    yield port, path
    os.close(descriptor)
    path.unlink()


@pytest.mark.parametrize(("mode", "believed"), [(0o660, False), (0o666, True)])
def test_a_mailbox_is_believed_of_who_may_open_the_port(port: tuple[Path, Path], mode: int, believed: bool) -> None:
    """Anybody could forge one, and root took its word for the safe set-points."""
    port[0].chmod(mode)
    found = lookup.find(str(port[0]))
    assert (found is not None) is believed
    if found is not None:
        found[1].close()


def test_a_group_that_may_open_the_port_is_believed(port: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    port[0].chmod(0o660)
    monkeypatch.setattr(lookup.pwd, "getpwuid", lambda uid: SimpleNamespace(pw_name="somebody", pw_gid=uid))
    monkeypatch.setattr(os, "getgrouplist", lambda name, gid: [gid, port[0].stat().st_gid])
    found = lookup.find(str(port[0]))
    assert found is not None
    assert found[0] == port[1], "that of the group's member, and no other"
    found[1].close()


def test_no_signal_goes_to_a_process_that_is_not_the_mailbox_s_user_s(tmp_path: Path) -> None:
    """Whatever number stood in a forged mailbox was killed when it did not move, by root."""
    descriptor = mailboxes.create(tmp_path / "box")
    assert descriptor is not None
    if os.getuid() == 0:
        os.fchown(descriptor, STRANGER, -1)
    box = IoMailbox(descriptor)
    box.served_by(1, 0)
    with box.process() as found:
        assert found is None


def test_the_process_behind_one_s_own_mailbox_is_reached(tmp_path: Path) -> None:
    descriptor = mailboxes.create(tmp_path / "box")
    assert descriptor is not None
    box = IoMailbox(descriptor)
    box.served_by(os.getpid(), 0)
    with box.process() as found:
        assert found is not None
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(found)


@pytest.mark.parametrize("kind", ["fifo", "link", "folder", "short file"])
@pytest.mark.parametrize("closed", [False, True])
def test_what_is_no_mailbox_keeps_nobody_from_the_wire(
    kind: str, closed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pipe was waited for, and a link was the end of whoever wanted to make safe."""
    resource = f"a wire of process {os.getpid()} beside {kind}"
    path = lookup.path_for(resource)
    path = path.with_name(path.name.replace(f"-{os.getuid()}-", f"-{STRANGER}-"))
    {
        "fifo": os.mkfifo,
        "link": lambda place: os.symlink("/etc/passwd", place),
        "folder": os.mkdir,
        "short file": lambda place: place.write_bytes(b"x"),
    }[kind](path)
    if closed:
        close_to_writers(monkeypatch, path)
    try:
        assert alarm(resource, 0.0) is False
        assert confirmed(resource) is None
    finally:
        path.rmdir() if kind == "folder" else path.unlink()


def test_numbers_that_no_process_of_ours_writes_are_no_news(tmp_path: Path) -> None:
    descriptor = mailboxes.create(tmp_path / "box")
    assert descriptor is not None
    box = IoMailbox(descriptor)
    box.post_order(1, OutputsMode.DRIVE, (1.0,))
    box.post_report(Report(state=LinkState.UP))
    assert (box.order().mode, box.report().state) == (OutputsMode.DRIVE, LinkState.UP)
    box.post_order(2, 77, ())  # type: ignore[arg-type]
    box.post_report(Report(state=77))  # type: ignore[arg-type]
    assert (box.order().mode, box.report().state) == (OutputsMode.DRIVE, LinkState.UP)


def test_another_user_s_file_is_not_taken_for_a_mailbox_of_one_s_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its user could order set-points by it."""
    monkeypatch.setattr(os, "geteuid", lambda: STRANGER)
    with pytest.raises(DeviceLost, match="another user's file is there"):
        mailboxes.create(tmp_path / "box")
